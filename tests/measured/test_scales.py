"""Measurements of any unit: an answer, the same but for the unit, or one clear refusal."""

import numpy as np
import pytest

from mdfconv.distributions import distribution, one_parameter_distributions
from mdfconv.errors import MdfconvError
from mdfconv.measured.brdf_fit import fit_distribution
from mdfconv.measured.model import LOSSES, SLICE_LOSSES, BrdfModel
from mdfconv.measured.samples import Samples
from tests.cli.runner import run

NAMES = [entry.name for entry in one_parameter_distributions()]
SCALES = [1e-300, 1e-150, 1.0, 1e150, 1e300]
BETA = np.radians(np.linspace(0, 80, 30))
LOBE = np.exp(-np.square(np.tan(BETA)) / 0.05) + 0.01


def samples(values):
    return Samples(BETA, np.asarray(values)[:, None], ("value",), "ndf")


@pytest.mark.parametrize("loss", SLICE_LOSSES)
@pytest.mark.parametrize("name", NAMES)
def test_a_unit_changes_only_the_unit(name, loss):
    target = distribution(name)
    gamma = 3.0 if target.second_parameter else None
    plain = fit_distribution(samples(LOBE), target, BrdfModel(loss), gamma=gamma)
    for scale in SCALES:
        found = fit_distribution(samples(LOBE * scale), target, BrdfModel(loss), gamma=gamma)
        assert found.parameters == pytest.approx(plain.parameters, rel=1e-6)
        assert found.rmse == pytest.approx(plain.rmse * scale, rel=1e-6, abs=0)
        assert np.isfinite([*found.errors.values(), found.bic]).all()


def scan(folder, lines):
    path = folder / "scan.csv"
    path.write_text("\n".join(lines))
    return path


def one_angle(values):
    degrees = np.degrees(BETA).tolist()
    return ["theta,value", *(f"{a!r},{v!r}" for a, v in zip(degrees, values, strict=True))]


def two_angles(values):
    head = "theta_i,phi_i,theta_o,phi_o,value"
    degrees = np.degrees(BETA).tolist()
    return [head, *(f"20,0,{a!r},180,{v!r}" for a, v in zip(degrees, values, strict=True))]


def answered(path, *arguments):
    """Return whether a fit has an answer; otherwise it has one line."""
    status, out, err = run("fit", path, "--format", "csv", *arguments)
    if status == 0:
        assert out.count("\n") > 1
        return True
    assert (status, out, err.count("\n")) == (2, "", 1)
    return False


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("loss", LOSSES)
def test_any_unit_of_two_directions_is_answered(tmp_path, loss, scale):
    """With k_s free: reflectance itself has one unit."""
    path = scan(tmp_path, two_angles((LOBE * scale).tolist()))
    assert answered(path, "--loss", loss, "--fresnel", "none")
    assert answered(path, "--loss", loss) == (scale == 1)


@pytest.mark.parametrize("lines", [one_angle, two_angles])
@pytest.mark.parametrize("loss", ["linear", "log"])
@pytest.mark.parametrize("decades", [20, 90, 298, 320])
def test_values_many_decades_apart(tmp_path, lines, loss, decades):
    values = np.power(10.0, -decades * np.linspace(0, 1, BETA.size)).tolist()
    path = scan(tmp_path, lines(values))
    # Of more decades too few samples are left.
    is_whole = loss == "linear" and lines is one_angle
    assert answered(path, "--loss", loss) == (is_whole or decades < 100)


@pytest.mark.parametrize("lines", [one_angle, two_angles])
@pytest.mark.parametrize("gamma", ["1e-6", "1e-4", "1e-3", "0.1", "100", "1e6"])
def test_any_legal_gamma(tmp_path, lines, gamma):
    path = scan(tmp_path, lines(LOBE.tolist()))
    for name in ("gtr", "student-t"):
        answered(path, "--to", name, "--gamma", gamma)
    assert answered(path, "--to", "gtr", "--gamma", "1e-6") is False


def test_logarithms_too_far_apart_are_named():
    values = np.maximum(LOBE, 0) * np.where(np.arange(BETA.size) == 5, 1e-298, 1)
    with pytest.raises(MdfconvError, match="1e-100 of the largest"):
        fit_distribution(samples(values), distribution("ggx"), BrdfModel("log"))
