"""What distributions declare of themselves, against its definition."""

import copy

import numpy as np
import pytest

import mdfconv
from mdfconv.distributions import distribution, register
from mdfconv.distributions.beckmann import Beckmann
from mdfconv.distributions.blinn_phong import BlinnPhong
from mdfconv.errors import MdfconvError
from tests.distributions.cases import ENTRIES, INSTANCES, parameters
from tests.distributions.operation_count import operations_of

TOLERANCE = 1e-9


def scales(entry):
    """Return whether D cos⁴β p² is one function of tan β over p, for all hard parameters p."""
    ratio = np.geomspace(0.1, 10, 9)
    # The density of the slopes, in units of the parameter.
    densities = []
    for p in parameters(entry):
        if not 1e-3 <= p <= 1e3:
            continue
        beta = np.arctan(ratio * p)
        densities.append(entry.normalized(beta, p) * np.cos(beta) ** 4 * p**2)
    assert len(densities) > 3
    return np.allclose(densities, densities[0], rtol=TOLERANCE, atol=0)


@pytest.mark.parametrize("label", INSTANCES)
def test_scaling_with_the_slope_is_declared_where_it_holds(label):
    entry = INSTANCES[label]
    if entry.scales_with_slope:
        assert scales(entry), f"{label} declares scales_with_slope, but its slopes do not scale"
    elif not entry.equivalent:
        assert not scales(entry), f"the slopes of {label} scale: it may declare scales_with_slope"


@pytest.mark.parametrize("name", ENTRIES)
def test_operations_are_those_of_the_printed_form(name):
    entry = ENTRIES[name]
    # A power that is whole by chance would be cheaper.
    typical = [parameter.typical_value for parameter in entry.parameters]
    counted = operations_of(entry.printed.unit, *typical)
    assert entry.operations == counted, (
        f"{name} declares {entry.operations} operations, its printed unit form takes {counted}"
    )


@pytest.fixture
def registry(monkeypatch):
    rooms = mdfconv.distributions
    monkeypatch.setattr(rooms, "_REGISTRY", copy.deepcopy(rooms._REGISTRY))


class Newcomer(BlinnPhong):
    name = "newcomer"
    aliases = ()


class FalseScale(Newcomer):
    scales_with_slope = True


class OffAxis(Beckmann):
    name = "off-axis"
    aliases = ()

    def _off_axis_maximum(self, parameter):
        return None


@pytest.mark.usefixtures("registry")
def test_a_false_declaration_is_refused_by_register():
    with pytest.raises(
        MdfconvError, match="newcomer declares scales_with_slope, but where tan β ="
    ):
        register(FalseScale())
    with pytest.raises(
        MdfconvError, match=r"unit form of off-axis is 1\.057\d* at β = .* m_B = 0\.8"
    ):
        register(OffAxis())
    register(Newcomer())
    assert distribution("newcomer").name == "newcomer"


def test_what_registers_alone_is_true_of_the_registry():
    for entry in INSTANCES.values():
        entry.check_declarations()


def test_gamma_can_be_named():
    gtr = distribution("gtr", gamma=1.4)
    assert (gtr.gamma, gtr) == (1.4, distribution("gtr").with_gamma(1.4))
    with pytest.raises(MdfconvError, match="ggx has one parameter and no γ"):
        distribution("ggx", gamma=2)
    with pytest.raises(MdfconvError, match="outside the legal range"):
        distribution("gtr", gamma=0)


def test_distributions_are_values():
    gtr = distribution("gtr")
    assert repr(gtr.with_gamma(3)) == "distribution('gtr', gamma=3.0)"
    assert repr(distribution("ggx")) == "distribution('ggx')"
    assert eval(repr(gtr.with_gamma(3)), {"distribution": distribution}) == gtr.with_gamma(3)
    assert gtr.with_gamma(3) == gtr.with_gamma(3) != gtr
    assert gtr.with_gamma(2) != distribution("ggx") != "ggx"
    assert len({gtr, gtr.with_gamma(2), gtr.with_gamma(3), gtr.with_gamma(3.0)}) == 2
    shaped = gtr.with_gammas(np.array([1.0, 2.0]))
    assert shaped == gtr.with_gammas(np.array([1.0, 2.0])) != gtr
