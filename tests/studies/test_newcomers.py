"""A distribution or a metric that is registered later: benchmark, audit and pages know it."""

import copy

import numpy as np
import pytest

import mdfconv
from mdfconv.distributions import distribution, one_parameter_distributions
from mdfconv.distributions.blinn_phong import BlinnPhong
from mdfconv.distributions.gtr import GTR
from mdfconv.fitting import metrics
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.metrics.base import Energy
from mdfconv.recommend import recommend
from mdfconv.studies.bench import Sizes, Task, measure
from mdfconv.studies.bench_page import draw, markdown_page, tables
from mdfconv.studies.stability import audit

TINY = Sizes(angles=512, conversions=64, fits=4, loop=2, rounds=1)


class Cosine(BlinnPhong):
    """A form with a logarithm, of which no argument is known."""

    name = "cosine-power"
    encodings = ()
    aliases = ()
    functions = ("log", "exp")
    map_variables = None


class Generalized(GTR):
    name = "generalized"
    aliases = ()


class Projected(Energy):
    name = "projected"


def ignore(steps):
    pass


@pytest.fixture(scope="module")
def newcomers():
    """Register them for these tests."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (mdfconv.distributions, metrics):
            patch.setattr(module, "_REGISTRY", copy.deepcopy(module._REGISTRY))
        mdfconv.distributions.register(Cosine())
        mdfconv.distributions.register(Generalized())
        metrics.register_metric(Projected)
        yield


@pytest.fixture(scope="module")
def measurements(newcomers):
    ends = distribution("beckmann"), distribution("cosine-power")
    candidates = tuple(one_parameter_distributions())
    return measure(Task(ends[0], np.array([0.2, 0.05]), candidates, *ends, TINY), ignore)


def test_benchmark(measurements):
    measured = measurements.tables
    assert {"cosine-power", "generalized"} <= {row["distribution"] for row in measured["kernels"]}
    substitutes = {row["distribution"]: row for row in measured["substitutes"]}
    assert substitutes["cosine-power"]["parameter"] == pytest.approx(
        substitutes["blinn-phong"]["parameter"]
    )
    methods = {(row["method"], row["metric"]) for row in measured["methods"]}
    assert ("fit", "projected") in methods
    assert "fast" not in {method for method, _ in methods}
    shown = {row["distribution"] for row in tables(measurements)["substitutes"]}
    assert {"cosine-power", "generalized"} <= shown
    assert "| projected |" in markdown_page(measurements)
    assert draw(measurements).startswith(b"\x89PNG")


def test_recommendation(newcomers):
    for source, gamma in (("cosine-power", None), ("generalized", 3.0)):
        surface = distribution(source)
        surface = surface.with_gamma(gamma) if gamma else surface
        value = surface.parameter.typical_value
        candidates = one_parameter_distributions()
        answer = recommend(surface, value, candidates, metric_named("projected"), 1e-9)
        rows = {row["distribution"]: row for row in answer.records()}
        assert rows[source]["max_error"] == 0
        assert rows[source]["method"] == "none"
        assert len(rows) == len(candidates)


def test_audit_without_references(newcomers):
    findings = list(audit(["cosine-power"]))
    assert [finding.dtype for finding in findings] == ["float64", "float32", "float16"]
    for finding in findings:
        assert (finding.regime, finding.cases) == ("no stored references", 0)
        assert finding.error == finding.error_in_eps == finding.textbook == ""


@pytest.mark.parametrize(
    ("name", "same"), [("generalized", "ggx"), ("ashikhmin-shirley", "blinn-phong")]
)
def test_audit_with_the_references_of_the_same_lobe(newcomers, name, same):
    ours, theirs = (list(audit([one], "kernels")) for one in (name, same))
    assert [(f.regime, f.cases) for f in ours] == [(f.regime, f.cases) for f in theirs]
    assert all(f.error_in_eps < 40 or f.regime == "tail" for f in ours)
