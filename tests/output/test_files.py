"""Files written whole or not at all."""

import os
from threading import Thread

import pytest

from mdfconv.output.files import write_files


def test_several_files_are_written_all_or_none(tmp_path):
    (tmp_path / "taken").mkdir()
    (tmp_path / "old").write_text("old")
    with pytest.raises(ValueError, match="cannot write"):
        write_files({tmp_path / "old": b"new", tmp_path / "taken": b"x"})
    assert (tmp_path / "old").read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["old", "taken"]
    write_files({tmp_path / "old": b"new", tmp_path / "more": b"x"})
    assert (tmp_path / "old").read_text() == "new"


def test_a_link_stays_one_and_a_pipe_is_written_to(tmp_path):
    place, link, pipe = tmp_path / "place", tmp_path / "link", tmp_path / "pipe"
    link.symlink_to(place)
    os.mkfifo(pipe)
    read = []
    reader = Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    write_files({link: b"through", pipe: b"on"})
    reader.join()
    assert link.is_symlink()
    assert place.read_bytes() == b"through"
    assert pipe.is_fifo()
    assert read == [b"on"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "pipe", "place"]
