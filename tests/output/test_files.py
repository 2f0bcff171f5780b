"""Files written whole or not at all."""

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
