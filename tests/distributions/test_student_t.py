"""Student-t between its two limits, and two-parameter distributions as ordinary ones."""

import numpy as np
import pytest

import mdfconv
from mdfconv.fitting.free_gamma import fit_free_gamma
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.fitting.solve import fit

STUDENT = mdfconv.distribution("student-t")
BETA = np.linspace(0, np.pi / 2, 200)
ALPHAS = [1e-8, 1e-3, 0.2, 0.7, 1.0]


@pytest.mark.parametrize("form", ["unit", "normalized", "cumulative"])
@pytest.mark.parametrize("alpha", ALPHAS)
def test_gamma_two_is_ggx(form, alpha):
    ours, ggx = (getattr(entry, form)(BETA, alpha) for entry in (
        STUDENT.with_gamma(2), mdfconv.distribution("ggx")))  # fmt: skip
    np.testing.assert_allclose(ours, ggx, rtol=1e-13, atol=1e-300)


@pytest.mark.parametrize("alpha", [*ALPHAS, 3.0])
def test_a_large_gamma_is_beckmann(alpha):
    # ln of the ratio is 2x − x²/2 + … over γ, x = t²/α².
    beta = np.arctan(alpha * np.linspace(0, 3, 50))
    beckmann = mdfconv.distribution("beckmann")
    for form in ("unit", "normalized"):
        ratio = getattr(STUDENT.with_gamma(1e6), form)(beta, alpha) / getattr(beckmann, form)(
            beta, alpha
        )
        np.testing.assert_allclose(ratio, 1, rtol=1e-4)
    tails = [
        entry.cumulative(beta, alpha, complement=True)
        for entry in (STUDENT.with_gamma(1e6), beckmann)
    ]
    np.testing.assert_allclose(*tails, rtol=1e-4)


def test_the_maximum_is_where_it_should_be():
    for gamma, alpha in ((3.0, 0.9), (2.5, 1.2), (20.0, 5.0), (2.0, 1.5)):
        entry = STUDENT.with_gamma(gamma)
        mode = float(entry.mode(np.array([alpha]))[0])
        assert mode > 0
        assert entry.unit(mode, alpha) == pytest.approx(1, rel=1e-13)
        assert entry.unit(BETA, alpha).max() <= 1 + 1e-15


@pytest.mark.parametrize("name", ["student-t", "gtr"])
@pytest.mark.parametrize("kept", list_metrics())
def test_free_gamma_comes_back(name, kept):
    entry = mdfconv.distribution(name)
    for gamma in (2.5, 6.0):
        source = entry.with_gamma(gamma)
        found = fit_free_gamma(source, np.array([0.2]), entry, metric_named(kept))
        assert found.parameter[0] == pytest.approx(0.2, rel=1e-4)
        assert found.gamma[0] == pytest.approx(gamma, rel=1e-4)
        assert not found.at_limit[0]
        assert found.distance[0] < 1e-10


def test_a_fixed_gamma_is_one_parameter():
    values = np.array([0.05, 0.3])
    beckmann, ggx = map(mdfconv.distribution, ("beckmann", "ggx"))
    metric = metric_named("energy")
    as_ggx = fit(beckmann, values, ggx, metric).parameter
    np.testing.assert_allclose(
        fit(beckmann, values, STUDENT.with_gamma(2), metric).parameter, as_ggx, rtol=1e-8
    )
    np.testing.assert_allclose(
        fit(beckmann, values, STUDENT.with_gamma(1e6), metric).parameter, values, rtol=1e-5
    )


def test_conversions_to_two_parameters():
    alpha, gamma = mdfconv.convert(0.2, "ggx", "student-t", gamma="free", metric="energy")
    assert (alpha, gamma) == (pytest.approx(0.2, rel=1e-4), pytest.approx(2, rel=1e-3))
    alpha, gamma = mdfconv.convert(np.array([[0.1, 0.2]]), "beckmann", "gtr", gamma="free")
    assert alpha.shape == gamma.shape == (1, 2)
    answer = mdfconv.explain(0.2, "beckmann", "gtr", gamma="free")[0]
    assert (answer.method, answer.gamma) == ("fit", 64)
    assert "γ of gtr is at the end of the range" in answer.cautions[0]
    assert answer.rmse < mdfconv.explain(0.2, "beckmann", "gtr", "fit")[0].rmse
    # Without a closed form the fit answers; with one that is asked for, nothing does.
    assert mdfconv.explain(0.2, "beckmann", "student-t", gamma=3)[0].method == "fit"
    assert mdfconv.explain(0.2, "beckmann", "student-t")[0].method == "closed-form"
    for arguments, options, words in (
        (("beckmann", "ggx"), {"gamma": 3}, "neither beckmann nor ggx has a second parameter"),
        (("beckmann", "ggx"), {"gamma": "free"}, "ggx has one parameter and no γ"),
        (("beckmann", "gtr", "peak"), {"gamma": "free"}, "peak takes γ as it is; fit finds it"),
        (("beckmann", "student-t"), {"gamma": 1.5}, "2 ≤ γ ≤ 1000000"),
        (("beckmann", "student-t", "closed-form"), {"gamma": 3}, r"student-t \(γ = 3\); use"),
    ):
        with pytest.raises(mdfconv.MdfconvError, match=words):
            mdfconv.convert(0.2, *arguments, **options)
