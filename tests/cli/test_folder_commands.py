"""Mistakes with the commands that draw into a folder: one line, exit 2, nothing written."""

import os

import pytest

from tests.cli.runner import run


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("plot-error", "--output", "missing/folder"), "cannot create missing/folder"),
        (("plot-error", "--mdf", "gx"), "did you mean ggx"),
        (("plot-error", "--reference", "smoothie"), "give --m-b"),
        (("plot-error", "--m-b", "-1"), "m_B > 0"),
        (("plot-error", "--m-b", "0.9"), "half-angle answers"),
        (("plot-error", "--points", "1"), "from 2 to"),
        (("plot-error", "--dpi", "0"), "--dpi"),
        (("plot-error", "--mdf", "ashikhmin-shirley"), "blinn-phong"),
        (("plot-error", "--method", "ward"), "give one"),
        (("plot-error", "--mdf", "beckmann"), "is the reference"),
        (("plot-error", "--points", "100000000000"), "from 2 to"),
        (("konvert",), "did you mean convert"),
        (("compare", "--output", "missing/folder"), "cannot create missing/folder"),
        (("compare", "--size", "0"), "16 to 4096"),
        (("compare", "--dpi", "-5"), "--dpi"),
        (("compare", "--exposure", "0"), "exposure"),
        (("compare", "nan"), "not a finite number"),
        (("compare", "--light", "sun"), "'sun' is not one of"),
        (("compare", "--to", "gx"), "did you mean ggx"),
        (("compare", "--method", "wart"), "did you mean ward"),
        (("compare", "--material", "golt"), "did you mean gold"),
        (("compare", "--brdf", "phong"), "'phong' is not one of"),
        (("compare", "1e-8"), "falls between the pixels"),
        (("compare", "0.001", "--size", "64"), "falls between the pixels"),
    ],
)
def test_bad_requests_write_nothing(tmp_path, arguments, words):
    status, out, err = run(*arguments, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.parametrize("command", ["plot-error", "compare"])
def test_an_unwritable_folder(tmp_path, command):
    blocked = tmp_path / "blocked"
    blocked.write_text("a file where a folder should be")
    status, out, err = run(command, "--output", blocked)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    os.makedirs(tmp_path / "here" / "reports.d")
    (tmp_path / "here" / "reports").write_text("in the way")
    status, _, err = run(command, cwd=tmp_path / "here")
    assert status == 2
    assert "cannot create" in err
