"""How a run begins and ends: streams that are closed or fail, Ctrl-C, mistakes of mdfconv."""

import os
import signal
import subprocess
import sys

import pytest

from mdfconv.cli import process
from mdfconv.errors import MdfconvError
from tests.cli.runner import COMMAND, run

ANSWERS = [
    ["list"],
    ["--help"],
    ["convert", "--help"],
    ["convert", "--from", "beckmann", "--to", "all", "--format", "table", "0.2"],
    ["fit-table", "--sweep", "0.1:0.2:3"],
]
REFUSED = ["convert", "--from", "konvert", "--to", "ggx", "1"]


def started(arguments, redirection, **options):
    """Run in a shell that redirects streams; return status, stdout and stderr."""
    done = subprocess.run(
        ["sh", "-c", f'exec "$@" {redirection}', "sh", *COMMAND, *arguments],
        capture_output=True,
        text=True,
        check=False,
        **options,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("arguments", ANSWERS, ids=" ".join)
def test_a_reader_that_leaves_is_no_failure(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [*COMMAND, *arguments], stdout=writer, stderr=subprocess.PIPE, check=False
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize(
    ("arguments", "status"), [*((answer, 0) for answer in ANSWERS), (REFUSED, 2)]
)
@pytest.mark.parametrize("redirection", ["2>&-", "2>/dev/full", "2>&- <&-"])
def test_standard_error_may_be_closed_or_full(arguments, status, redirection):
    assert started(arguments, redirection)[:2] == (status, run(*arguments)[1])


@pytest.mark.parametrize("redirection", [">&-", ">&- 2>&-", ">&- <&-", ">/dev/full"])
@pytest.mark.parametrize("arguments", [ANSWERS[0], REFUSED])
def test_without_standard_output_nothing_is_answered(arguments, redirection):
    status, out, err = started(arguments, redirection)
    assert (status, out) == (2, "")
    assert err.count("\n") == (0 if "2>" in redirection else 1)


@pytest.mark.parametrize("module", ["typer", "numpy", "mdfconv.studies.table2"])
def test_ctrl_c_during_the_imports(module, tmp_path):
    (tmp_path / "interrupt.py").write_text(
        "import signal, sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {module!r}:\n"
        "            signal.raise_signal(signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "sys.argv[:2] = ['mdfconv']\n"
        "import runpy\n"
        "runpy.run_module('mdfconv', run_name='__main__', alter_sys=True)\n"
    )
    done = subprocess.run(
        [sys.executable, "interrupt.py", "", "fit-table", "--m-b", "0.2"],
        capture_output=True,
        cwd=tmp_path,
        check=False,
        env=os.environ | {"PYTHONPATH": os.getcwd()},
    )
    assert (done.returncode, done.stderr) == (130, b"")


def fails(error):
    def command():
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "status", "text"),
    [
        (MdfconvError("reason", "hint"), 2, "reason; hint"),
        (MemoryError(), 2, "not enough memory"),
        (OSError(28, "No space left on device"), 2, "cannot write the output"),
        (SystemExit("two\nlines"), 2, "two lines"),
        (KeyError("two\nlines"), 3, "report it"),
        (ZeroDivisionError("x"), 3, "ZeroDivisionError: x"),
        (RecursionError(), 3, "RecursionError"),
        (AssertionError(), 3, "AssertionError"),
        (FileNotFoundError(2, "No such file", "data.csv"), 3, "data.csv"),
    ],
)
def test_what_goes_wrong_is_one_line(error, status, text, capfd):
    assert process.run(fails(error)) == status
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("mdfconv: ")
    assert err.count("\n") == 1
    assert text in err


@pytest.mark.parametrize(
    ("error", "status"), [(KeyboardInterrupt(), 130), (SystemExit(7), 7), (SystemExit(), 0)]
)
def test_what_needs_no_words(error, status, capfd):
    assert process.run(fails(error)) == status
    assert capfd.readouterr() == ("", "")


def test_a_mistake_shows_where_it_happened_if_asked(monkeypatch, capfd):
    monkeypatch.setenv("MDFCONV_DEBUG", "1")
    assert process.run(fails(KeyError("lost"))) == 3
    err = capfd.readouterr().err
    assert "Traceback" in err
    assert "in command" in err
    assert "MDFCONV_DEBUG" in err.splitlines()[-1]


def test_ctrl_c_while_it_computes():
    with subprocess.Popen(
        [*COMMAND, "convert", "--from", "ggx", "--to", "beckmann", "-"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as child:
        # A block of input, whose results are more than a pipe holds.
        child.stdin.write(b"0.2\n" * ((1 << 19) + 1))
        child.stdin.flush()
        child.stdout.read(1)
        child.send_signal(signal.SIGINT)
        _, err = child.communicate()
    assert (child.returncode, err) == (130, b"")
