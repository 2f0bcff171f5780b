"""The environment metric's conversions of smooth surfaces: one constant a pair.

The lobe of a smooth surface is a function of tan β over a width, whatever the distribution, and
under the metric widths convert by one constant (`mdfconv.fitting.metrics.base`). A width
is the parameter itself, or the inverse root of a parameter that is an exponent.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

from mdfconv.distributions import Distribution, one_parameter_distributions
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.solve import fit
from mdfconv.studies.bench import as_wide

# Beckmann's m_B for lobes of the same half width. Schlick's form nears its limit in proportion
# to m_B, the others to its square.
SMOOTH = 1e-6
ROUGH = 0.4
# p_source^k, by k.
_TERMS = {1.0: "{} {}", -2.0: "{} / {}²", -0.5: "{} / √{}"}


@dataclass(frozen=True)
class SmoothConstant:
    """The law p_target = c p_source^k of a smooth surface.

    Parameters
    ----------
    source, target : Distribution
        The pair.
    constant, power : float
        c and k.
    exact : bool
        Whether the law holds for every roughness.
    deviation : float
        The best fit over what the law says, less 1, for a source as wide as Beckmann's lobe of
        m_B = `ROUGH`.
    """

    source: Distribution
    target: Distribution
    constant: float
    power: float
    exact: bool
    deviation: float

    @property
    def law(self) -> str:
        """The right-hand side in the source's symbol, such as ``"2.00000 / m_B²"``."""
        return _TERMS[self.power].format(f"{self.constant:.5f}", self.source.parameter.symbol)


def smooth_constants() -> list[SmoothConstant]:
    """Return the constants of every ordered pair of the one-parameter distributions."""
    compared = [one for one in one_parameter_distributions() if one.map_variables is not None]
    return [_constant(source, target) for source, target in permutations(compared, 2)]


def _constant(source: Distribution, target: Distribution) -> SmoothConstant:
    metric = metric_named("environment")
    parameter = as_wide([SMOOTH, ROUGH], source)
    power = _width_power(target) / _width_power(source)
    smooth, rough = fit(source, parameter, target, metric).parameter / parameter**power
    exact = metric.ratio(source, target) is not None
    return SmoothConstant(source, target, float(smooth), power, exact, float(rough / smooth - 1))


def _width_power(mdf: Distribution) -> float:
    """Return k for a parameter that grows like the k-th power of a small width."""
    return -2 if mdf.parameter.larger_is_smoother else 1
