"""Pictures with the distributions exchanged, and the command that draws them."""

import csv
import json

import numpy as np
import pytest
from PIL import Image

from mdfconv.brdf.fresnel import schlick_fresnel
from mdfconv.brdf.microfacet import Microsurface
from mdfconv.brdf.reflection import BRDFS
from mdfconv.distributions import distribution, one_parameter_distributions
from mdfconv.distributions.dialects import DIALECTS, Specular
from mdfconv.distributions.endpoint import encodings_of, endpoint
from mdfconv.fitting.metrics import metric_named
from mdfconv.render.comparison import (
    DRAWN,
    PAPER_FIGURES,
    PictureRule,
    Scene,
    compare,
    default_rules,
)
from mdfconv.render.comparison_figure import _diverging, draw_comparison
from mdfconv.render.sphere import (
    HIGHLIGHT,
    LIGHT,
    LIGHTS,
    VIEW,
    Frame,
    Lights,
    cross_section,
    radiance,
)
from tests.cli.runner import run, run_on_terminal

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
    assert position[place] == pytest.approx(np.hypot(*HIGHLIGHT[:2]), abs=4e-3)
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
    assert (axis[column], -axis[row]) == pytest.approx(tuple(HIGHLIGHT[:2]), abs=0.02)


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
    surface = Scene().surface(distribution("ggx"), 0.05)
    wide, narrow = (
        radiance(cross_section(401, 0.5)[1], surface, light)
        for light in (square, LIGHTS["directional"])
    )
    assert wide.max() < narrow.max()
    assert np.count_nonzero(wide > 0.5 * wide.max()) > np.count_nonzero(narrow > 0.5 * narrow.max())


def many_points(a_side):
    """The square light as the brute force has it: equal cells, each a point."""
    toward = [
        LIGHT
        + 0.15 * (2 * (i + 0.5) / a_side - 1) * right
        + 0.15 * (2 * (j + 0.5) / a_side - 1) * up
        for right in [np.cross([0, 1, 0], LIGHT) / np.linalg.norm(np.cross([0, 1, 0], LIGHT))]
        for up in [np.cross(LIGHT, right)]
        for i in range(a_side)
        for j in range(a_side)
    ]
    distance = np.linalg.norm(toward, axis=1)
    return Lights(toward / distance[:, None], np.pi * distance**-3 / np.sum(distance**-3))


@pytest.mark.parametrize("brdf", ["ashikhmin-shirley", "modified-phong"])
@pytest.mark.parametrize(("name", "parameter"), [("beckmann", 0.02), ("ggx", 0.015)])
def test_a_square_light_has_no_dots_on_a_smooth_surface(name, parameter, brdf):
    surface = Scene(brdf).surface(distribution(name), parameter)
    normals = cross_section(40, 0.15)[1]
    expected = radiance(normals, surface, many_points(100))
    found = radiance(normals, surface, LIGHTS["area"].resolved(0.02))
    np.testing.assert_allclose(found, expected, atol=1e-2 * expected.max())


@pytest.mark.parametrize("brdf", BRDFS.names)
@pytest.mark.parametrize("parameter", [0.02, 0.2, 0.8])
def test_all_lobes_under_a_square_light_are_those_of_many_points(brdf, parameter):
    """Also of lobes twice as narrow and half as wide again, in the samples that all share."""
    scene = Scene(brdf, "area")
    lobes = [("beckmann", 1.0), ("ggx", 0.6), ("gauss", 1.5), ("smoothie", 1.0)]
    lobes = [(distribution(name), share * parameter) for name, share in lobes]
    normals = cross_section(20, 0.2)[1]
    found = radiance(normals, *scene.seen(lobes))
    points = many_points(100)
    for lobe, picture in zip(lobes, found, strict=True):
        expected = radiance(normals, scene.surface(*lobe), points)
        np.testing.assert_allclose(picture, expected, atol=1.5e-2 * expected.max())


@pytest.mark.parametrize("parameter", [1e-3, 1e-5, 1e-9, 1e-12])
def test_a_mirror_shows_the_square_itself(parameter):
    """However narrow a lobe is: the light's radiance, π over its solid angle, times F."""
    scene = Scene("cook-torrance", "area")
    lobes = [(distribution(name), parameter) for name in ("beckmann", "ggx", "schlick")]
    found = radiance(HIGHLIGHT[None], *scene.seen(lobes))[:, 0]
    solid_angle = 4 * np.arcsin(0.15**2 / (1 + 0.15**2))
    fresnel = 0.04 + 0.96 * (1 - np.cos(np.pi / 8)) ** 5
    np.testing.assert_allclose(found, fresnel * np.pi / solid_angle, rtol=2e-3)


def test_what_turns_away_is_dark_in_every_lobe():
    scene = Scene(light="area", material="gold")
    lobes = [(distribution(name), 0.1) for name in ("ggx", "beckmann")]
    away = np.array([[0.0, 0.0, -1.0], [0.6, -0.8, 0.0]])
    np.testing.assert_array_equal(radiance(away, *scene.seen(lobes)), np.zeros((2, 3, 2)))


def test_silhouette_is_antialiased():
    coverage = Frame(64).normals()[1]
    assert coverage.sum() == pytest.approx(np.pi / (2 * 1.04) ** 2 * 64**2, rel=1e-3)
    assert np.count_nonzero((coverage > 0) & (coverage < 1)) > 100


def test_the_rows_say_what_they_keep():
    assert [rule.label for rule in default_rules(4.0)] == [
        "closed-form (shape)", "fit energy (light)", "fit display (picture)",
    ]  # fmt: skip
    assert str(default_rules(4.0)[-1].metric) == "display:4"
    assert PictureRule("half-angle", metric_named("unit")).label == "half-angle"
    assert PictureRule("fit", metric_named("unit")).label == "fit unit (shape)"


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
    found = compare(0.1, default_rules(1.0)[:1], Scene(size=64, normalized=False), targets=["ggx"])
    section = found.rows["closed-form (shape)"][0].section
    assert section.max() == pytest.approx(1, abs=2e-3)


@pytest.mark.parametrize("light", ["directional", "area"])
@pytest.mark.parametrize("m_b", [0.1, 0.04464, 0.02])
def test_a_small_highlight_is_enlarged(m_b, light):
    """The light in it is that of the picture, on as many times more pixels as it says."""
    found = compare(m_b, default_rules(1.0)[1:2], Scene(size=96, light=light), targets=["gauss"])
    times = found.magnification
    # Up to four times m_B, by which Beckmann has fallen to e⁻¹⁶; the area light adds its size.
    assert times == int(1.04 / np.sin(min(4 * m_b + (0.105 if light == "area" else 0), np.pi / 2)))
    for rendering in (found.reference, found.rows["fit energy (light)"][0]):
        light_in = rendering.closeup.sum() / max(times, 1) ** 2
        assert light_in == pytest.approx(rendering.image.sum(), rel=0.02)
    row, column = np.unravel_index(found.reference.closeup.argmax(), (96, 96))
    assert abs(row - 47.5) < 20
    assert abs(column - 47.5) < 20


def test_a_large_highlight_is_not_enlarged():
    found = compare(0.4, default_rules(1.0)[:1], Scene(size=48), targets=["ggx"])
    assert found.magnification == 1
    assert found.reference.closeup is found.reference.image or np.array_equal(
        found.reference.closeup, found.reference.image
    )


@pytest.mark.parametrize("material", [None, "gold"])
def test_differences_are_those_of_the_displayed_pictures(material):
    scene = Scene(size=64, material=material)
    targets = ["ggx", "blinn-phong:obj2gltf"]
    found = compare(50, default_rules(1.0)[1:2], scene, "blinn-phong", targets)
    other, same = found.rows["fit energy (light)"]
    difference = found.difference(other)
    assert difference.shape == (64, 64)
    assert np.abs(found.difference(same)).max() < 1e-12
    # A pixel at a time, by the definition of sRGB.
    for row, column in [(20, 20), (28, 12), (24, 24), (60, 5)]:
        pixels = [
            np.clip(np.atleast_1d(one.closeup[..., row, column]), 0, 1)
            for one in (other, found.reference)
        ]
        encoded = [
            np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055) for v in pixels
        ]
        channels = encoded[0] - encoded[1]
        expected = channels[np.argmax(np.abs(channels))]
        assert difference[row, column] == pytest.approx(expected, abs=1e-6)


def test_colors_of_differences():
    darker, white, brighter = _diverging(np.array([-1.0, 0.0, 1.0])).astype(int)
    assert white.tolist() == [255, 255, 255]
    assert darker[2] > darker[0] + 100
    assert brighter[0] > brighter[2] + 100


def forms():
    """Every distribution and every form in which its parameter is stored."""
    needy = {dialect.name: dialect.example for dialect in DIALECTS}
    for mdf in one_parameter_distributions():
        yield mdf.name
        names = encodings_of(mdf)
        for name in names if names != ["alpha"] else []:
            yield f"{mdf.name}:{needy.get(name, name)}"


@pytest.mark.filterwarnings("ignore:.*near, not equal:mdfconv.MdfconvWarning")
@pytest.mark.parametrize("name", list(forms()))
def test_any_form_is_compared_with_any(name):
    end = endpoint(name)
    # A lobe of usual width, which every form can store.
    value = float(end.encode(np.array(endpoint("beckmann").distribution.parameter.typical_value)))
    if end.distribution.parameter.larger_is_smoother:
        value = float(end.encode(np.array(50.0)))
    rules = [PictureRule("fit", metric_named("energy"))]
    scene = Scene(size=64)
    from_it = compare(value, rules, scene, name, ["beckmann", "ggx:roughness"])
    assert (from_it.reference.name, from_it.reference.value) == (end.label, value)
    beckmann, ggx = from_it.rows["fit energy (light)"]
    assert (beckmann.name, ggx.name) == ("beckmann", "ggx:roughness")
    back = compare(beckmann.value, rules, scene, "beckmann", [name])
    (there,) = back.rows["fit energy (light)"]
    assert there.name == end.label
    assert there.value == pytest.approx(value, rel=0.25)
    image = draw_comparison(from_it, 60)
    assert image.startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["closeup", "whole"])
@pytest.mark.parametrize("targets", [1, 9])
def test_no_text_is_cut_off_or_lies_on_another(targets, name, monkeypatch):
    """Every text lies on the sheet, and apart from the others, whatever it says."""
    import mdfconv.render.comparison_figure as figure_module

    figures = []
    monkeypatch.setattr(figure_module, "encoded", lambda figure, **_: figures.append(figure) or b"")
    longest = "blinn-phong:" + max(
        (d.name for d in DIALECTS if "blinn-phong" in d.owners and d.specular is Specular.no),
        key=len,
    )
    rules = [PictureRule("fit", metric_named(kept)) for kept in ("energy", "display:2.25", "unit")]
    ends = [longest, "ggx:roughness", "gauss", "schlick", "sawicki", "ggx", "beckmann", "gtr"]
    scene = Scene(size=200, material="polycarbonate", brdf="smoothie-approx")
    value = float(endpoint(longest).encode(np.array(90.0 if name == "whole" else 400.0)))
    found = compare(value, rules, scene, longest, [*ends, "student-t"][:targets])
    draw_comparison(found)
    (figure,) = figures
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    texts = [*figure.texts, *figure.legends[0].get_texts()]
    texts += [t for axes in figure.axes for t in (axes.title, axes.xaxis.label, axes.yaxis.label)]
    texts += [t for axes in figure.axes for t in axes.texts]
    plots = [axes for axes in figure.axes if axes.axison]
    texts += [t for axes in plots for t in axes.get_xticklabels() if t.get_visible()]
    texts += [figure._suptitle]
    boxes = {t: t.get_window_extent(renderer) for t in set(texts) if t.get_text()}
    for text, box in boxes.items():
        assert 0 <= box.x0 < box.x1 <= figure.bbox.x1, text
        assert 0 <= box.y0 < box.y1 <= figure.bbox.y1, text
        assert text.get_fontsize() >= 7, text
        for other, second in boxes.items():
            assert text is other or not box.overlaps(second), (text, other)


def test_compare_from_another_distribution(tmp_path):
    words = "compare", "--from", "blinn-phong", "--to", "ggx", "--to", "ggx:roughness", 100, 1000
    words += "--size", 48, "--dpi", 60, "-o", tmp_path
    status, out, err = run(*words)
    assert status == 0
    figures = {f"compare-blinn-phong-{n}-ggx-ggx-roughness" for n in (100, 1000)}
    files = {f"{figure}.{kind}" for figure in figures for kind in ("png", "csv")}
    assert {path.name for path in tmp_path.iterdir()} == files
    assert {line.rsplit("/", 1)[1] for line in err.splitlines()} == files
    rows = list(csv.DictReader(out.splitlines()))
    assert len(rows) == 2 * 3 * 2
    assert {row["figure"] for row in rows} == figures
    alpha, roughness = (float(row["parameter"]) for row in rows[:2])
    assert roughness**2 == pytest.approx(alpha)
    section = (
        (tmp_path / "compare-blinn-phong-100-ggx-ggx-roughness.csv").read_text().splitlines()[0]
    )
    assert section.startswith("position_radii,blinn-phong,")
    status, text = run_on_terminal(*words, "--force", COLUMNS="200")
    assert "Pictures against those of blinn-phong, N 100 and N 1000" in text
    assert "α 0.166" in text
    assert "r 0.4074" in text


def test_compare_with_everything_says_what_is_left_out(tmp_path):
    words = "compare", "--from", "ggx:roughness", "--to", "all", "--method", "closed-form", 0.97
    status, out, err = run(*words, "--size", 32, "-o", tmp_path)
    assert status == 0
    names = {row["distribution"] for row in csv.DictReader(out.splitlines())}
    left_out = [line for line in err.splitlines() if "left out" in line]
    assert "ggx" not in names
    assert len(names) + len(left_out) == len(one_parameter_distributions()) - 1
    assert left_out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--from", "ggx:roughness"), "the roughness r of ggx:roughness is missing; give it"),
        (("--from", "roughness", "0.2"), "did you mean ggx:roughness"),
        (("--from", "ggx", "0.2", "--to", "shininess"), "did you mean blinn-phong"),
        (("--from", "ashikhmin-shirley", "100"), "blinn-phong"),
        (("--from", "ggx:roughness", "20%"), "Did you mean 0.2"),
        (("--from", "ggx:roughness", "1.5"), "0 < r ≤ 1"),
        (("--from", "blinn-phong", "--to", "blinn-phong:fbx", "400"), "no inverse"),
        (("--from", "blinn-phong:fbx", "0"), "r = 0 is any N ≥ 100"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared(words, message, tmp_path):
    status, out, err = run("compare", *words, "--size", 32, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert not list(tmp_path.rglob("*.*"))


def test_what_phong_is_taken_for(tmp_path):
    words = "compare", "--from", "phong", "--to", "ggx", 100, "--size", 32, "-o", tmp_path
    status, _, err = run(*words)
    assert status == 0
    assert "note: phong is taken for Blinn's exponent" in err


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
        "compare", 0.2, "--to", "ggx", "--light", "area", "--brdf", "cook-torrance",
        "--unit", "--method", "fit", "--metric", "display", "--exposure", 4, "--size", 32,
        "--output", folder, "--format", "json",
    )  # fmt: skip
    assert status == 0
    (record,) = json.loads(out)
    assert record["conversion"] == "fit display (picture)"
    name = "compare-beckmann-0.2-ggx-fit-display-4-cook-torrance-area-unit-form-exposure-4.png"
    assert (folder / name).exists()


def test_a_distant_light_shows_a_metal_in_one_color():
    """One half vector for the whole picture: each channel is the grey picture, scaled by F."""
    rules = default_rules(1.0)[1:2]
    grey = compare(0.3, rules, Scene(size=48), targets=["ggx"])
    gold = compare(0.3, rules, Scene(size=48, material="gold"), targets=["ggx"])
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
        found = compare(0.4, default_rules(1.0)[:1], scene, targets=["ggx"])
        rims[name] = np.interp(0.85, found.position, found.reference.section)
    assert rims["acrylic"] > 1.2 * rims["silver"] > 0


def test_compare_a_material(tmp_path):
    status, out, _ = run(
        "compare", 0.2, "--to", "smoothie", "--material", "Copper", "--brdf",
        "smoothie-approx", "--method", "half-angle", "--size", 64, "--output", tmp_path,
        "--format", "json",
    )  # fmt: skip
    assert status == 0
    (record,) = json.loads(out)
    assert record["distribution"] == "smoothie"
    (sheet,) = tmp_path.glob("compare-beckmann-0.2-smoothie-*.png")
    with Image.open(sheet) as picture:
        pixels = np.asarray(picture.convert("RGB")).astype(int)
    # Copper is red; the sheet around it, and a grey material, are not.
    assert (pixels[..., 0] - pixels[..., 2]).max() > 40
    section = list(csv.DictReader(sheet.with_suffix(".csv").read_text().splitlines()))
    assert max(float(row["beckmann"]) for row in section) == pytest.approx(1, abs=1e-3)


def test_a_sheet_shows_the_pixels_asked_for(tmp_path):
    status, _, _ = run(
        "compare", 0.2, "--to", "ggx", "--size", 400, "--dpi", 100, "--output", tmp_path
    )
    assert status == 0
    with Image.open(tmp_path / "compare-beckmann-0.2-ggx.png") as picture:
        assert picture.size[0] > 800
        assert picture.size[1] > 1200
