"""Every sampler against its density: chi-squared tests, seeded."""

import numpy as np
import pytest
from scipy.stats import chi2

from mdfconv.brdf import Microsurface
from mdfconv.brdf.microfacet import direction, dot, frames, reflect, unit
from mdfconv.distributions import distribution
from mdfconv.errors import MdfconvError
from mdfconv.studies.furnace import cosine_lobe, cosine_lobe_density, reflected_density

COUNT = 200_000
BINS = (24, 48)
FINE = 10
VIEWS = [direction(theta, phi) for theta, phi in [(0.0, 0.0), (0.8, 0.4), (1.5, 2.0)]]
SMOOTH = (0.1, 0.6, 1.0, (0.2, 0.7))
# Drawn by their own quantiles; rough, so that the cells resolve them.
OTHERS = [("blinn-phong", 6.0), ("gtr", 0.4), ("smoothie", 0.9), ("student-t", 0.5)]
CASES = [
    *[(f"{kind} {a}", kind, a, None) for kind in ("ggx", "beckmann") for a in SMOOTH],
    *[(f"{kind} {a}", kind, a, None) for kind, a in OTHERS],
    *[(f"visible {a} {i}", "visible", a, v) for a in SMOOTH for i, v in enumerate(VIEWS)],
    *[(f"cosine {n} {i}", "cosine", n, v) for n in (0.0, 1, 40) for i, v in enumerate(VIEWS)],
    *[(f"reflected {i}", "reflected", 0.5, v) for i, v in enumerate(VIEWS)],
]
# A family-wise level of 0.1 %, by Šidák over all cases.
LEVEL = 1 - (1 - 1e-3) ** (1 / len(CASES))


def surface(name, parameter):
    return Microsurface(distribution(name), parameter)


def draw(kind, parameter, view, u1, u2):
    if kind == "visible":
        views = np.broadcast_to(view, (*u1.shape, 3))
        return surface("ggx", parameter).visible_normals(views, u1, u2)
    if kind == "cosine":
        return cosine_lobe(view, parameter, u1, u2)
    if kind == "reflected":
        views = np.broadcast_to(view, (*u1.shape, 3))
        return reflect(views, surface("ggx", parameter).visible_normals(views, u1, u2))
    return surface(kind, parameter).half_vectors(u1, u2)


def density(kind, parameter, view, omega):
    views = None if view is None else np.broadcast_to(view, omega.shape)
    if kind == "visible":
        return surface("ggx", parameter).visible_normal_density(views, omega)
    if kind == "cosine":
        return cosine_lobe_density(view, parameter, omega)
    if kind == "reflected":
        m = unit(omega + views)
        m = m * np.sign(m[..., 2:])
        seen = surface("ggx", parameter).visible_normal_density(views, m)
        return reflected_density(seen, views, m)
    return surface(kind, parameter).half_vector_density(omega)


def expected(kind, parameter, view):
    """Integrate the density over cells of cos θ, from −1, and φ by the midpoint rule."""
    rows, columns = BINS
    cosine = -1 + 2 * (np.arange(rows * FINE) + 0.5) / (rows * FINE)
    # Lobes at the poles need cells that shrink there: cos θ = ±(1 − v²), see cells().
    cosine, measure = stretched(cosine)
    phi = -np.pi + 2 * np.pi * (np.arange(columns * FINE) + 0.5) / (columns * FINE)
    omega = direction(np.arccos(cosine)[:, None], phi)
    area = measure[:, None] * (2 / (rows * FINE)) * (2 * np.pi / (columns * FINE))
    value = density(kind, parameter, view, omega) * area
    return value.reshape(rows, FINE, columns, FINE).sum(axis=(1, 3)) * COUNT


def stretched(v):
    """Return cos θ = sin(πv/2)-like map that is dense at both poles, and its derivative."""
    return np.sign(v) * (1 - (1 - np.abs(v)) ** 2), 2 * (1 - np.abs(v))


def cells(omega):
    """Return the counts of directions in the cells of `expected`."""
    cosine = np.clip(omega[..., 2], -1, 1)
    v = np.sign(cosine) * (1 - np.sqrt(1 - np.abs(cosine)))
    phi = np.arctan2(omega[..., 1], omega[..., 0])
    return np.histogram2d(v, phi, bins=BINS, range=[(-1, 1), (-np.pi, np.pi)])[0]


@pytest.mark.parametrize(("name", "kind", "parameter", "view"), CASES, ids=lambda v: str(v)[:24])
def test_chi_squared(name, kind, parameter, view):
    random = np.random.default_rng(sum(map(ord, name)))
    u1, u2 = random.random((2, COUNT))
    omega = draw(kind, parameter, view, u1, u2)
    assert np.allclose(np.linalg.norm(omega, axis=-1), 1, atol=1e-12)
    counts, wanted = cells(omega).ravel(), expected(kind, parameter, view).ravel()
    assert wanted.sum() == pytest.approx(COUNT, rel=5e-3)
    # Cells with few expected counts are pooled.
    rare = wanted < 10
    counts = np.append(counts[~rare], counts[rare].sum())
    wanted = np.append(wanted[~rare], wanted[rare].sum())
    keep = wanted > 5
    statistic = np.sum(np.square(counts[keep] - wanted[keep]) / wanted[keep])
    assert chi2.sf(statistic, keep.sum() - 1) > LEVEL


@pytest.mark.parametrize("alpha", [1e-4, 0.05, 0.5, 1.0, (0.1, 0.9)])
def test_weights_of_visible_normals_are_shares(alpha):
    random = np.random.default_rng(3)
    cosine = np.append(10 ** random.uniform(-9, 0, 2000), [1.0, 1e-12])
    view = direction(np.arccos(cosine), random.uniform(0, 6, cosine.size))
    facets = surface("ggx", alpha)
    m = facets.visible_normals(view, *random.random((2, cosine.size)))
    light = reflect(view, m)
    above = light[:, 2] > 0
    weight = facets.correlated(light, view, m)[above] / facets.smith_g1(view, m)[above]
    assert ((weight >= 0) & (weight <= 1 + 1e-12)).all()
    assert (dot(view, m) >= -1e-9).all()
    assert (m[:, 2] > 0).all()


def test_ends_of_the_random_numbers():
    u = np.array([0.0, np.nextafter(1, 0)])
    for kind in ("ggx", "beckmann"):
        assert np.isfinite(surface(kind, 0.5).half_vectors(u, u)).all()
        assert np.isfinite(surface(kind, (0.5, 0.2)).half_vectors(u, u)).all()
    view = np.broadcast_to(direction(1.2), (2, 3))
    assert np.isfinite(surface("ggx", 0.5).visible_normals(view, u, u)).all()
    assert np.isfinite(cosine_lobe(direction(0.3), 1e6, u, u)).all()


def test_what_cannot_be_drawn_is_refused():
    u = np.array([0.5])
    for name in ("beckmann", "gauss"):
        with pytest.raises(MdfconvError, match=f"{name} has no sampler of visible normals; ggx"):
            surface(name, 0.3).visible_normals(direction(np.array([0.2])), u, u)
    with pytest.raises(MdfconvError, match="no sampler for a pair"):
        surface("ashikhmin-shirley", (5.0, 9.0)).half_vectors(u, u)
    with pytest.raises(MdfconvError, match="smoothie takes no pair"):
        surface("smoothie", (0.1, 0.3))
    with pytest.raises(MdfconvError, match="got 1 values"):
        surface("ggx", (0.1,))


def test_frames_are_orthonormal_and_right_handed():
    random = np.random.default_rng(1)
    normals = np.concatenate([unit(random.normal(size=(500, 3))), np.eye(3), -np.eye(3)])
    axes = frames(normals)
    np.testing.assert_allclose(
        axes @ np.swapaxes(axes, 1, 2), np.broadcast_to(np.eye(3), axes.shape), atol=1e-15
    )
    np.testing.assert_allclose(np.linalg.det(axes), 1, rtol=1e-14)
    np.testing.assert_array_equal(axes[:, 2], normals)
