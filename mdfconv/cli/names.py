"""The distributions that options name, and results in the forms in which they were asked for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mdfconv.cli.process import tell

if TYPE_CHECKING:
    from mdfconv.distributions.endpoint import Endpoint


def noted(end: Endpoint) -> Endpoint:
    """Return what an option names; what to know of the name goes to standard error, once."""
    if end.caution:
        tell(f"note: {end.caution}")
    return replace(end, caution="")


def asked_endpoint(name: str) -> Endpoint:
    """Return the distribution of one parameter, and its form, that an option names.

    Raises
    ------
    MdfconvError
        As `one_parameter_endpoint`.
    """
    from mdfconv.distributions.endpoint import one_parameter_endpoint

    return noted(one_parameter_endpoint(name))


def in_asked_forms(
    rows: Iterable[dict[str, Any]], ends: Sequence[Endpoint]
) -> list[dict[str, Any]]:
    """Return rows of results with each parameter, and its error, in the forms asked for.

    Parameters
    ----------
    rows : iterable of dict
        Each with a ``distribution`` by name, its ``parameter``, and perhaps the ``stderr``.
    ends : sequence of Endpoint
        What was asked for; a distribution that is not among them stays as it is.
    """
    found = []
    for row in rows:
        asked = [end for end in ends if end.distribution.name == row["distribution"]]
        found += [row | _stored(row, end) for end in asked] or [row]
    return found


def _stored(row: dict[str, Any], end: Endpoint) -> dict[str, Any]:
    if end.encoding is None or row["parameter"] is None:
        return {}
    value, slope = end.encode_one(row["parameter"])
    stored: dict[str, Any] = {"distribution": end.label, "parameter": value}
    if row.get("stderr") is not None:
        stored["stderr"] = None if slope is None else slope * row["stderr"]
    return stored
