"""The white furnace: exact values, independent quadrature, energy that is not made."""

import csv
import json

import mpmath as mp
import numpy as np
import pytest

from mdfconv.brdf.microfacet import direction
from mdfconv.brdf.reflection import arvo, mallett_yuksel
from mdfconv.studies.furnace import (
    directional_albedo,
    energy_response,
    furnace,
    furnace_model,
    list_models,
    sampled_albedo,
)
from tests.cli.runner import run

COSINES = np.array([0.0, 1e-6, 1e-3, 0.03, 0.2, 0.5, 0.77, 0.99, 1.0])


@pytest.mark.parametrize("exponent", [0, 0.5, 1, 7.3, 100, 1e4, 1e6])
def test_mallett_yuksel_returns_everything(exponent):
    model = furnace_model("modified-phong", exponent, normalizer="mallett-yuksel")
    assert np.abs(directional_albedo(model, COSINES) - 1).max() < 1e-9


@pytest.mark.parametrize("exponent", [0, 1, 2, 7, 100, 1001])
def test_arvo_is_the_same_at_integers(exponent):
    assert arvo(COSINES, exponent) == pytest.approx(mallett_yuksel(COSINES, exponent), rel=1e-11)


@pytest.mark.parametrize("exponent", [0.5, 7.3, 300])
def test_normalizer_at_fifty_digits(exponent):
    """The printed form, cancellation and all, at 50 digits."""
    n = mp.mpf(exponent)
    for cosine in (1e-3, 0.3, 0.9):
        c = mp.mpf(cosine)
        s2 = 1 - c * c
        beta = mp.betainc(n / 2, mp.mpf(1) / 2, 0, s2)
        ratio = mp.gamma(n / 2 + mp.mpf(1) / 2) / mp.gamma(n / 2 + 1)
        wanted = 2 * mp.pi * c + mp.sqrt(mp.pi) * ratio * (s2 ** (n / 2) - c * n / 2 * beta)
        got = mallett_yuksel(np.array([cosine]), exponent)[0]
        assert got == pytest.approx(float(wanted / (n + 2)), rel=1e-11)


def test_the_usual_normalizer_loses_energy():
    model = furnace_model("modified-phong", 100)
    albedo = directional_albedo(model, COSINES)
    assert albedo[-1] == pytest.approx(1, abs=1e-12)
    assert (np.diff(albedo) > 0).all()
    assert albedo[0] < 0.05
    original = directional_albedo(furnace_model("phong", 100), COSINES)
    assert (original <= 1 + 1e-12).all()
    assert original[0] == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("alpha", [1e-4, 1e-3, 0.03, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("name", ["ggx", "beckmann"])
@pytest.mark.parametrize("g", ["correlated", "separable", "v-cavity"])
def test_microfacets_make_no_light(name, alpha, g):
    albedo = directional_albedo(furnace_model(name, alpha, masking=g), COSINES)
    assert (albedo <= 1 + 1e-9).all()
    assert (albedo > 0.2).all()


@pytest.mark.parametrize("name", ["ggx", "beckmann"])
def test_rough_surfaces_lose_more(name):
    """On the average over viewers, and at each angle but grazing ones.

    There a rough surface mirrors more than a smooth one whose lobe the horizon cuts.
    """
    x, w = np.polynomial.legendre.leggauss(24)
    cosine = 0.5 * (1 + x)
    albedos = [directional_albedo(furnace_model(name, a), cosine) for a in (0.01, 0.1, 0.4, 1.0)]
    assert (np.diff([np.sum(w * cosine * albedo) for albedo in albedos]) < 0).all()
    assert (np.diff(albedos, axis=0)[:, cosine > 0.5] < 1e-9).all()


@pytest.mark.parametrize(
    ("name", "parameter"),
    [
        ("ggx", 0.5),
        ("beckmann", 0.4),
        ("gauss", 0.5),
        ("schlick", 0.6),
        ("sawicki", 4.0),
        ("blinn-phong", 8.0),
        ("smoothie", 0.8),
        ("smoothie-approx", 0.8),
        ("ashikhmin-shirley", 8.0),
        ("modified-phong", 3.0),
        ("phong", 3.0),
    ],
)
def test_against_quadrature_over_light(name, parameter):
    """By directions of light on a grid that knows nothing of half vectors."""
    model = furnace_model(name, parameter)
    x, w = np.polynomial.legendre.leggauss(400)
    theta, phi = np.pi / 4 * (1 + x[:, None]), np.pi / 2 * (1 + x)
    area = np.pi / 4 * w[:, None] * np.pi / 2 * w * np.sin(theta)
    light = direction(theta, phi)
    for cosine in (0.3, 0.9):
        view = np.broadcast_to(direction(np.arccos(cosine)), light.shape)
        wanted = 2 * np.sum(model.brdf(light, view) * light[..., 2] * area)
        # The grid cuts across the end of Phong's lobe and of Schlick's, and where n·l = n·v.
        tolerance = dict.fromkeys(("phong", "modified-phong", "schlick"), 2e-4)
        tolerance["ashikhmin-shirley"] = 2e-5
        got = directional_albedo(model, np.array([cosine]))[0]
        assert got == pytest.approx(wanted, abs=tolerance.get(name, 1e-6))


@pytest.mark.parametrize("name", list_models())
def test_sampling_agrees(name):
    parameter = 12.0 if "phong" in name or "shirley" in name else 0.4
    model = furnace_model(name, parameter)
    cosine = np.array([0.05, 0.3, 0.7, 1.0])
    exact = directional_albedo(model, cosine)
    got, error = sampled_albedo(model, cosine, 20_000, seed=5)
    assert (np.abs(got - exact) < 4.5 * error + 1e-9).all()


@pytest.mark.parametrize("parameter", [0.02, 0.5, 0.95, 1.0])
def test_the_end_of_a_support(parameter):
    """Smith's masking makes no light, and a smooth surface loses none along the normal."""
    albedo = directional_albedo(furnace_model("schlick", parameter), COSINES)
    assert (albedo <= 1 + 1e-8).all()
    if parameter == 0.02:
        assert albedo[-1] == pytest.approx(1, abs=1e-8)


def test_limits_of_smoothie():
    """The article's D has the integral π/(4+α²); here it is normalized."""
    for alpha in (1e-3, 0.3):
        albedo = directional_albedo(furnace_model("smoothie", alpha), np.array([1.0]))[0]
        article = albedo * np.pi / (4 + alpha**2)
        if alpha == 1e-3:
            assert article == pytest.approx(np.pi / 4, abs=1e-4)
        # GGX with the masking that the form implies.
        ggx = alpha / np.sqrt(4 + alpha**2)
        same = furnace_model("ggx", ggx, masking="ksk")
        assert albedo == pytest.approx(directional_albedo(same, np.array([1.0]))[0], abs=1e-12)
    for alpha in (0.01, 0.5, 1.0):
        model = furnace_model("smoothie-approx", alpha)
        albedo = directional_albedo(model, np.array([1.0]))[0]
        assert albedo * 4 / (4 + alpha**2) == pytest.approx(1 / (1 + alpha**2), abs=1e-9)


@pytest.mark.parametrize("alpha", [0.05, 0.5, 1.0])
def test_energy_response_by_quadrature(alpha):
    a = mp.mpf(alpha)

    def value(theta):
        spread = 4 * mp.sin(theta / 2) ** 2
        return mp.sin(theta) * mp.cos(theta) * (a + spread / a) ** -2

    wanted = 2 * mp.pi * mp.quad(value, [0, a / 8, a / 2, 2 * a if 2 * a < 1.5 else 1.5, mp.pi / 2])
    assert energy_response(alpha) == pytest.approx(float(wanted), rel=1e-12)


def test_the_page_states_what_its_data_say():
    (page, table, _), figures = furnace()
    rows = list(csv.DictReader(table.splitlines()))
    text = " ".join(page.split())
    smooth = float(rows[-1]["Smoothie: smoothie 0.1"])
    assert f"For α = 0.1 its exact form returns {smooth:.3f} along the normal" in text
    article = smooth * np.pi / (4 + 0.1**2)
    assert "loses at least 1 − π/4 of the light, 21%" in text
    assert 1 - article > 0.21
    unmasked = float(rows[2]["GGX: none"])
    assert f"without it GGX makes light, {unmasked:.2g} at cos θ = 0.1" in text
    assert figures["error"] < 1e-14


def test_command(tmp_path):
    words = [
        "furnace",
        "--brdf",
        "modified-phong",
        "--normalizer",
        "arvo",
        "100",
        "--format",
        "csv",
    ]
    status, out, err = run(*words)
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "cos_theta,albedo"
    assert len(lines) == 22
    assert all(abs(float(line.split(",")[1]) - 1) < 1e-8 for line in lines[1:])
    words = ["furnace", "0.5", "--mc", "500", "--points", "3", "--format", "json"]
    status, out, err = run(*words, "--png", tmp_path / "f.png")
    assert status == 0
    assert (tmp_path / "f.png").read_bytes().startswith(b"\x89PNG")
    rows = json.loads(out)
    assert list(rows[0]) == ["cos_theta", "albedo", "sampled", "standard_error"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--brdf", "lambert", "1"], "unknown BRDF 'lambert'"),
        (["--brdf", "ggx", "0"], "ggx α = 0"),
        (["--brdf", "ggx", "0.5", "--normalizer", "arvo"], "ggx has no normalizer"),
        (["--brdf", "phong", "5", "--g", "none"], "the masking of phong is part of it"),
        (["--brdf", "modified-phong", "--normalizer", "arvo", "7.3"], "takes an integer exponent"),
        (["--brdf", "modified-phong", "--", "-1"], "Phong's exponent is at least 0"),
        (["--brdf", "ggx", "0.5", "--g", "smith"], "unknown masking 'smith'"),
        (["--brdf", "ggx", "0.5", "--points", "1"], "--points is from 2"),
        (["--brdf", "ggx", "0.5", "--mc", "1"], "--mc needs 2 samples"),
        (["--brdf", "ggx", "0.5", "--mc", "100000000000"], "at most 10000000"),
        (["--brdf", "ggx", "0.5", "--mc", "10", "--seed", "-1"], "--seed is at least 0"),
        (["--brdf", "ggx", "0.5", "--png", "x", "--output", "x"], "x is named for two results"),
        (["--brdf", "modified-phong", "--normalizer", "arvo", "1e7"], "use mallett-yuksel"),
        (["--brdf", "ggx", "1e-300"], "is a mirror"),
        (["--brdf", "ggx", "1e-160", "--g", "correlated"], "is a mirror"),
        (["--brdf", "modified-phong", "5", "--speed"], "no such option: --speed"),
        (["--brdf", "ggx", "0.5", "--png", "none/x.png"], "cannot write none/x.png"),
    ],
)
def test_mistakes(words, message, tmp_path):
    status, out, err = run("furnace", *words, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1
