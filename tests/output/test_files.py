"""Files written whole or not at all."""

import errno
import itertools
import os
import signal
import subprocess
import sys
from threading import Thread

import pytest

from mdfconv.errors import MdfconvError
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


def state(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("call", ["replace", "link", "fsync", "chmod"])
@pytest.mark.parametrize("turn", range(4))
def test_a_failure_at_any_step_changes_nothing(tmp_path, monkeypatch, call, turn):
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(b"old " + name.encode())
    before = state(tmp_path)
    real, turns = getattr(os, call), itertools.count()

    def fail(*arguments, **options):
        if next(turns) == turn:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(*arguments, **options)

    monkeypatch.setattr(os, call, fail)
    contents = {tmp_path / name: b"new" for name in ("a", "c", "b", "d")}
    new = [tmp_path / "c", tmp_path / "d"]
    failure = None
    try:
        write_files(contents, new=new)
    except MdfconvError as error:
        failure = str(error)
    if failure is None:
        # A file that cannot be linked is copied, and not every step comes so often.
        assert state(tmp_path) == dict.fromkeys("abcd", b"new")
        return
    assert state(tmp_path) == before
    assert "No space left on device" in failure


def test_what_must_be_new_is_not_written_over(tmp_path):
    (tmp_path / "b").write_bytes(b"old")
    with pytest.raises(MdfconvError, match=r"b exists; it can be replaced"):
        write_files(
            {tmp_path / "a": b"new", tmp_path / "b": b"new"}, new=[tmp_path / "a", tmp_path / "b"]
        )
    assert state(tmp_path) == {"b": b"old"}


def test_permissions_are_kept(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(b"old")
        (tmp_path / name).chmod(0o600)
    write_files(
        {tmp_path / "a": b"new", tmp_path / "c": b"new"}, like={tmp_path / "c": tmp_path / "b"}
    )
    for name in ("a", "c"):
        assert (tmp_path / name).stat().st_mode & 0o777 == 0o600


def test_a_polite_end_leaves_no_litter(tmp_path):
    """The process is ended while its files are beside their places."""
    code = """
import os, signal, sys
from pathlib import Path
from mdfconv.output import files
def end(descriptor):
    os.kill(os.getpid(), getattr(signal, sys.argv[2]))
files.os.fsync = end
files.write_files({Path(sys.argv[1]) / "a": b"new"})
"""
    for name in ("SIGTERM", "SIGHUP"):
        ended = subprocess.run([sys.executable, "-c", code, tmp_path, name], check=False)
        assert ended.returncode == 128 + getattr(signal, name)
        assert state(tmp_path) == {}
