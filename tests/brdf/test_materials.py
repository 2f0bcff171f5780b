"""Materials by name, and the BRDFs of `compare` against their sources' own expressions."""

import numpy as np
import pytest

from mdfconv.brdf.fresnel import METALS, PLASTICS, list_materials, lossless, material
from mdfconv.brdf.microfacet import Microsurface, direction, frames, kelemen_szirmay_kalos
from mdfconv.brdf.reflection import BRDFS, BrdfSet, LobeBrdf, microfacet, modified
from mdfconv.distributions import distribution
from mdfconv.errors import MdfconvError

LIGHT = np.array([-0.6, 0.3, np.sqrt(1 - 0.45)])
VIEW = np.array([0.2, -0.1, np.sqrt(1 - 0.05)])


def lit_normals(count=400):
    """Return normals that see both light and viewer."""
    normals = np.random.default_rng(7).normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals[(normals @ LIGHT > 0) & (normals @ VIEW > 0)]


def evaluate(brdf, name, parameter, fresnel=lossless):
    """Return normals, and the BRDF for one light and viewer as they meet them."""
    normals = lit_normals()
    local = frames(normals)
    surface = Microsurface(distribution(name), parameter)
    return normals, BRDFS[brdf](surface, fresnel)(local @ LIGHT, local @ VIEW)


def test_metals_start_at_their_color_and_end_at_white():
    for name, color in METALS.items():
        fresnel = material(name).fresnel
        np.testing.assert_allclose(fresnel(1.0), np.array(color)[:, None])
        np.testing.assert_allclose(fresnel(0.0), 1)
        assert np.shape(fresnel(np.linspace(0, 1, 5))) == (3, 5)


def test_plastics_reflect_as_their_index_says():
    for name, ior in PLASTICS.items():
        fresnel = material(name).fresnel
        assert float(fresnel(1.0)) == pytest.approx(((ior - 1) / (ior + 1)) ** 2)
        assert np.shape(fresnel(np.linspace(0, 1, 5))) == (5,)


def test_names():
    assert material(" Gold ").name == "gold"
    assert {"gold", "chrome", "acrylic", "pvc"} <= set(list_materials())
    with pytest.raises(MdfconvError, match="did you mean gold"):
        material("golt")
    with pytest.raises(MdfconvError, match="named by a string"):
        material(3)


@pytest.mark.parametrize("alpha", [0.01, 0.3, 1.0])
def test_smoothie_is_the_articles(alpha):
    """The article's expressions, whose D lacks the constant (α²+4)/π."""
    h = LIGHT + VIEW
    normals, found = evaluate("smoothie", "smoothie", alpha)
    cosine = normals @ (h / np.linalg.norm(h))
    article = (alpha + 4 * (1 - cosine**2) / alpha) ** -2 / (h @ h)
    np.testing.assert_allclose(found, article * (alpha**2 + 4) / np.pi, rtol=1e-10)
    normals, found = evaluate("smoothie-approx", "smoothie", alpha)
    across = h - normals * (normals @ h)[:, None]
    article = (alpha + np.square(across).sum(axis=1) / alpha) ** -2
    np.testing.assert_allclose(found, article * (alpha**2 + 4) / (4 * np.pi), rtol=1e-10)


@pytest.mark.parametrize("exponent", [1.0, 20.0, 3000.0])
def test_modified_phong_is_phongs(exponent):
    normals, found = evaluate("modified-phong", "blinn-phong", exponent)
    mirrored = 2 * (normals @ VIEW)[:, None] * normals - VIEW
    lobe = np.maximum(mirrored @ LIGHT, 0) ** exponent * (exponent + 2) / (2 * np.pi)
    assert np.count_nonzero(lobe == 0) > 10
    np.testing.assert_allclose(found, lobe, rtol=1e-9)


@pytest.mark.parametrize(("name", "parameter"), [("beckmann", 0.3), ("ggx", 0.4), ("gauss", 0.2)])
def test_any_distribution_around_the_mirror_direction_reflects_all_energy(name, parameter):
    """To a viewer along the normal: quadrature over directions of light."""
    nodes, weights = np.polynomial.legendre.leggauss(400)
    theta = 0.25 * np.pi * (nodes + 1)
    light, view = direction(theta), np.broadcast_to([0.0, 0.0, 1.0], (theta.size, 3))
    brdf = BRDFS["modified-phong"](Microsurface(distribution(name), parameter), lossless)
    ring = 2 * np.pi * np.sin(theta) * np.cos(theta) * 0.25 * np.pi * weights
    assert np.sum(brdf(light, view) * ring) == pytest.approx(1, rel=1e-9)


def test_one_definition_serves_pictures_and_the_furnace():
    """Smoothie is the microfacet BRDF under its masking, modified Phong that around the mirror."""
    local = frames(lit_normals())
    light, view = local @ LIGHT, local @ VIEW
    surface = Microsurface(distribution("smoothie"), 0.3)
    np.testing.assert_allclose(
        BRDFS["smoothie"](surface, lossless)(light, view),
        microfacet(surface, lossless, kelemen_szirmay_kalos)(light, view),
        rtol=1e-13,
    )
    surface = Microsurface(distribution("blinn-phong"), 20.0)
    np.testing.assert_allclose(
        BRDFS["modified-phong"](surface, lossless)(light, view),
        modified(20.0)(light, view),
        rtol=1e-11,
    )


@pytest.mark.parametrize("brdf", BRDFS.names)
def test_a_metal_scales_the_channels(brdf):
    _, grey = evaluate(brdf, "ggx", 0.3)
    normals, colored = evaluate(brdf, "ggx", 0.3, material("copper").fresnel)
    half = (LIGHT + VIEW) / np.linalg.norm(LIGHT + VIEW)
    cosine = normals @ VIEW if brdf == "modified-phong" else half @ LIGHT
    for channel, least in zip(colored, METALS["copper"], strict=True):
        expected = grey * (least + (1 - least) * (1 - cosine) ** 5)
        np.testing.assert_allclose(channel, expected, rtol=1e-12)


@pytest.mark.parametrize("fresnel", ["acrylic", "gold"])
@pytest.mark.parametrize("samples", [1, 5])
@pytest.mark.parametrize("brdf", BRDFS.names)
def test_a_set_of_brdfs_sends_what_each_alone_does(brdf, samples, fresnel):
    """The sum over samples, which for more than one goes through a table."""
    random = np.random.default_rng(3)
    theta = np.concatenate([0.05 * random.exponential(size=500), random.uniform(0, 1.6, 500)])
    view = direction(random.uniform(0, 1.5, theta.size), random.uniform(0, 7, theta.size))
    m = direction(theta, random.uniform(0, 7, theta.size))
    light = 2 * np.sum(view * m, axis=1)[:, None] * m - view
    light[-1] = -view[-1]  # no half vector
    lobes = [("ggx", 0.04), ("ggx", 0.5), ("beckmann", 0.05), ("blinn-phong", 2000.0)]
    lobes += [("gauss", 0.1), ("smoothie", 0.1)]
    brdfs = [
        BRDFS[brdf](Microsurface(distribution(name), parameter), material(fresnel).fresnel)
        for name, parameter in lobes
    ]
    brought = random.random((theta.size // samples, samples))
    found = BrdfSet(brdfs, 0.07).reflected(light, view, brought)
    for one, sent in zip(brdfs, found, strict=True):
        values = one(light, view) * brought.ravel()
        alone = values.reshape(*values.shape[:-1], *brought.shape).sum(axis=-1)
        assert sent.shape == alone.shape
        tolerance = 1e-14 if samples == 1 else 1e-6
        np.testing.assert_allclose(sent, alone, rtol=1e-13, atol=tolerance * alone.max())


@pytest.mark.parametrize("name", ["schlick", "student-t", "gtr"])
def test_the_table_ends_at_the_horizon_and_holds_an_edge(name):
    lobe = Microsurface(distribution(name), 0.3)
    theta = np.array([0, 1e-9, 0.1, 0.7, 0.8, 1.4, np.pi / 2])
    light, view = direction(theta), np.tile([0.0, 0, 1], (theta.size, 1))
    brdf = LobeBrdf(lobe.at_slope, lambda light, view: ((np.tan(theta).repeat(2),), np.ones(14)))
    brought = np.tile([1.0, 0.0], (theta.size, 1))
    found = BrdfSet([brdf], 0.2).reflected(light.repeat(2, 0), view.repeat(2, 0), brought)[0]
    np.testing.assert_allclose(found, lobe.at_slope(np.tan(theta)), atol=1e-6 * found[0])
