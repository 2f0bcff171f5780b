"""Fresnel's reflectance against 50 digits, the fit against brute force, and the command."""

import csv
import json

import mpmath as mp
import numpy as np
import pytest
from PIL import Image

from mdfconv.brdf.fresnel import (
    SMOOTHIE_FIT,
    conductor,
    dielectric,
    dielectric_index,
    normal_reflectance,
    schlick_fresnel,
    smoothie_fresnel,
)
from mdfconv.errors import MdfconvError
from mdfconv.studies.fresnel import error_rows, fit, fresnel, rescaled
from tests.cli.runner import run

mp.mp.dps = 60
COSINES = np.array([0, 1e-300, 1e-12, 1e-4, 0.05, 0.2, 0.5, 0.7, 0.95, 1 - 1e-9, 1 - 2**-53, 1])
INDICES = [1 + 1e-12, 1.0001, 1.33, 1.5, 2.4, 40.0]
METALS = [(0.18, 3.42), (0.05, 4.2), (1.0, 2.0), (2.9, 3.1), (1.5, 1e-9), (0.7, 1e-6), (30.0, 70.0)]


def exact(cosine, eta, k=0.0):
    """Return the textbook's ½ (|r_s|² + |r_p|²) at 60 digits: Snell's law, then amplitudes."""
    c, m = mp.mpf(float(cosine)), mp.mpc(float(eta), float(k))
    inner = mp.sqrt(1 - (1 - c * c) / m**2)
    perpendicular = (c - m * inner) / (c + m * inner)
    parallel = (m * c - inner) / (m * c + inner)
    return (abs(perpendicular) ** 2 + abs(parallel) ** 2) / 2


@pytest.mark.parametrize("ior", INDICES)
def test_dielectric_at_grazing_and_normal(ior):
    expected = [float(exact(cosine, ior)) for cosine in COSINES]
    np.testing.assert_allclose(dielectric(COSINES, ior), expected, rtol=2e-14)
    # What is transmitted keeps its digits, too, as far as 1 − F can hold them.
    np.testing.assert_allclose(1 - dielectric(COSINES, ior), 1 - np.array(expected), atol=5e-16)


@pytest.mark.parametrize("ior", [0.999, 0.75, 0.4])
def test_total_internal_reflection(ior):
    critical = np.sqrt(1 - ior**2)
    beyond = critical * np.array([0, 1e-9, 0.3, 0.9, 0.999])
    np.testing.assert_allclose(dielectric(beyond, ior), 1, rtol=0, atol=1e-15)
    before = np.append(critical + (1 - critical) * np.array([1e-3, 0.1, 0.5, 0.9]), 1.0)
    expected = [float(exact(cosine, ior)) for cosine in before]
    np.testing.assert_allclose(dielectric(before, ior), expected, rtol=1e-11)
    assert (np.diff(dielectric(np.linspace(0, 1, 1001), ior)) < 1e-15).all()


def test_next_to_the_critical_angle_the_error_is_that_of_the_cosine():
    ior = 0.75
    cosine = np.sqrt(1 - ior**2) * (1 + 1e-12)
    found = float(dielectric(cosine, ior))
    shifted = [float(exact(cosine * (1 + step), ior)) for step in (-4e-16, 4e-16)]
    assert min(shifted) <= found <= max(shifted)


@pytest.mark.parametrize(("eta", "k"), METALS)
def test_conductor(eta, k):
    expected = [float(exact(cosine, eta, k)) for cosine in COSINES]
    np.testing.assert_allclose(conductor(COSINES, eta, k), expected, rtol=2e-14)


@pytest.mark.parametrize("ior", [0.6, 1.0, 1.5])
def test_without_absorption_a_conductor_is_a_dielectric(ior):
    np.testing.assert_array_equal(conductor(COSINES, ior, 0), dielectric(COSINES, ior))


def test_both_sides_of_an_interface_agree():
    outside = np.linspace(0.05, 1, 20)
    inside = np.sqrt(1 - (1 - outside**2) / 1.5**2)
    np.testing.assert_allclose(dielectric(inside, 1 / 1.5), dielectric(outside, 1.5), rtol=1e-12)
    assert normal_reflectance(1.5) == pytest.approx(0.04, rel=1e-15)
    assert normal_reflectance(1 / 1.5) == pytest.approx(0.04, rel=1e-15)
    assert float(dielectric(1.0, 1.37)) == pytest.approx(normal_reflectance(1.37), rel=1e-14)


def test_the_index_of_a_reflectance_is_the_inverse():
    for index in INDICES[1:]:
        reflectance = float(((mp.mpf(index) - 1) / (mp.mpf(index) + 1)) ** 2)
        assert dielectric_index(reflectance) == pytest.approx(index, rel=1e-13)
    np.testing.assert_allclose(dielectric_index([[0.0, 0.04]]), [[1, 1.5]], rtol=1e-15)


def test_approximations():
    for cosine in COSINES:
        c = mp.mpf(float(cosine))
        expected = float(mp.mpf(0.04) + (1 - mp.mpf(0.04)) * (1 - c) ** 5)
        assert schlick_fresnel(float(cosine)) == pytest.approx(expected, rel=1e-15)
        expected = float(2 ** (mp.mpf("-1.71983") - 2 * mp.mpf("5.43926") * c**2))
        assert float(smoothie_fresnel(cosine)) == pytest.approx(expected, rel=1e-14)
    # Shapes are kept, and float32 is computed in float64.
    grid = np.linspace(0, 1, 6, dtype=np.float32).reshape(2, 3)
    for found in (dielectric(grid, 1.5), conductor(grid, 0.2, 3), smoothie_fresnel(grid)):
        assert found.shape == (2, 3)
        assert found.dtype == np.float64


@pytest.mark.parametrize("ior", [0, -1.5, np.nan, np.inf])
def test_an_index_that_is_none(ior):
    for function in (normal_reflectance, lambda n: dielectric(0.5, n), fit):
        with pytest.raises(MdfconvError, match="positive number"):
            function(ior)
    with pytest.raises(MdfconvError, match="extinction"):
        conductor(0.5, 1.5, -1 if np.isfinite(ior) else ior)


def test_the_articles_fit_comes_back():
    found = fit()
    assert found.a == pytest.approx(-1.7287, abs=1e-4)
    assert found.b == pytest.approx(-5.4469, abs=1e-4)
    for ours, printed in zip((found.a, found.b), SMOOTHIE_FIT, strict=True):
        assert ours == pytest.approx(printed, rel=6e-3)
    errors = {name: found.weighted_error(curve) for name, curve in found.curves().items()}
    assert min(errors, key=errors.get) == "fit"
    assert errors["printed"] < errors["exp(-6x)"] < errors["(1-x)^5"]


@pytest.mark.parametrize(
    ("ior", "mu", "sigma"),
    [(1.4, 0.55, 0.12), (1.5, 1.0, 0.5), (1.06, 0.55, 0.12), (2.5, 0.1, 0.05), (0.75, 1.2, 0.2)],
)
def test_the_fit_is_the_minimum(ior, mu, sigma):
    """Around the answer the weighted squares of the textbook's curve only grow."""
    found = fit(ior, mu, sigma)
    cosine = np.linspace(0, 1, 401)
    curve = np.array([float(exact(value, ior)) for value in cosine])
    least = float(((mp.mpf(ior) - 1) / (mp.mpf(ior) + 1)) ** 2)
    curve = (curve - least) / (1 - least)
    weight = np.exp(-0.5 * ((2 * cosine**2 - mu) / sigma) ** 2)

    def cost(a, b):
        return (weight * (2 ** (a + 2 * b * cosine**2) - curve) ** 2).sum()

    np.testing.assert_allclose(rescaled(cosine, ior), curve, atol=1e-15)
    at_best = cost(found.a, found.b)
    for angle in np.linspace(0, 2 * np.pi, 16, endpoint=False):
        step = 0.05 * np.array([np.cos(angle), np.sin(angle)])
        assert cost(found.a + step[0], found.b + 3 * step[1]) > at_best


def test_the_page():
    (page, table, _), figures = fresnel()
    assert "within 0.52% of the printed" in page
    assert figures["off"] == pytest.approx(0.0052, abs=5e-5)
    rows = list(csv.DictReader(table.splitlines()))
    middle = rows[50]
    assert float(middle["cosine"]) == 0.5
    assert float(middle["(1-x)^5"]) == 0.5**5
    least = (0.5 / 2.5) ** 2
    expected = (float(exact(0.5, 1.5)) - least) / (1 - least)
    assert float(middle["exact 1.5"]) == pytest.approx(expected, abs=1e-8)
    # What the prose says of the errors.
    rows = {(row["curve"], row["cosine"]): row for row in error_rows(fit())}
    names = ("fit", "printed", "(1-x)^5", "exp(-6x)")
    for where in ("0.4 to 0.6", "0.6 to 0.8", "0.8 to 1"):
        ranked = sorted(names, key=lambda name: rows[name, where]["rms_error"])
        assert set(ranked[:2]) == {"fit", "printed"}
    assert rows["exp(-6x)", "0 to 1"]["max_error"] == pytest.approx(0.006, abs=1e-4)
    weighted = {name: rows[name, "0 to 1"]["weighted_rms"] for name in names}
    assert weighted["(1-x)^5"] / weighted["fit"] == pytest.approx(4, abs=0.1)
    assert weighted["fit"] / weighted["exp(-6x)"] == pytest.approx(0.75, abs=0.02)


def test_the_command(tmp_path):
    status, out, err = run("fresnel", "--png", "curves.png", cwd=tmp_path)
    assert status == 0
    assert err == "mdfconv: wrote curves.png\n"
    rows = list(csv.DictReader(out.splitlines()))
    assert len(rows) == 24
    assert float(rows[0]["a"]) == pytest.approx(-1.7287, abs=1e-4)
    assert rows[-1]["curve"] == "exp(-6x)"
    assert rows[-1]["a"] == ""
    with Image.open(tmp_path / "curves.png") as picture:
        assert picture.size[0] > 900
    status, out, _ = run(
        "fresnel", "--ior", 1.5, "--mu", 1, "--sigma", 0.5, "--format", "json", "--png",
        tmp_path / "other.png",
    )  # fmt: skip
    assert status == 0
    records = json.loads(out)
    assert records[0]["a"] == fit(1.5, 1, 0.5).a
    assert records[-1]["a"] is None
    status, out, _ = run("fresnel", "--output", "table.md", cwd=tmp_path)
    assert (status, out) == (0, "")
    assert (tmp_path / "table.md").read_text().startswith("| curve | a | b |")
    status, out, _ = run("fresnel", "--help")
    assert status == 0
    assert "Examples:" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--ior", "1"), "0.05 away from 1"),
        (("--ior", "-1.4"), "positive number"),
        (("--ior", "9"), "from 0.25 to 4"),
        (("--ior", "glass"), "not a valid float"),
        (("--mu", "2.5"), "from 0 to 2"),
        (("--mu", "nan"), "from 0 to 2"),
        (("--sigma", "0"), "positive number"),
        (("--sigma", "1e-4"), "narrower than the grid"),
        (("--png", "missing/curves.png"), "cannot write"),
        (("--png", "same.png", "--output", "same.png"), "two results"),
    ],
)
def test_bad_requests(tmp_path, arguments, words):
    status, out, err = run("fresnel", *arguments, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())
