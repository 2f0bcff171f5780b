"""The registry of distributions.

A new distribution is a module that defines ``DISTRIBUTION``, and one line in `_MODULES`.
"""

from __future__ import annotations

from importlib import import_module

from mdfconv.distributions.base import Distribution
from mdfconv.errors import MdfconvError
from mdfconv.registry import Registry

__all__ = [
    "Distribution",
    "distribution",
    "list_distributions",
    "one_parameter_distribution",
    "one_parameter_distributions",
    "register",
]

_MODULES = (
    "beckmann",
    "gauss",
    "ggx",
    "gtr",
    "blinn_phong",
    "ashikhmin_shirley",
    "schlick",
    "sawicki",
    "smoothie",
    "student_t",
)

_REGISTRY: Registry[Distribution] = Registry("distribution")


for _module in _MODULES:
    _mdf = import_module(f"{__name__}.{_module}").DISTRIBUTION
    _REGISTRY.add(_mdf.name, _mdf, _mdf.aliases, _mdf.meant_by)


def register(mdf: Distribution) -> None:
    """Add a distribution: every function and command that takes one knows it from here on.

    Parameters
    ----------
    mdf : Distribution
        An instance of a subclass, which says what it must define.

    Raises
    ------
    MdfconvError
        If its name or an alias is taken, or what it declares of its lobes does not hold.
    """
    gammas = mdf.second_parameter.typical if mdf.second_parameter else ()
    for instance in (mdf, *map(mdf.with_gamma, gammas)):
        instance.check_declarations()
    _REGISTRY.add(mdf.name, mdf, mdf.aliases, mdf.meant_by)


def list_distributions() -> tuple[Distribution, ...]:
    """Return every distribution, in the order of the documentation."""
    return tuple(_REGISTRY)


def distribution(name: str, gamma: float | None = None) -> Distribution:
    """Return the distribution with a given name or alias.

    Parameters
    ----------
    name : str
        Name or alias; case does not matter, and ``_``, ``/`` and blanks count as ``-``.
    gamma : float, optional
        The second parameter of a distribution that has one; its default if not given.

    Raises
    ------
    MdfconvError
        If the name is not known; the message offers the nearest ones. Also if it is that of a
        stored form, such as ``"ggx:roughness"``, or γ is illegal or there is none.

    Examples
    --------
    >>> distribution("Trowbridge_Reitz").name
    'ggx'
    >>> distribution("gtr", gamma=1.4)
    distribution('gtr', gamma=1.4)
    """
    if isinstance(name, str) and ":" in name:
        owner = _REGISTRY[name.partition(":")[0]].name
        raise MdfconvError(
            f"'{name}' is a stored form of a parameter, and here a distribution is meant",
            f"did you mean {owner}?",
        )
    mdf = _REGISTRY[name]
    return mdf if gamma is None else mdf.with_gamma(gamma)


def one_parameter_distributions() -> list[Distribution]:
    """Return every distribution that differs from the others for one parameter."""
    return [mdf for mdf in _REGISTRY if _with_one_parameter(mdf) is mdf]


def one_parameter_distribution(name: str) -> Distribution:
    """Return the distribution with a given name or alias, as for `distribution`.

    Raises
    ------
    MdfconvError
        If the name is not known, or only makes a difference for pairs of parameters.
    """
    mdf = distribution(name)
    other = _with_one_parameter(mdf)
    if other is not mdf:
        raise MdfconvError(f"with one parameter {mdf.name} is {other.name}", "name that")
    return mdf


def _with_one_parameter(mdf: Distribution) -> Distribution:
    """Return what a distribution is for one parameter: itself, unless pairs are its point."""
    equal = mdf.equivalent
    if equal and equal.same_lobe and equal.same_parameter and not mdf.second_parameter:
        return distribution(equal.name)
    return mdf
