"""``mdfconv convert`` as a process."""

import csv
import io
import json
import re
import subprocess

import numpy as np
import pytest

import mdfconv
from mdfconv.distributions.endpoint import endpoint
from tests.cli.runner import COMMAND, run, run_on_terminal


def test_main_job_in_a_pipe():
    assert run("convert", "--from", "beckmann", "--to", "ggx", 0.2) == (0, "0.23552\n", "")


def test_several_values_and_standard_input():
    expected = "0.1194400000\n0.23552\n".replace("0.1194400000", "0.11944")
    assert run("convert", "--from", "beckmann", "--to", "ggx", 0.1, 0.2)[1] == expected
    status, out, _ = run("convert", "--from", "beckmann", "--to", "ggx", "-", stdin="0.1\r\n\n 0.2")
    assert (status, out) == (0, expected)


def test_pair():
    status, out, _ = run("convert", "--from", "ashikhmin-shirley", "--to", "ggx", "100,20")
    assert status == 0
    assert out == "0.1660059663,0.3428457736\n"


def test_json():
    status, out, err = run(
        "convert", "--from", "blinn", "--to", "ggx:roughness", "--format", "json", 100, 2
    )
    assert (status, err) == (0, "")
    first, second = json.loads(out)
    assert list(first) == [
        "from", "to", "value", "result", "method", "metric", "rmse", "max_error", "notes",
    ]  # fmt: skip
    assert first["from"] == "blinn-phong"
    assert first["to"] == "ggx:roughness"
    assert first["value"] == 100
    assert first["result"] == mdfconv.convert(100, "blinn-phong", "ggx:roughness")
    assert first["method"] == "closed-form"
    assert 0 < first["max_error"] < first["rmse"] < 0.1
    assert isinstance(first["notes"], list)
    assert "outside the paper's sweep" in second["notes"][0]


def test_csv():
    status, out, _ = run("convert", "--from", "beckmann", "--to", "ggx", "--format", "csv", 0.3)
    assert status == 0
    (row,) = csv.DictReader(io.StringIO(out))
    assert float(row["result"]) == mdfconv.convert(0.3, "beckmann", "ggx")
    assert row["from"] == "beckmann"
    status, out, _ = run(
        "convert", "--from", "ashikhmin-shirley", "--to", "beckmann", "--format", "csv", "9,8"
    )
    (row,) = csv.DictReader(io.StringIO(out))
    assert row["value"] == "9.0,8.0"


def test_all_targets():
    status, out, err = run("convert", "--from", "beckmann", "--to", "all", 0.2)
    assert status == 0
    assert dict(line.split() for line in out.splitlines()) == {
        "gauss": "0.2044728",
        "ggx": "0.23552",
        "gtr": "0.23552",
        "blinn-phong": "47.5",
        "schlick": "0.2",
        "sawicki": "56.065",
        "smoothie": "0.4846741243",
        "student-t": "0.23552",
    }
    assert err == ""
    status, out, err = run("convert", "--from", "beckmann", "--to", "all", 0.9)
    assert status == 0
    assert "blinn-phong" not in out
    assert "left out: for beckmann m_B = 0.9 closed-form gives blinn-phong N = -0.03" in err


def test_caution_goes_to_standard_error():
    status, out, err = run("convert", "--from", "beckmann", "--to", "ggx", 0.8)
    assert (status, out) == (0, "0.67328\n")
    assert err.startswith("mdfconv: note: outside the paper's sweep")
    assert err.count("\n") == 1


def test_fit_and_metric():
    arguments = ("convert", "--from", "blinn-phong", "--to", "ggx:roughness", "--method", "fit")
    status, out, _ = run(*arguments, "--metric", "energy", 100)
    assert status == 0
    assert float(out) == pytest.approx(0.36, abs=1e-4)
    status, out, _ = run(
        *arguments, "--metric", "display", "--exposure", 4, "--format", "json", 100
    )
    (record,) = json.loads(out)
    assert record["metric"] == "display:4"
    assert record["notes"][0] == "keeps the picture on a screen"


def test_gamma():
    arguments = ("convert", "--from", "ggx", "--to", "gtr", "--gamma", "3", "0.2")
    status, out, _ = run(*arguments, "--method", "half-angle")
    assert status == 0
    assert float(out) == pytest.approx(0.2495316462)
    # Without a method it is the fit, as there is no closed form; one that is asked for has none.
    status, out, _ = run(*arguments)
    assert (status, float(out)) == (0, pytest.approx(mdfconv.convert(0.2, "ggx", "gtr", gamma=3)))
    assert run(*arguments, "--method", "closed-form")[0] == 2


def test_both_parameters_are_fitted_and_printed():
    arguments = ("convert", "--from", "beckmann", "--to", "student-t", "--gamma", "free", "0.2")
    status, out, err = run(*arguments)
    assert (status, out) == (0, "0.2000661683 512\n")
    assert err == (
        "mdfconv: note: γ of student-t is at the end of the range in which it is looked for, "
        "2 to 512\n"
    )
    (record,) = json.loads(run(*arguments, "--format", "json")[1])
    assert (record["gamma"], record["method"]) == (512, "fit")


def test_table_on_a_terminal():
    status, out = run_on_terminal("convert", "--from", "beckmann", "--to", "ggx", "0.2")
    assert status == 0
    assert "\x1b[1m" in out
    rows = [line for line in out.splitlines() if "0.23552" in line or "peak" in line]
    assert "closed-form" in rows[0]
    assert "peak" in rows[-1]
    for method in ("half-angle", "fit", "fast"):
        assert method in out
    for purpose in ("sun or lamp, linear light", "natural light", "as seen on a screen"):
        assert purpose in out
    plain = run_on_terminal("convert", "--from", "beckmann", "--to", "ggx", "0.2", NO_COLOR="1")[1]
    assert not re.search(r"\x1b\[[39][0-7]m", plain)
    assert "0.23552" in plain


def test_table_in_a_pipe_has_no_escapes():
    status, out, _ = run("convert", "--from", "ggx", "--to", "all", "--format", "table", 0.2)
    assert status == 0
    assert "\x1b" not in out
    assert "blinn-phong N" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--from", "bekman", "--to", "ggx", "0.2"), "did you mean beckmann"),
        (("--from", "ggx", "--to", "phon", "0.2"), "did you mean phong"),
        (("--from", "ggx", "--to", "gauss", "1.5"), "0 < α ≤ 1"),
        (("--from", "beckmann", "--to", "ggx", "-0.2"), "m_B > 0"),
        (("--from", "beckmann", "--to", "ggx", "nan"), "not a finite number"),
        (("--from", "beckmann", "--to", "ggx", "-inf"), "not a finite number"),
        (("--from", "beckmann", "--to", "ggx", "rough"), "'rough' is not a number"),
        (("--from", "beckmann", "--to", "ggx", "0.1", "x"), "value 2 of 2: 'x'"),
        (("--from", "beckmann", "--to", "ggx", "0.1", "7e400"), "value 2 of 2"),
        (("--from", "beckmann", "--to", "ggx", "1,2,3"), "not a pair"),
        (("--from", "beckmann", "--to", "ggx", "1,"), "not a number"),
        (("--from", "phong", "--to", "ggx", "10,20"), "use ashikhmin-shirley"),
        (("--from", "gauss:roughness", "--to", "ggx", "0.1"), "gauss has no encoding"),
        (("--from", "beckmann", "--to", "phong", "0.9"), "half-angle answers"),
        (("--from", "beckmann", "--to", "ggx", "--method", "wart", "0.2"), "did you mean ward"),
        (("--from", "ggx", "--to", "gtr", "--gamma", "-1", "0.2"), "1e-06 ≤ γ"),
        (("--from", "ggx", "--to", "gtr", "--gamma", "wide", "0.2"), "a number or free"),
        (("--from", "ggx", "--to", "gauss", "--gamma", "3", "0.2"), "neither ggx nor gauss has"),
        (("--from", "gtr", "--to", "ggx", "--gamma", "free", "0.2"), "ggx has one parameter"),
        (
            ("--from", "ggx", "--to", "gtr", "--gamma", "free", "--method", "peak", "0.2"),
            "peak takes γ as it is; fit finds it",
        ),
        (
            ("--from", "beckmann", "--to", "ggx", "--metric", "unit", "--exposure", "2", "0.2"),
            "the unit metric has no exposure",
        ),
        (
            ("--from", "beckmann", "--to", "ggx", "--metric", "display:4", "--exposure", "2", "1"),
            "the exposure is given twice",
        ),
        (("--from", "beckmann", "--to", "ggx", "-"), "holds no values"),
        (("--from", "beckmann", "--to", "ggx", "-", "-"), "only once"),
        (("--form", "beckmann", "--to", "ggx", "1"), "no such option: --form"),
        (("--from", "beckmann", "--to", "ggx", "1", "-f"), "no such option: -f"),
        (("--from", "beckmann", "--to", "ggx", "1", "--metric", "shape"), "unknown metric"),
        (("--from", "beckmann", "--to", "ggx"), "Missing argument"),
        (("--to", "ggx", "0.2"), "Missing option '--from'"),
        (
            ("--from", "beckmann", "--to", "ggx", "--metod", "ward", "0.2"),
            "no such option: --metod; did you mean --method?",
        ),
        (("--from", "beckmann", "--to", "ggx", "--format", "xml", "0.2"), "'xml' is not one of"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_two(arguments, words):
    status, out, err = run("convert", *arguments)
    assert (status, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1
    assert err.startswith("mdfconv: ")


def test_bad_lines_of_standard_input_are_numbered():
    arguments = ("convert", "--from", "beckmann", "--to", "ggx", "-")
    status, out, err = run(*arguments, stdin="0.1\nabc\n")
    assert (status, out) == (2, "")
    assert "line 2 of standard input: 'abc' is not a number" in err
    status, out, err = run(*arguments, stdin=b"\xff\xfe0")
    assert (status, out) == (2, "")
    assert err.count("\n") == 1


def test_a_closed_pipe_is_no_error():
    source = subprocess.Popen(
        [*COMMAND, "convert", "--from", "beckmann", "--to", "ggx", *["0.2"] * 20000],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    source.stdout.readline()
    source.stdout.close()
    assert source.stderr.read() == b""
    source.stderr.close()
    assert source.wait(timeout=60) == 0


def test_broken_streams_are_one_line():
    arguments = [*COMMAND, "convert", "--from", "beckmann", "--to", "ggx"]
    for shell in ('"$@" 0.2 >/dev/full', '"$@" 0.2 >&-', '"$@" - <&-'):
        done = subprocess.run(
            ["sh", "-c", shell, "sh", *arguments], capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        assert done.stdout == ""
        assert done.stderr.count("\n") == 1


def test_a_narrow_terminal_keeps_the_answer():
    for columns in ("80", "60"):
        out = run_on_terminal(
            "convert", "--from", "ashikhmin-shirley", "--to", "ggx", "100,20", COLUMNS=columns
        )[1]
        assert "…" not in out
        assert "closed-form" in out


def test_a_terminal_without_unicode():
    status, out, _ = run(
        "convert", "--from", "beckmann", "--to", "ggx", "--format", "table", "0.2",
        PYTHONIOENCODING="ascii",
    )  # fmt: skip
    assert status == 0
    assert "0.23552" in out


def test_standard_input_is_streamed():
    """Several blocks, and memory that does not grow with them."""
    values = [f"{0.05 + 1e-7 * number:.9f}" for number in range(300_000)]
    arguments = "convert", "--from", "beckmann", "--to", "ggx", "-"
    status, out, err = run(*arguments, stdin="\n".join(values))
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert len(lines) == len(values)
    expected = mdfconv.convert(np.array(values[::50_000], dtype=float), "beckmann", "ggx")
    assert [float(line) for line in lines[::50_000]] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("rough", "line 250001 of standard input: 'rough' is not a number"),
        ("-0.1", "line 250001 of standard input: beckmann m_B = -0.1 is outside the legal range"),
        ("1,2,3", "line 250001 of standard input: '1,2,3' is not a pair"),
        ("3", "line 250001 of standard input: for beckmann m_B = 3 closed-form gives"),
    ],
)
def test_a_bad_line_far_down_is_named(line, message):
    text = "0.2\n" * 250_000 + f"{line}\n" + "0.2\n" * 10
    status, _, err = run("convert", "--from", "beckmann", "--to", "ggx", "-", stdin=text)
    assert status == 2
    assert message in err.splitlines()[-1]


def test_arguments_and_standard_input_keep_their_order():
    status, out, _ = run(
        "convert", "--from", "ashikhmin-shirley", "--to", "ggx", "10,10", "-", "50",
        stdin="\ufeff20,20\n\n30",
    )  # fmt: skip
    assert status == 0
    alone = [mdfconv.convert(n, "blinn-phong", "ggx") for n in (10.0, 20.0, 30.0, 50.0)]
    got = [float(line.partition(",")[0]) for line in out.splitlines()]
    assert got == pytest.approx(alone, rel=1e-9)
    status, out, _ = run("convert", "--from", "nothing", "--to", "ggx", "-", stdin="x")
    assert (status, out) == (2, "")


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["--to", "roughness", "0.2"], "ggx:roughness"),
        (["--to", "Glossiness", "0.2"], "ggx:glossiness"),
        (["--to", "shininess", "0.2"], "blinn-phong"),
        (["--to", "obj2gltf", "0.2"], "blinn-phong:obj2gltf"),
        (["--to", "ggx", "20%"], "0.2"),
        (["--to", "ggx", "1%,20%"], "0.01,0.2"),
        (["--to", "gtr", "--gamma", "150%", "0.2"], "1.5"),
        (["--to", "blinn-phong:obj2gltf", "--specular", "20%", "0.2"], "0.2"),
    ],
)
def test_what_was_meant_is_said(arguments, meant):
    status, out, err = run("convert", "--from", "beckmann", *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert f"id you mean {meant}?" in err


def test_every_meaning_that_is_offered_is_a_name():
    for mdf in mdfconv.list_distributions():
        for meaning in mdf.meant_by.values():
            assert endpoint(meaning).label == meaning


@pytest.mark.parametrize("value", ["nan%", "inf%", "%", "a%"])
def test_what_is_no_percentage_offers_nothing(value):
    status, _, err = run("convert", "--from", "beckmann", "--to", "ggx", value)
    assert status == 2
    assert "did you mean" not in err
