"""Names of distributions, as the commands take them."""

from __future__ import annotations

from collections.abc import Sequence

from mdfconv.distributions import Distribution, distribution, list_distributions
from mdfconv.errors import MdfconvError

# With one parameter it is blinn-phong.
_PAIRS_ONLY = "ashikhmin-shirley"


def one_parameter_distributions() -> list[Distribution]:
    """Return every distribution that differs from the others for one parameter."""
    return [entry for entry in list_distributions() if entry.name != _PAIRS_ONLY]


def one_parameter_names(names: Sequence[str]) -> list[str]:
    """Return the proper names for names or aliases, each once.

    Raises
    ------
    MdfconvError
        If a name is unknown, or only makes a difference for pairs of parameters.
    """
    found = list(dict.fromkeys(distribution(name).name for name in names))
    if _PAIRS_ONLY in found:
        raise MdfconvError(f"with one parameter {_PAIRS_ONLY} is blinn-phong: name that")
    return found
