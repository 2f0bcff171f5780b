"""Masking against 50 digits and against the identity that defines Smith's."""

import itertools

import mpmath as mp
import numpy as np
import pytest

from mdfconv.brdf.fresnel import lossless
from mdfconv.brdf.microfacet import MASKINGS, Microsurface, direction, dot, half_vector, v_cavity
from mdfconv.brdf.reflection import (
    ashikhmin_shirley,
    microfacet,
    modified,
    smoothie,
    smoothie_approx,
)
from mdfconv.distributions import distribution, list_distributions
from mdfconv.errors import MdfconvError
from tests import oracles

assert oracles.mp.mp.dps >= 50
RANDOM = np.random.default_rng(11)
ALPHAS = [1e-4, 0.01, 0.3, 1.0]


def surface(name, parameter):
    return Microsurface(distribution(name), parameter)


def hemisphere(count):
    """Random directions, grazing ones among them."""
    cosine = np.concatenate([RANDOM.uniform(0, 1, count - 20), 10 ** RANDOM.uniform(-9, -2, 20)])
    return direction(np.arccos(cosine), RANDOM.uniform(-np.pi, np.pi, count))


@pytest.mark.parametrize("name", ["ggx", "beckmann"])
def test_lambda_at_fifty_digits(name):
    for alpha, theta in itertools.product(
        [1e-4, 0.01, 0.5, 1.0], [0, 1e-6, 0.3, 1.2, 1.57, np.pi / 2 - 1e-9]
    ):
        omega = direction(theta)
        got = float(surface(name, alpha).smith_lambda(omega))
        slope = mp.mpf(alpha) * mp.mpf(float(omega[0])) / mp.mpf(float(omega[2]))
        if name == "ggx":
            wanted = (mp.sqrt(1 + slope**2) - 1) / 2
        else:
            a = 1 / slope if slope else mp.inf
            wanted = (mp.erf(a) - 1) / 2 + mp.exp(-a * a) / (2 * a * mp.sqrt(mp.pi)) if slope else 0
        # What is added to 1 needs no relative precision below its last digit.
        assert got == pytest.approx(float(wanted), rel=1e-12, abs=1e-17)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.5, 1.0, (0.1, 0.6)])
@pytest.mark.parametrize("name", ["ggx", "beckmann"])
def test_visible_area_is_the_projected_area(name, alpha):
    """∫ G₁(ω, m) ⟨ω·m⟩ D(m) dm = cos θ_o (Heitz 2014, eq. 17), by slopes p, D dm = P dp / cos θ."""
    for theta, azimuth in itertools.product([0.0, 0.5, 1.2, 1.5, 1.57], [0.0, 0.7]):
        omega = direction(theta, azimuth)
        m, weight = slopes(omega, alpha)
        facing = np.maximum(dot(omega, m), 0)
        value = surface(name, alpha).density(m) * facing * weight
        g1 = 1 / (1 + surface(name, alpha).smith_lambda(omega))
        assert float(g1 * value.sum()) == pytest.approx(np.cos(theta), abs=1e-8)


def slopes(omega, alpha):
    """Return normals and weights in dω: polar in slopes of unit roughness, split at visibility."""
    alpha_x, alpha_y = alpha if isinstance(alpha, tuple) else (alpha, alpha)
    x, y, z = omega
    toward = np.arctan2(alpha_y * y, alpha_x * x)
    tilt = np.hypot(alpha_x * x, alpha_y * y) / z
    nodes, w = np.polynomial.legendre.leggauss(24)
    # A normal of slope r towards φ is visible where 1 + r tilt cos(φ − φ₀) > 0.
    edge = np.append(0, np.geomspace(1e-9, np.pi / 2, 26))
    edges = np.unique(np.concatenate([np.pi / 2 - edge, np.pi / 2 + edge]))
    phi, phi_weight = panels(edges, nodes, w)
    radial, radial_weight = panels(np.linspace(0, 1, 13), nodes, w)
    cosine = np.cos(phi)
    limit = np.where(cosine < 0, -1 / np.minimum(tilt * cosine, -1e-12), 1e12)
    # r = s/(1−s) covers [0, ∞), up to where the normals turn away.
    end = limit / (1 + limit)
    s = radial * end[:, None]
    r = s / (1 - s)
    jacobian = radial_weight * end[:, None] / np.square(1 - s)
    signed = [toward + phi, toward - phi]
    slope = [r * np.stack([np.cos(a), np.sin(a)])[..., None] for a in signed]
    both = np.concatenate(slope, axis=1) * np.array([alpha_x, alpha_y])[:, None, None]
    scale = 1 + np.square(both).sum(axis=0)
    m = np.stack([*both, np.ones_like(scale)], axis=-1) / np.sqrt(scale)[..., None]
    area = np.tile(r * jacobian * phi_weight[:, None], (2, 1)) * alpha_x * alpha_y
    return m, area / scale**1.5


def panels(edges, x, w):
    half = 0.5 * np.diff(edges)[:, None]
    return (edges[:-1, None] + half * (1 + x)).ravel(), (half * w).ravel()


def brdfs():
    pairs = [(name, kind) for name in ("ggx", "beckmann") for kind in MASKINGS.names]
    for (name, kind), alpha in itertools.product(pairs, [*ALPHAS, (0.05, 0.4)]):
        facets = surface(name, alpha)
        yield f"{name}-{kind}-{alpha}", microfacet(facets, lossless, MASKINGS[kind](facets))
    for alpha in ALPHAS:
        yield f"smoothie-{alpha}", smoothie(surface("smoothie", alpha), lossless)
        yield f"smoothie-approx-{alpha}", smoothie_approx(surface("smoothie", alpha), lossless)
    for exponent in (0.0, 1.0, 300.0):
        yield f"phong-{exponent}", modified(exponent)
        if exponent:
            facets = surface("ashikhmin-shirley", exponent)
            yield f"ashikhmin-shirley-{exponent}", ashikhmin_shirley(facets, lossless)


BRDFS = dict(brdfs())


@pytest.mark.parametrize("name", BRDFS)
def test_light_and_viewer_may_change_places(name):
    brdf = BRDFS[name]
    light, view = hemisphere(400), hemisphere(400)
    there, back = brdf(light, view), brdf(view, light)
    assert np.isfinite(there).all()
    assert (there >= 0).all()
    assert np.max(np.abs(there - back) / np.maximum(there, 1e-300)) < 1e-12


@pytest.mark.parametrize("name", BRDFS)
def test_the_ends_of_the_hemisphere_are_no_accident(name):
    brdf = BRDFS[name]
    ends = direction(np.array([0.0, 1e-12, 0.5, np.pi / 2 - 1e-12, np.pi / 2, 2.5]))
    light, view = ends[:, None, :], ends[None, :, :]
    shape = np.broadcast_shapes(light.shape, view.shape)
    value = brdf(np.broadcast_to(light, shape), np.broadcast_to(view, shape))
    assert not np.isnan(value).any()
    assert (value[-1] == 0).all()
    assert (value[:, -1] == 0).all()


def test_masking_is_between_0_and_1_and_separable_the_smaller():
    light, view = hemisphere(300), hemisphere(300)
    m = half_vector(light, view)
    for name, alpha in itertools.product(["ggx", "beckmann"], ALPHAS):
        facets = surface(name, alpha)
        values = {kind: MASKINGS[kind](facets)(light, view, m) for kind in MASKINGS.names}
        for kind in ("correlated", "separable", "v-cavity", "none"):
            assert ((values[kind] >= 0) & (values[kind] <= 1)).all()
        assert (values["separable"] <= values["correlated"] * (1 + 1e-15)).all()


def test_a_facet_seen_from_behind_is_masked():
    omega, m = direction(0.3), direction(2.0, np.pi)
    assert surface("ggx", 0.2).smith_g1(omega, m) == 0
    assert surface("ggx", 0.2).smith_g1(omega, direction(0.1)) > 0.9


@pytest.mark.parametrize("name", ["smoothie", "gtr", "student-t"])
def test_a_distribution_that_is_another_has_its_masking(name):
    """Smoothie is GGX with α/√(4+α²); GTR and Student-t are GGX at their default γ of 2."""
    alpha = 0.6
    ggx = alpha / np.sqrt(4 + alpha**2) if name == "smoothie" else alpha
    omega = hemisphere(50)
    expected = surface("ggx", ggx).smith_lambda(omega)
    assert surface(name, alpha).smith_lambda(omega) == pytest.approx(expected, rel=1e-14)
    assert surface(name, alpha).has_visible_normals


@pytest.mark.parametrize("gamma", [None, 3.0])
@pytest.mark.parametrize("name", [entry.name for entry in list_distributions()])
def test_masking_of_every_distribution(name, gamma):
    """Heitz's identity as above, on nodes in slopes as wide as the lobe."""
    mdf = distribution(name)
    if gamma and not mdf.second_parameter:
        pytest.skip("no γ")
    mdf = mdf.with_gamma(gamma) if gamma else mdf
    parameter = mdf.parameter.typical_value
    omega = direction(1.2)
    m, weight = slopes(omega, float(mdf.peak_alpha(parameter)))
    facets = Microsurface(mdf, parameter)
    value = facets.density(m) * np.maximum(dot(omega, m), 0) * weight
    # The nodes know nothing of the end of a support.
    tolerance = 1e-8 if mdf.edge(np.array([parameter])) is None else 1e-6
    assert float(value.sum() / (1 + facets.smith_lambda(omega))) == pytest.approx(
        omega[2], abs=tolerance
    )


def test_masking_does_not_depend_on_the_form_of_d():
    light, view = direction(0.4), direction(1.1, 2.0)
    m = half_vector(light, view)
    unit_form = Microsurface(distribution("beckmann"), 0.3, normalized=False)
    normalized = surface("beckmann", 0.3)
    assert unit_form.correlated(light, view, m) == normalized.correlated(light, view, m)
    assert unit_form.half_vector_density(m) == normalized.half_vector_density(m)
    assert unit_form.density(m) == pytest.approx(normalized.density(m) * np.pi * 0.3**2)


def test_mistakes():
    pair = surface("ashikhmin-shirley", (10.0, 100.0))
    with pytest.raises(MdfconvError, match="shirley has no Smith's masking for a pair of param"):
        MASKINGS["correlated"](pair)(direction(0.1), direction(0.1), direction(0.0))
    with pytest.raises(MdfconvError, match="unknown masking 'smith'"):
        MASKINGS["smith"]
    with pytest.raises(MdfconvError, match="outside the legal range"):
        surface("ggx", 0.0)
    with pytest.raises(MdfconvError, match="outside the legal range"):
        surface("ggx", (0.1, 0.0))
    assert MASKINGS["V_Cavity"](surface("gauss", 0.1)) is v_cavity
