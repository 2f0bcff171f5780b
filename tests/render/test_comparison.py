"""Pictures with the distributions exchanged, and the command that draws them."""

import csv
import json

import numpy as np
import pytest
from PIL import Image

from mdfconv.brdf.fresnel import schlick_fresnel
from mdfconv.brdf.microsurface import Microsurface
from mdfconv.brdf.reflection import BRDFS
from mdfconv.distributions import distribution
from mdfconv.fitting.metrics import metric_named
from mdfconv.paper.error_curves import DRAWN
from mdfconv.render.comparison import PAPER_FIGURES, Rule, Scene, compare, default_rules
from mdfconv.render.sphere import (
    LIGHT,
    LIGHTS,
    VIEW,
    Frame,
    Lights,
    cross_section,
    highlight,
    radiance,
)
from tests.cli.runner import run

NAMES = ["beckmann", "blinn-phong", "gauss", "ggx", "sawicki", "schlick", "smoothie", "gtr"]


# f at n = h, by D F and the cosine c of half vector and light.
HEIGHTS = {
    "ashikhmin-shirley": lambda c: 1 / (4 * c * c),
    "cook-torrance": lambda c: 1 / (4 * c * c),
    "smoothie": lambda c: 1 / (4 * c * c),
    "smoothie-approx": lambda c: 1 / 4,
    "modified-phong": lambda c: 1,
}


@pytest.mark.parametrize("brdf", HEIGHTS)
@pytest.mark.parametrize("name", NAMES)
def test_highlight_has_the_analytic_place_and_height(name, brdf):
    parameter = 200.0 if name in ("blinn-phong", "sawicki") else 0.1
    surface = BRDFS[brdf](Microsurface(distribution(name), parameter), schlick_fresnel)
    position, normals = cross_section(20001, 0.5)
    light = LIGHTS["directional"]
    section = radiance(normals, surface, light)
    place = int(np.argmax(section))
    # Where no masking divides it out, the cosine at the surface draws the peak to the light.
    assert position[place] == pytest.approx(np.hypot(*highlight()), abs=4e-3)
    half = (LIGHT + VIEW) / np.linalg.norm(LIGHT + VIEW)
    cosine = half @ LIGHT
    fresnel = 0.04 + 0.96 * (1 - cosine) ** 5
    # At n = h: f (n·l) with n·l = n·v = h·l, and no masking; the light brings π.
    peak = (
        np.pi
        * distribution(name).normalized(0, parameter)
        * fresnel
        * HEIGHTS[brdf](cosine)
        * cosine
    )
    assert radiance(half[None, :], surface, light)[0] == pytest.approx(peak, rel=1e-12)
    assert section.max() == pytest.approx(peak, rel=2e-3)
    picture = Frame(256).render(surface, light)
    row, column = np.unravel_index(np.argmax(picture), picture.shape)
    axis = 1.04 * (2 * (np.arange(256) + 0.5) / 256 - 1)
    assert (axis[column], -axis[row]) == pytest.approx(highlight(), abs=0.02)


def test_white_furnace():
    """A white Lambertian sphere in a white environment is white, through the same loop."""
    z, weight = np.polynomial.legendre.leggauss(60)
    phi = 2 * np.pi * (np.arange(120) + 0.5) / 120
    directions = np.stack(
        [
            np.outer(np.sqrt(1 - z**2), np.cos(phi)).ravel(),
            np.outer(np.sqrt(1 - z**2), np.sin(phi)).ravel(),
            np.repeat(z, 120),
        ],
        axis=1,
    )
    environment = Lights(directions, np.repeat(weight, 120) * 2 * np.pi / 120)
    picture = Frame(24).render(lambda light, view: np.full(len(light), 1 / np.pi), environment)
    coverage = Frame(24).normals()[1].reshape(24, 24)
    np.testing.assert_allclose(picture, coverage, atol=2e-3)
    assert picture.max() == pytest.approx(1, abs=2e-3)


def test_area_light():
    square = LIGHTS["area"]
    assert square.irradiance.sum() == pytest.approx(np.pi)
    np.testing.assert_allclose(np.linalg.norm(square.directions, axis=1), 1)
    surface = Scene().surface("ggx", 0.05)
    wide, narrow = (
        radiance(cross_section(401, 0.5)[1], surface, light)
        for light in (square, LIGHTS["directional"])
    )
    assert wide.max() < narrow.max()
    assert np.count_nonzero(wide > 0.5 * wide.max()) > np.count_nonzero(narrow > 0.5 * narrow.max())


def test_silhouette_is_antialiased():
    coverage = Frame(64).normals()[1]
    assert coverage.sum() == pytest.approx(np.pi / (2 * 1.04) ** 2 * 64**2, rel=1e-3)
    assert np.count_nonzero((coverage > 0) & (coverage < 1)) > 100


def test_the_rows_say_what_they_keep():
    assert [rule.label for rule in default_rules(4.0)] == [
        "closed-form (shape)", "fit energy (light)", "fit display (picture)",
    ]  # fmt: skip
    assert str(default_rules(4.0)[-1].metric) == "display:4"
    assert Rule("half-angle", metric_named("unit")).label == "half-angle"
    assert Rule("fit", metric_named("unit")).label == "fit unit (shape)"


def test_the_papers_pictures_come_back():
    """Independent of the frames: the values that the tool printed with cosines alone."""
    assert PAPER_FIGURES == {"fig4": 0.4, "fig5": 0.04464}
    rows = compare(0.4, default_rules(1.0), Scene(size=192)).table()
    assert [row["distribution"] for row in rows] == [*DRAWN] * 3
    printed = {
        "closed-form (shape)": [0.0176633, 0.021932, 0.0721246, 0.0396272, 0.0385055],
        "fit energy (light)": [0.011158, 0.0144691, 0.0525173, 0.0268891, 0.0327151],
        "fit display (picture)": [0.0263501, 0.0352158, 0.172109, 0.0741916, 0.0706362],
    }
    for label, errors in printed.items():
        found = [row["rmse_linear"] for row in rows if row["conversion"] == label]
        assert found == pytest.approx(errors, rel=1e-5)


def test_each_fit_wins_where_it_promises_to():
    for m_b in (0.4, 0.04464):
        found = compare(m_b, default_rules(1.0), Scene(size=128))
        rows = found.table()
        for name in {row["distribution"] for row in rows}:
            shape, light, picture = (row for row in rows if row["distribution"] == name)
            assert light["rmse_linear"] == min(r["rmse_linear"] for r in (shape, light, picture))
            assert picture["rmse_displayed"] == min(
                r["rmse_displayed"] for r in (shape, light, picture)
            )


def test_unit_form_keeps_the_peak():
    found = compare(0.1, default_rules(1.0)[:1], Scene(size=64, normalized=False), ["ggx"])
    section = found.rows["closed-form (shape)"][0].section
    assert section.max() == pytest.approx(1, abs=2e-3)


def test_compare(tmp_path):
    status, out, _ = run("compare", "--size", 64, "--dpi", 60, cwd=tmp_path)
    assert status == 0
    folder = tmp_path / "reports"
    assert sorted(path.name for path in folder.iterdir()) == [
        "fig4.csv", "fig4.png", "fig5.csv", "fig5.png",
    ]  # fmt: skip
    rows = list(csv.DictReader(out.splitlines()))
    assert len(rows) == 30
    section = list(csv.DictReader((folder / "fig4.csv").read_text().splitlines()))
    assert list(section[0])[:2] == ["position_radii", "beckmann"]
    status, out, _ = run(
        "compare", "--m-b", 0.2, "--mdf", "ggx", "--light", "area", "--brdf", "cook-torrance",
        "--unit", "--method", "fit", "--metric", "display", "--exposure", 4, "--size", 32,
        "--output", folder, "--format", "json",
    )  # fmt: skip
    assert status == 0
    (record,) = json.loads(out)
    assert record["conversion"] == "fit display (picture)"
    name = "compare-m_b-0.2-ggx-fit-display-4-cook-torrance-area-unit-form-exposure-4.png"
    assert (folder / name).exists()


def test_a_distant_light_shows_a_metal_in_one_color():
    """One half vector for the whole picture: each channel is the grey picture, scaled by F."""
    rules = default_rules(1.0)[1:2]
    grey = compare(0.3, rules, Scene(size=48), ["ggx"])
    gold = compare(0.3, rules, Scene(size=48, material="gold"), ["ggx"])
    assert gold.reference.image.shape == (3, 48, 48)
    cosine = np.cos(np.pi / 8)  # the light is 45° off the viewer
    color = np.array([1.0, 0.766, 0.336])
    color = color + (1 - color) * (1 - cosine) ** 5
    for found, plain in (
        (gold.reference, grey.reference),
        (gold.rows["fit energy (light)"][0], grey.rows["fit energy (light)"][0]),
    ):
        expected = (color / color.max())[:, None, None] * plain.image
        np.testing.assert_allclose(found.image, expected, rtol=1e-12)
        np.testing.assert_allclose(found.section, plain.section, rtol=1e-12)
    (row,), (plain_row,) = gold.table(), grey.table()
    share = np.sqrt(np.mean(np.square(color / color.max())))
    assert row["rmse_linear"] == pytest.approx(share * plain_row["rmse_linear"], rel=1e-12)
    assert row["energy_ratio"] == pytest.approx(plain_row["energy_ratio"], rel=1e-12)


def test_fresnel_shows_where_it_takes_the_viewers_angle():
    """Modified Phong has F(n·v), which brightens the rim of a plastic and hardly that of silver."""
    rims = {}
    for name in ("acrylic", "silver"):
        scene = Scene("modified-phong", size=64, material=name)
        found = compare(0.4, default_rules(1.0)[:1], scene, ["ggx"])
        rims[name] = np.interp(0.85, found.position, found.reference.section)
    assert rims["acrylic"] > 1.2 * rims["silver"] > 0


def test_compare_a_material(tmp_path):
    status, out, _ = run(
        "compare", "--m-b", 0.2, "--mdf", "smoothie", "--material", "Copper", "--brdf",
        "smoothie-approx", "--method", "half-angle", "--size", 64, "--output", tmp_path,
        "--format", "json",
    )  # fmt: skip
    assert status == 0
    (record,) = json.loads(out)
    assert record["distribution"] == "smoothie"
    (sheet,) = tmp_path.glob("compare-m_b-0.2-smoothie-*.png")
    with Image.open(sheet) as picture:
        pixels = np.asarray(picture.convert("RGB")).astype(int)
    # Copper is red; the sheet around it, and a grey material, are not.
    assert (pixels[..., 0] - pixels[..., 2]).max() > 40
    section = list(csv.DictReader(sheet.with_suffix(".csv").read_text().splitlines()))
    assert max(float(row["beckmann"]) for row in section) == pytest.approx(1, abs=1e-3)


def test_a_sheet_shows_the_pixels_asked_for(tmp_path):
    status, _, _ = run(
        "compare", "--m-b", 0.2, "--mdf", "ggx", "--size", 400, "--dpi", 100, "--output", tmp_path
    )
    assert status == 0
    with Image.open(tmp_path / "compare-m_b-0.2-ggx.png") as picture:
        assert picture.size[0] > 800
        assert picture.size[1] > 1200
