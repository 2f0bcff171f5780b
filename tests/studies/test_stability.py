"""The audit of hard cases: its references, its judgement, its verdicts and its command."""

import csv
import json
from decimal import Decimal

import mpmath as mp
import numpy as np
import pytest

import mdfconv
from mdfconv.conversion import method_named
from mdfconv.distributions.endpoint import Endpoint
from mdfconv.studies.pages import read_rows
from mdfconv.studies.stability import (
    HardCases,
    audit,
    findings,
    printed_conversion,
    printed_form,
    relative_errors,
    stability,
)
from tests import generate_stability, oracles, stability_fits
from tests.cli.runner import run

# In units of the type's rounding.
KERNEL_LIMITS = {"float64": 40, "float32": 20, "float16": 0.51}
HARDER = {"tail": 2000, "edge of support": 1000}
# A round trip through a nearly uniform lobe, and the fits' own tolerance, relative.
LOOSE = {"half-angle and back": 1e-9, "peak and back": 1e-11, "closed-form and back": 1e-11}
FIT_LIMITS = {"fit": 1e-8, "fast": 2e-7}


@pytest.fixture(scope="module", name="audited")
def audit_all():
    return list(audit())


def test_everything_is_audited(audited):
    names = {entry.name for entry in mdfconv.list_distributions()}
    kernels = {(f.distribution, f.rule, f.dtype) for f in audited}
    for name in names:
        for dtype in ("float64", "float32", "float16"):
            assert {(name, "unit", dtype), (name, "normalized", dtype)} <= kernels
    rules = {f.rule.split()[0] for f in audited}
    assert {method.name for method in mdfconv.list_methods()} <= rules
    regimes = {f.regime for f in audited}
    assert {"tail", "mirror-smooth", "grazing", "off-axis maximum"} <= regimes
    assert {"γ near 1", "γ near 2", "edge of support"} <= regimes
    assert all(f.cases for f in audited)


def test_kernels_hold(audited):
    for finding in audited:
        if finding.rule in ("unit", "normalized"):
            limit = HARDER.get(finding.regime, KERNEL_LIMITS[finding.dtype])
            assert finding.error_in_eps <= limit, finding


def test_conversions_hold(audited):
    for finding in audited:
        if finding.rule in ("unit", "normalized") or finding.round_trip:
            continue
        limit = FIT_LIMITS.get(finding.rule.split()[0], 1e-12)
        rounding = 6.1e-8 if finding.dtype == "float32" else 0
        assert finding.error <= limit + rounding, finding


def test_round_trips_hold_in_double_precision(audited):
    trips = [f for f in audited if f.round_trip and f.dtype == "float64"]
    assert len(trips) > 30
    for finding in trips:
        limit = 1e-13 if finding.regime == "mirror-smooth" else LOOSE.get(finding.rule, 1e-15)
        if finding.rule == "glossiness and back":
            limit = 1e-11
        assert finding.error <= limit, finding


def test_what_the_printed_forms_lose(audited):
    textbook = {(f.distribution, f.rule, f.regime, f.dtype): f.textbook for f in audited}
    for name in ("ggx", "gtr", "schlick", "sawicki", "blinn-phong"):
        assert textbook[name, "unit", "mirror-smooth", "float64"] > 0.1
    assert textbook["student-t", "unit", "mirror-smooth", "float64"] == "NaN"
    assert textbook["gtr", "normalized", "γ near 1", "float64"] == "NaN"
    assert textbook["ggx", "half-angle", "mirror-smooth", "float64"] == "inf"
    assert textbook["gauss", "half-angle and back", "mirror-smooth", "float32"] == "NaN"
    assert textbook["schlick", "half-angle", "rough", "float64"] == ""
    assert textbook["beckmann", "unit", "usual", "float64"] < 1e-14


@pytest.mark.parametrize("dtype", generate_stability.DIGITS)
def test_stored_kernels_are_what_the_oracles_say(dtype):
    name = np.dtype(dtype).name
    rows = read_rows(f"kernels-{name}.csv")
    cases = [
        (row, *case)
        for row in rows
        for case in zip(row["beta"].split(), row["value"].split(), strict=True)
    ]
    assert len(cases) > 500
    for row, angle, stored in cases[::17]:
        entry, value = row["distribution"], mp.mpf(stored)
        beta, parameter, gamma = map(dtype, (angle, row["parameter"], row["gamma"] or 2))
        if row["form"] == "unit":
            exact = generate_stability.unit(entry, beta, parameter, gamma)
        else:
            exact = oracles.at_normal(entry, float(parameter), float(gamma))
        assert mp.almosteq(exact, value, 1e-6, 1e-320)
        if name == "float64" and exact > 1e-300:
            assert mp.almosteq(exact, value, 1e-18)


def test_stored_conversions_are_what_the_oracles_say():
    rows = read_rows("conversions.csv")
    gammas = [str(gamma) for gamma in generate_stability.CONVERSION_GAMMAS]
    assert list(dict.fromkeys(row["gamma"] for row in rows)) == gammas
    for row in rows[::13]:
        method = getattr(generate_stability, row["method"].replace("-", "_"))
        gamma, value = float(row["gamma"]), float(np.float32(row["value"]))
        exact = generate_stability.conversion_row(
            method, row["source"], gamma, value, only_two=row["gamma"] != gammas[0]
        )
        assert {name: row[name] for name in generate_stability.NAMES} == exact


def test_what_is_stored_are_all_distributions_of_their_own():
    stored = {row["distribution"] for row in read_rows("kernels-float64.csv")}
    assert stored == set(generate_stability.NAMES)
    assert stored | {"ashikhmin-shirley"} == {e.name for e in mdfconv.list_distributions()}


def test_a_stored_fit_is_the_minimum():
    (row,) = (
        row
        for row in read_rows("fits.csv")
        if (row["source"], row["target"], row["value"]) == ("beckmann", "gauss", "0.3")
    )
    exact = stability_fits.best("unit", "beckmann", "gauss", float(np.float32(0.3)))
    assert mp.almosteq(exact, mp.mpf(row["unit"]), 1e-18)


@pytest.mark.parametrize(
    ("value", "exact", "error"),
    [
        (0.5, "0.5", 0),
        (0.5, "0.4", 0.25),
        (1 + 2.0**-52, "1", 2.0**-52),
        (-0.5, "0.5", 2),
        (np.inf, "0.5", np.inf),
        (0, "1e-320", 0),
        (1e-310, "1e-400", 0),
        (1e-3, "0", np.inf),
        (-1e-3, "0", np.inf),
        (np.inf, "1e400", 0),
        (1, "1e400", np.inf),
    ],
)
def test_relative_error(value, exact, error):
    assert relative_errors(np.array([value], dtype=float), [Decimal(exact)]) == [error]


def test_a_missing_answer_is_the_worst():
    values = np.array([1, np.nan, 0.5], dtype=np.float32)
    exact = [Decimal("0.5"), Decimal("0.5"), Decimal("1e-60")]
    cases = HardCases("unit", "usual", values, values, exact, ["a", "b", "c"])
    (finding,) = findings("ggx", [cases])
    assert np.isnan(finding.error)
    assert (finding.worst, finding.textbook, finding.cases, finding.out_of_range) == (
        "b",
        "NaN",
        3,
        1,
    )


def harmless(entry):
    """Return a distribution at a γ of its own, and a parameter at which no digit is lost."""
    gammas = {"gtr": 1.5, "student-t": 3.5}
    shape = entry.with_gamma(gammas[entry.name]) if entry.second_parameter else entry
    return shape, np.float64(30 if entry.parameter.larger_is_smoother else 0.3)


def test_printed_formulas_where_they_are_harmless():
    entries = mdfconv.list_distributions()
    for shape, parameter in map(harmless, entries):
        angle = np.array([0.2])
        np.testing.assert_allclose(
            printed_form(shape, "unit", angle, parameter), shape.unit(angle, parameter), rtol=1e-12
        )
        # The paper's constant of the Gaussian is an approximation.
        close = 0.03 if shape.name == "gauss" else 1e-12
        normal = np.zeros(1)
        np.testing.assert_allclose(
            printed_form(shape, "normalized", normal, parameter),
            shape.normalized(normal, parameter),
            rtol=close,
        )
    for name in ("half-angle", "peak"):
        method, covered = method_named(name), 0
        for source, parameter in map(harmless, entries):
            for target, _ in map(harmless, entries):
                values = np.array([parameter])
                printed = printed_conversion(method, source, target, values)
                if printed is not None:
                    covered += 1
                    ends = Endpoint(source), Endpoint(target)
                    ours = mdfconv.convert(values, *ends, name)
                    close = 0.03 if source.name == "gauss" else 1e-11
                    np.testing.assert_allclose(printed, ours, rtol=close)
        assert covered > 40


def test_printed_normalized_form_where_the_maximum_is_off_the_normal():
    for name in ("beckmann", "student-t"):
        shape = mdfconv.distribution(name)
        shape = shape.with_gamma(4) if shape.second_parameter else shape
        printed = printed_form(shape, "normalized", np.zeros(1), np.float64(2))
        np.testing.assert_allclose(printed, shape.normalized(0.0, 2.0), rtol=1e-15)


def test_command():
    assert "mdfconv stability --mdf ggx" in run("stability", "--help")[1]
    status, out, err = run("stability", "--mdf", "tr", "--mdf", "ggx")
    assert (status, err) == (0, "")
    rows = list(csv.DictReader(out.splitlines()))
    assert {row["distribution"] for row in rows} == {"ggx"}
    assert {row["dtype"] for row in rows} == {"float64", "float32", "float16"}
    status, out, _ = run("stability", "--mdf", "gtr", "--part", "kernels", "--format", "json")
    assert status == 0
    records = json.loads(out)
    assert {record["rule"] for record in records} == {"unit", "normalized"}
    assert "NaN" in {record["textbook"] for record in records}
    status, out, _ = run(
        "stability", "--mdf", "phong", "--part", "conversions", "--format", "table"
    )
    assert status == 0
    assert "half-angle and back" in out
    assert "normalized" not in out


def test_output_file(tmp_path):
    path = tmp_path / "hard.md"
    assert run("stability", "--mdf", "schlick", "--output", path) == (
        0,
        "",
        f"mdfconv: wrote {path}\n",
    )
    assert path.read_text().startswith("| distribution | rule | regime | dtype |")
    assert "edge of support" in path.read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--mdf", "gx"), "did you mean ggx"),
        (("--part", "kernel"), "--part"),
        (("--format", "html"), "--format"),
    ],
)
def test_bad_requests(arguments, words):
    status, out, err = run("stability", *arguments)
    assert (status, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_page():
    page, table = stability().files
    contents, figures = stability()
    assert contents == [page, table]
    assert figures["failures"] == 0
    rows = list(csv.DictReader(table.splitlines()))
    # Orders of magnitude only: digits would differ between processors.
    for row in rows:
        for column in ("error", "textbook"):
            text = row[column]
            assert text in ("", "0", "1", "fails") or text.startswith("1e-")
    (row,) = (
        row
        for row in rows
        if (row["distribution"], row["rule"], row["regime"], row["dtype"])
        == ("gtr", "normalized", "γ near 1", "float64")
    )
    assert (row["error"], row["textbook"]) == ("1e-15", "fails")
    assert "1e-15 / fails" in next(line for line in page.splitlines() if line.startswith("| gtr |"))
