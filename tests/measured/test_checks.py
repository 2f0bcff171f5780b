"""What is said of fits: noise, albedo, verdict and checks, against scans that are made to order."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdfconv.brdf.fresnel import dielectric, lossless
from mdfconv.brdf.microfacet import MASKINGS, Microsurface, dot, reflect
from mdfconv.brdf.reflection import microfacet
from mdfconv.distributions import distribution
from mdfconv.measured import DirectionalSamples, Samples
from mdfconv.measured.checks import Check, checks_of, verdict_of
from mdfconv.measured.scans import albedo, incidence_groups, median, noise_of
from tests.measured.scans import grid, measured, vector

INCIDENCES = (20.0, 45.0, 70.0)


def estimate_noise(samples, log_ratio):
    """Return the noise of most samples, as a verdict has it."""
    return median(noise_of(samples, log_ratio))


def directional(angles, values=None):
    """Return samples at angles in degrees, shape (n, 4)."""
    incident, outgoing, ggx = measured(np.asarray(angles, float))
    values = ggx if values is None else values
    return DirectionalSamples(incident, outgoing, values.reshape(len(incident), -1), ("one",))


def in_plane(step=1.0, incidences=INCIDENCES, largest=80.0):
    """Return scans in the plane of incidence as angles in degrees; signed θ_o goes along."""
    theta = np.arange(-largest, largest + 1e-9, step)
    incidence, signed = (a.ravel() for a in np.meshgrid(incidences, theta, indexing="ij"))
    zero = np.zeros_like(signed)
    return np.column_stack([incidence, zero, np.abs(signed), np.where(signed < 0, 0.0, 180.0)])


def residuals(angles, noise, misfit=0.2, seed=0):
    """Return ln(fit/data): noise, a smooth misfit, and outliers of 0.5 %."""
    random = np.random.default_rng(seed)
    incidence, _, zenith, azimuth = np.radians(angles).T
    smooth = misfit * np.sin(3 * zenith + 2 * incidence) * np.cos(azimuth)
    residual = smooth + noise * random.standard_normal(len(angles))
    outlying = random.random(len(angles)) < 0.005
    residual[outlying] += np.log(3) * random.choice([-1, 1], outlying.sum())
    return residual[:, None]


GEOMETRIES = {
    "fine scans": in_plane(0.25),
    "scans": in_plane(1.0),
    "coarse scans": in_plane(3.0, np.arange(0.0, 80.0, 10.0)),
    "hemispheres": grid((10, 30, 50, 70), range(0, 81, 5), range(0, 360, 10)),
    "scattered": np.column_stack(
        [
            np.repeat([15.0, 55.0], 1500),
            np.zeros(3000),
            np.degrees(np.arccos(np.random.default_rng(1).uniform(0.2, 1, 3000))),
            np.random.default_rng(2).uniform(0, 360, 3000),
        ]
    ),
    "repeated": np.repeat(in_plane(2.0), 3, axis=0),
}


@pytest.mark.parametrize("angles", GEOMETRIES.values(), ids=GEOMETRIES)
def test_noise_is_told_from_a_smooth_misfit_and_from_outliers(angles):
    samples = directional(angles)
    fit = samples.values
    estimates = []
    for seed in range(9):
        residual = residuals(angles, 0.02, seed=seed)
        measured = replace(samples, values=fit * np.exp(-residual))
        estimates.append(estimate_noise(measured, residual))
    assert 0.017 < np.median(estimates) < 0.0235


@pytest.mark.parametrize("noise", [0.001, 0.3])
def test_noise_is_in_proportion(noise):
    angles = in_plane(1.0)
    estimate = estimate_noise(directional(angles), residuals(angles, noise, misfit=0.0))
    assert estimate == pytest.approx(noise, rel=0.15)


def test_noise_is_that_of_all_channels():
    angles = in_plane(0.5)
    both = np.hstack([residuals(angles, 0.03, seed=seed) for seed in range(2)])
    assert estimate_noise(directional(angles), both) == pytest.approx(0.03, rel=0.15)


@pytest.mark.parametrize("name", ["scans", "hemispheres", "repeated"])
def test_the_order_of_samples_is_nothing_to_their_noise(name):
    angles, order = GEOMETRIES[name], np.random.default_rng(3).permutation(len(GEOMETRIES[name]))
    residual = residuals(angles, 0.02)
    turned = angles + np.array([0, 77.0, 0, 77.0])
    shuffled = estimate_noise(directional(turned[order]), residual[order])
    assert shuffled == pytest.approx(estimate_noise(directional(angles), residual), rel=0.05)
    same = estimate_noise(directional(angles[order]), residual[order])
    assert same == estimate_noise(directional(angles), residual)


def test_values_at_the_wrong_directions_are_all_noise():
    samples = directional(in_plane(1.0))
    logarithm = np.log(samples.values)
    shuffled = np.random.default_rng(0).permutation(logarithm)
    assert estimate_noise(samples, logarithm) < 0.05
    assert estimate_noise(samples, shuffled) > 0.5


def test_noise_of_one_angle():
    beta = np.radians(np.arange(0, 80, 0.1))
    noise = 0.05 * np.random.default_rng(0).standard_normal((beta.size, 1))
    samples = Samples(beta, np.ones((beta.size, 1)), ("one",), "ndf")
    assert estimate_noise(samples, noise + np.cos(beta)[:, None]) == pytest.approx(0.05, rel=0.2)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_noise_of_a_handful(count):
    angles = in_plane(10.0, (30.0,))[:count]
    estimate = estimate_noise(directional(angles), np.linspace(0, 1, count)[:, None])
    assert np.isnan(estimate) if count < 3 else estimate == pytest.approx(0, abs=0.05)


def test_noise_of_one_direction_measured_again_and_again():
    angles = np.repeat([[30.0, 0, 30.0, 180.0]], 200, axis=0)
    noise = 0.1 * np.random.default_rng(0).standard_normal((200, 1))
    estimate = estimate_noise(directional(angles, np.exp(-noise)), noise)
    assert estimate == pytest.approx(0.1, rel=0.25)


def test_noise_of_values_that_have_no_logarithm():
    angles = in_plane(1.0)
    residual = residuals(angles, 0.02)
    residual[::7] = np.inf
    residual[::11] = np.nan
    assert estimate_noise(directional(angles), residual) == pytest.approx(0.02, rel=0.2)
    assert np.isnan(estimate_noise(directional(angles), residual + np.nan))


def test_angles_of_incidence_are_told_apart_whatever_the_azimuth():
    random = np.random.default_rng(0)
    angles = grid((10, 35, 60), range(0, 80, 5), range(0, 360, 30))
    angles[:, 0] += random.uniform(-0.12, 0.12, len(angles))  # 35 ± 0.12 is in two bins of 0.25
    angles[:, [1, 3]] += random.uniform(0, 360, (len(angles), 1))
    groups = incidence_groups(directional(random.permutation(angles)))
    assert [angle for angle, _ in groups] == pytest.approx([10, 35, 60], abs=0.02)
    assert [len(index) for _, index in groups] == [len(angles) // 3] * 3


@given(st.lists(st.floats(0, 89), min_size=1, max_size=60))
def test_every_sample_is_in_one_group_of_its_incidence(incidences):
    angles = np.column_stack([incidences, *np.zeros((3, len(incidences)))])
    groups = incidence_groups(directional(angles, np.ones(len(angles))))
    everything = np.concatenate([index for _, index in groups])
    assert sorted(everything) == list(range(len(incidences)))
    assert [angle for angle, _ in groups] == sorted(angle for angle, _ in groups)
    for angle, index in groups:
        assert np.abs(angles[index, 0] - angle).max() <= 0.5 + 1e-6


def lobe(name, parameter, fresnel=lossless):
    surface = Microsurface(distribution(name), parameter)
    brdf = microfacet(surface, fresnel, MASKINGS["correlated"](surface))
    return lambda incident, outgoing: brdf(incident, outgoing)[:, None]


@pytest.mark.parametrize("width", [1e-3, 0.05, 2.0, np.nan])
@pytest.mark.parametrize("theta", [0.0, 45.0, 75.0])
def test_the_albedo_of_a_diffuse_surface_is_its_reflectance(theta, width):
    diffuse = np.array([0.0, 0.3, 1.0])
    whole = albedo(lambda i, o: np.tile(diffuse / np.pi, (len(o), 1)), np.radians(theta), width)
    assert whole == pytest.approx(diffuse, rel=1e-4)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.4, 1.0])
@pytest.mark.parametrize("theta", [0.0, 45.0, 75.0])
@pytest.mark.parametrize("index", [1.5, None])
def test_the_albedo_of_a_lobe_is_that_of_visible_normals(alpha, theta, index):
    """A draw of visible normals weighs F G₂/G₁, whose mean is the albedo (Heitz 2018)."""
    surface = Microsurface(distribution("ggx"), alpha)
    fresnel = lossless if index is None else lambda cosine: dielectric(cosine, index)
    view = np.broadcast_to(vector(np.radians(theta), 0.0), (100_000, 3))
    m = surface.visible_normals(view, *np.random.default_rng(5).random((2, len(view))))
    light = reflect(view, m)
    shadowed = np.where(light[:, 2] > 0, surface.correlated(light, view, m), 0)
    weight = fresnel(dot(view, m)) * shadowed / surface.smith_g1(view, m)
    error = weight.std() / np.sqrt(len(view))
    whole = albedo(lobe("ggx", alpha, fresnel), np.radians(theta), alpha)
    assert whole[0] == pytest.approx(weight.mean(), abs=4 * error + 1e-4)


@pytest.mark.parametrize("theta", [0.0, 45.0, 75.0])
def test_two_lobes_of_different_widths_are_integrated_on_the_narrow_one(theta):
    narrow, wide = lobe("ggx", 0.01), lobe("beckmann", 0.5)
    angle = np.radians(theta)
    together = albedo(lambda *d: 0.75 * narrow(*d) + 0.25 * wide(*d), angle, 0.006)
    apart = 0.75 * albedo(narrow, angle, 0.006) + 0.25 * albedo(wide, angle, 0.4)
    assert together == pytest.approx(apart, rel=1e-3)


class Scan:
    """Scans of a surface whose GGX lobe is known, with noise, and a fit of it that is given."""

    def __init__(self, misfit=0.0, noise=0.02, floor=0.0, angles=None, seed=0, **fitted):
        angles = in_plane(1.0) if angles is None else angles
        random = np.random.default_rng(seed)
        fit = directional(angles)
        incident, outgoing, values = fit.incident, fit.outgoing, fit.values
        misfit = misfit(*angles.T)[:, None] if callable(misfit) else misfit
        data = values * np.exp(-misfit - noise * random.standard_normal(values.shape))
        data += floor * random.standard_normal(values.shape)
        positive = (data > 0).all(axis=1)
        self.samples = DirectionalSamples(incident, outgoing, data, ("one",)).select(positive)
        self.log_ratio = np.log(values[positive] / self.samples.values)
        size = np.abs(self.log_ratio).max(axis=1)
        self.weights = np.minimum(1, 1.345 * 1.4826 * np.median(size) / size)
        square = np.mean(self.log_ratio**2, axis=1)
        self.error = float(np.sqrt(np.average(square, weights=self.weights)))
        self.noise = noise_of(self.samples, self.log_ratio)
        known = {
            "distribution": distribution("ggx"),
            "label": "GGX",
            "parameter": 0.3,
            "second": None,
            "gamma": None,
            "fresnel": "metal",
            "n": None,
            "f0": (0.9,),
            "diffuse": (0.001,),
            "error": self.error,
            "at_limit": (),
            "unknowns": ("alpha", "F0", "k_d"),
            "correlation": np.eye(3),
            "albedo": lambda theta: np.array([0.88]),
        }
        self.fit = SimpleNamespace(**(known | fitted))
        self.known = {"error": self.error, "noise": self.noise, "weights": self.weights}

    def checks(self, **options):
        found = checks_of(self.samples, self.log_ratio, self.fit, **(self.known | options))
        assert len({check.name for check in found}) == len(found)
        return {check.name: check for check in found}

    def verdict(self, fits=(), **options):
        fits = [self.fit, *fits]
        known = self.known | options
        return verdict_of(self.samples, self.log_ratio, fits, self.fit, **known)


def test_a_fit_within_the_noise_is_good():
    verdict = Scan().verdict()
    assert verdict.grade == "good"
    start = "A rough metal, described by GGX with an RMS error of "
    assert verdict.sentence.startswith(start)
    assert "(483 samples, noise 2" in verdict.sentence


@pytest.mark.parametrize(
    ("error", "grade"), [(0.04, "good"), (0.08, "usable"), (0.18, "usable"), (0.3, "poor")]
)
def test_grades_go_by_the_misfit(error, grade):
    scan = Scan(lambda i, _, o, p: error * np.sqrt(2) * np.sin(np.radians(4 * o + i)), 0.005)
    assert scan.error == pytest.approx(error, rel=0.15)
    assert scan.verdict().grade == grade


def test_a_large_error_of_dark_samples_is_noise():
    """Far from a narrow lobe values are as small as the noise of the detector."""
    scan = Scan(floor=0.012)
    assert scan.error > 0.06
    verdict = scan.verdict()
    assert verdict.grade == "good"
    assert "noise of dark samples" in verdict.sentence


def test_values_at_wrong_directions_are_no_good_fit():
    scan = Scan()
    shuffled = np.random.default_rng(0).permutation(scan.samples.values)
    scan.log_ratio = scan.log_ratio + np.log(scan.samples.values / shuffled)
    scan.samples = replace(scan.samples, values=shuffled)
    error = float(np.sqrt(np.mean(scan.log_ratio**2)))
    noise = noise_of(scan.samples, scan.log_ratio)
    assert scan.verdict(error=error, noise=noise).grade == "poor"


@pytest.mark.parametrize(
    ("misfit", "where"),
    [
        (lambda i, p, o, q: 0.3 * (i >= 60), "at θ_i ≥ 50°"),
        (lambda i, p, o, q: 0.3 * (o >= 60), "at θ_o ≥ 60°"),
        (lambda i, p, o, q: 0.3 * (o < 15), "at θ_o < 15°"),
        (lambda i, p, o, q: 0.3 * ((np.abs(o - i) <= 5) & (q > 90)), "within 5° of the mirror"),
    ],
)
def test_a_verdict_says_where_the_misfit_is(misfit, where):
    scan = Scan(misfit, 0.01)
    verdict = scan.verdict(weights=np.ones_like(scan.weights))
    assert f"The misfit is largest {where}" in verdict.sentence
    assert "30 %" in verdict.sentence or "29 %" in verdict.sentence


def test_outliers_are_no_place():
    scan = Scan(noise=0.02)
    angles = in_plane(1.0)
    peak = np.flatnonzero(np.abs(angles[:, 2] - angles[:, 0]) + (angles[:, 3] < 90) <= 2)
    scan.log_ratio[peak[::4]] = 1.1
    scan.weights[peak[::4]] = 0.03
    assert "largest" not in scan.verdict(error=0.06).sentence


def test_a_misfit_everywhere_is_nowhere_largest():
    scan = Scan(lambda i, p, o, q: 0.1 * np.sign(np.sin(o + i)), 0.01)
    assert "largest" not in scan.verdict().sentence


def two_lobes(error):
    return SimpleNamespace(
        distribution=distribution("ggx"), label="two GGX lobes", parameter=0.0139, second=0.206,
        share=0.75, error=error,
    )  # fmt: skip


def test_a_surface_that_needs_two_lobes():
    scan = Scan(lambda i, p, o, q: 0.6 * np.sin(np.radians(3 * o)))
    sentence = scan.verdict([two_lobes(0.5 * scan.error)]).sentence
    assert sentence.startswith("No single lobe describes this surface: GGX leaves an RMS error ")
    lobes = "Two GGX lobes, a narrow core with long tails (α = 0.014 and 0.21, 75:25), would halve"
    assert lobes in sentence
    assert "two GGX" not in scan.verdict([two_lobes(0.9 * scan.error)]).sentence.lower()


def test_a_surface_of_two_lobes():
    scan = Scan(label="two GGX lobes", parameter=0.0139, second=0.206, share=0.75)
    single = SimpleNamespace(label="GGX", second=None, error=10 * scan.error)
    sentence = scan.verdict([single]).sentence
    assert "described by two GGX lobes, a narrow core with long tails (α = 0.014" in sentence
    assert "The best single lobe, GGX, leaves 19 %." in sentence


@pytest.mark.parametrize(
    ("fitted", "surface"),
    [
        ({}, "A rough metal"),
        ({"parameter": 0.1}, "A glossy metal"),
        ({"f0": (1.0, 0.77, 0.34)}, "A rough, coloured metal"),
        ({"f0": (0.17,)}, "A rough surface of reflectance F₀ = 0.17"),
        ({"f0": (0.04,)}, "A rough dielectric without a diffuse base"),
        ({"fresnel": "dielectric", "f0": (0.04,), "diffuse": (0.03,)}, "A dark, rough dielectric"),
        (
            {"fresnel": "ior:1.5", "f0": (0.04,), "diffuse": (0.5, 0.2, 0.1)},
            "A rough dielectric over a coloured base",
        ),
        ({"fresnel": "none", "f0": None}, "Values"),
    ],
)
def test_the_kind_of_surface(fitted, surface):
    assert Scan(**fitted).verdict().sentence.startswith(f"{surface}, described by GGX")


def test_more_light_than_falls_on_a_surface_is_asked_for_its_unit():
    scan = Scan(albedo=lambda theta: np.array([1.2, 2.5]))
    check = scan.checks()["energy"]
    assert check.passed is False
    assert "250 % at 0°, 250 % at 45°, 250 % at 75°: more light than falls on it" in check.text
    assert "π f_r" in check.text
    assert check.argument == "values_are"
    verdict = scan.verdict(checks=[check])
    assert verdict.grade == "poor"
    assert verdict.sentence.startswith("No surface reflects so much: The surface reflects 250 %")


def test_few_samples_are_never_good():
    scan = Scan()
    few = [check for check in scan.checks().values() if check.name == "samples"]
    assert not few
    check = Check("samples", False, "5 values for 3 unknowns")
    assert scan.verdict(checks=[check]).grade == "usable"


def test_many_negative_values_are_noise():
    for count, passed in ((1, None), (30, False)):
        text = f"{count} of 100 samples are negative and left out"
        check = Scan().checks(left_out=[text])["left out"]
        assert check.passed is passed
        assert ("upper bound" in check.text) == (passed is False)


def test_a_little_more_light_is_a_matter_of_calibration():
    check = Scan(albedo=lambda theta: np.array([1.01])).checks()["energy"]
    assert not check.passed
    assert "calibration" in check.text
    assert not check.argument


def test_more_light_where_nothing_was_measured():
    angles = in_plane(1.0, (10.0, 30.0))
    scan = Scan(angles=angles, albedo=lambda theta: np.array([1.5 if theta > 1 else 0.9]))
    assert "beyond 30° was measured" in scan.checks()["energy"].text


@pytest.mark.parametrize(
    ("fitted", "passed", "words"),
    [
        ({"f0": (0.9, 0.8)}, True, "F₀ = 0.9, 0.8 is usual for a metal"),
        ({"f0": (0.17,)}, False, "low for a metal: check the calibration"),
        ({"f0": (0.04,)}, True, "n = 1.5, though Schlick's"),
        ({"fresnel": "dielectric", "n": 1.5, "f0": (0.04,)}, True, "n = 1.5."),
        ({"fresnel": "dielectric", "n": 2.23, "f0": (0.145,)}, False, "have 1.3 to 1.9"),
    ],
)
def test_a_reflectance_is_that_of_a_material(fitted, passed, words):
    check = Scan(**fitted).checks()["reflectance"]
    assert check.passed is passed
    assert words in check.text


@pytest.mark.parametrize(
    ("alpha", "step", "aperture", "passed"),
    # 4 β_half = 4 atan(α √(√2 − 1)) is 14.7° and 1.5°.
    [
        (0.1, 0.5, None, True),
        (0.01, 0.5, None, False),
        (0.1, 0.5, 4.9, True),
        (0.1, 0.5, 5.0, False),
    ],
)
def test_a_lobe_is_wider_than_steps_and_aperture(alpha, step, aperture, passed):
    check = Scan(angles=in_plane(step), parameter=alpha).checks(aperture=aperture)["resolution"]
    assert check.passed is passed
    assert f"the step {step:g}°" in check.text
    assert ("roughness is uncertain" in check.text) is not passed


def test_a_peak_between_two_steps_is_not_resolved_whatever_the_fit_says():
    """MERL's aluminium: a core of 0.7° and tails, which a single lobe takes for 15°."""
    angles = in_plane(0.7, (11.2, 45.0))
    scan = Scan(angles=angles, parameter=0.1)
    spike = np.where(np.abs(angles[:, 2] - angles[:, 0]) < 0.5, 50.0, 1.0)[:, None]
    scan.samples = replace(scan.samples, values=scan.samples.values * spike)
    check = scan.checks(error=0.5)["resolution"]
    assert not check.passed
    assert "1.4° wide" in check.text


def by_incidence(*parameters, error=0.001):
    return [
        SimpleNamespace(angle=angle, count=100, parameter=parameter, parameter_error=error)
        for angle, parameter in zip((15.0, 45.0, 70.0), parameters, strict=True)
    ]


@pytest.mark.parametrize(
    ("single", "passed", "words"),
    [
        (by_incidence(0.42, 0.35, 0.21), False, "α falls from 0.42 (θ_i = 15°) to 0.21"),
        (by_incidence(0.21, 0.3, 0.35), False, "α rises from 0.21"),
        (by_incidence(0.42, 0.43, 0.21), False, "α falls from 0.42 (θ_i = 15°) to 0.21"),
        (by_incidence(0.3, 0.2, 0.31), False, "between 0.2 (θ_i = 45°) and 0.31 (θ_i = 70°)"),
        (by_incidence(0.3, 0.31, 0.29), True, "between 0.29"),
        (by_incidence(0.3, 0.4, 0.2, error=0.09), True, "between 0.2"),
        (by_incidence(0.3, 0.3, np.nan), True, "between 0.3"),
    ],
)
def test_one_parameter_for_all_angles_of_incidence(single, passed, words):
    check = Scan().checks(by_incidence=single)["incidences"]
    assert check.passed is passed
    assert words in check.text


def test_a_single_angle_of_incidence_has_no_drift():
    assert "incidences" not in Scan().checks(by_incidence=by_incidence(0.3, np.nan, np.nan))


def test_parameters_at_ends_and_not_told_apart():
    correlation = np.array([[1, -0.5, 0.1], [-0.5, 1, -0.97], [0.1, -0.97, 1]])
    checks = Scan(at_limit=("alpha",), correlation=correlation).checks()
    assert checks["ranges"].text == "α is at an end of the range: the data do not bound it."
    assert "is -0.97, of F₀ and k_d: the data hardly" in checks["correlation"].text
    checks = Scan().checks()
    assert checks["ranges"].passed
    assert checks["correlation"].passed


@pytest.mark.parametrize(
    ("noise", "specular", "f0", "gain", "passed", "words"),
    [
        (0.1, (1.1,), 0.9, 0.99, True, "would gain nothing"),
        (0.1, (1.1,), 0.9, 0.9, True, "only"),
        (0.02, (0.7,), 0.9, 0.7, True, "only"),
        (0.1, (2.8,), 0.9, 0.55, False, "the model, not the calibration, is in doubt"),
        (0.1, (0.26,), 2.5, 0.55, False, "F does not rise to 1 towards grazing"),
        (0.1, (3.2, 3.0), 0.04, 0.4, False, "are these reflectance factors"),
    ],
)
def test_a_lobe_of_another_strength(noise, specular, f0, gain, passed, words):
    scan = Scan(noise=noise)
    freed = SimpleNamespace(error=gain * scan.fit.error, specular=specular, f0=(f0,))
    check = scan.checks(freed=freed)["strength"]
    assert check.passed is passed
    assert words in check.text
    assert bool(check.argument) == ("factors" in words)


@pytest.mark.parametrize(("count", "passed"), [(0, True), (5, True), (60, False)])
def test_outliers_are_counted(count, passed):
    scan = Scan()
    scan.log_ratio[:count] += 1
    scan.weights[:count] = 0.1
    check = scan.checks()["outliers"]
    assert check.passed is passed
    assert check.text.startswith(f"{count} of 483 samples")


def test_values_that_are_largest_towards_the_light():
    angles = in_plane(1.0)
    assert Scan(angles=angles).checks()["mirror side"].passed
    angles[:, 3] = 180 - angles[:, 3]
    scan = Scan()
    scan.samples = replace(scan.samples, outgoing=measured(angles)[1])
    assert not scan.checks()["mirror side"].passed


def test_what_was_left_out_is_neither_right_nor_wrong():
    check = Scan().checks(left_out=("3 samples are 0 or less", "5 are beyond 80°"))["left out"]
    assert check.passed is None
    assert check.text == "3 samples are 0 or less; 5 are beyond 80°."


def test_verdict_and_checks_of_one_angle():
    beta = np.radians(np.arange(0, 80, 1.0))
    fit = distribution("ggx").unit(beta, 0.25)[:, None]
    residual = 0.02 * np.random.default_rng(0).standard_normal(fit.shape)
    samples = Samples(beta, fit * np.exp(-residual), ("one",), "ndf")
    fitted = Scan(parameter=0.25, fresnel=None, f0=None, diffuse=None, specular=None).fit
    noise, weights = noise_of(samples, residual), np.ones(len(beta))
    checks = checks_of(samples, residual, fitted, error=0.02, noise=noise, weights=weights)
    names = {check.name for check in checks if check.passed}
    assert names == {"resolution", "ranges", "correlation", "outliers"}
    verdict = verdict_of(
        samples, residual, [fitted], fitted, error=0.02, noise=noise, weights=weights, checks=checks
    )
    assert verdict.grade == "good"
    assert verdict.sentence.startswith("Values, described by GGX with an RMS error of 2 % (80 ")


@given(
    st.lists(
        st.tuples(*[st.floats(0, 89), st.floats(-180, 180)] * 2, st.floats(1e-12, 1e12)),
        min_size=1,
        max_size=12,
    ),
    st.sampled_from([0.0, 0.5, np.nan]),
)
def test_a_handful_of_samples_is_judged_without_a_word_of_numpy(rows, misfit):
    """One direction, one sample, all at the normal: warnings are errors here."""
    rows = np.array(rows)
    scan = Scan()
    scan.samples = directional(rows[:, :4], rows[:, 4])
    scan.log_ratio = misfit * np.sign(np.arange(len(rows)) % 2 - 0.5)[:, None]
    scan.weights = np.ones(len(rows))
    scan.known["noise"] = noise_of(scan.samples, scan.log_ratio)
    scan.known["weights"] = scan.weights
    error = 0.0 if np.isnan(misfit) else misfit
    checks = scan.checks(error=error)
    verdict = scan.verdict(error=error, checks=list(checks.values()))
    assert verdict.grade in ("good", "usable", "poor")
    for text in (verdict.sentence, *(check.text for check in checks.values())):
        assert "nan" not in text.split()
        assert text.endswith((".", "?"))
