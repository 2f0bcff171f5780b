"""The interactive page: a source and its substitute side by side, in one file of HTML.

All numbers are computed here and interpolated there; `page.html` is the template.
"""

from __future__ import annotations

import html
import json
from importlib.resources import files
from typing import Any

from mdfconv import __version__
from mdfconv.distributions.endpoint import Endpoint
from mdfconv.errors import MdfconvError
from mdfconv.output.files import file_bytes
from mdfconv.render.comparison_figure import BACKGROUND
from mdfconv.render.page_lights import curves, environment, lights
from mdfconv.render.page_tables import conversions, encodings, lobes
from mdfconv.render.sphere import MARGIN, VIEW

_TEMPLATE = "page.html"
_TITLE, _DATA = "@title@", "@data@"


def comparison_page(source: Endpoint, target: Endpoint, start: float | None = None) -> bytes:
    """Return the page that compares a distribution with another in its place.

    Parameters
    ----------
    source : Endpoint
        The distribution that is converted. The page shows its parameter itself.
    target : Endpoint
        What it is converted to, in the form that the page shows first.
    start : float, optional
        What the page shows first, in the form in which the source stores it; the typical
        parameter if not given.

    Raises
    ------
    MdfconvError
        If the start is illegal or outside the typical range, or there is no conversion.
    """
    parameter = None if start is None else source.decode_one(start)
    return filled(page_data(Endpoint(source.distribution), target, parameter))


def page_data(source: Endpoint, target: Endpoint, start: float | None = None) -> dict[str, Any]:
    """Return all that the page shows, as JSON takes it; as `comparison_page`."""
    first, last = source.distribution, target.distribution
    low, high = first.parameter.typical
    start = first.parameter.typical_value if start is None else start
    if not low <= start <= high:
        raise MdfconvError(
            f"the page shows {first.parameter.symbol} from {low:g} to {high:g}, not {start:g}"
        )
    tables, span, error = conversions(first, last)
    return {
        "title": f"{last.label} in place of {first.label}",
        "version": __version__,
        "source": _end(source) | {"start": float(start)} | lobes(first, low, high),
        "target": _end(target) | lobes(last, *span),
        "metrics": tables,
        "interpolation": float(f"{error:.2g}"),
        "encodings": encodings(last, *span),
        "lights": lights(first),
        "environment": environment(),
        "curves": curves(),
        "margin": MARGIN,
        "background": BACKGROUND,
        "view": VIEW.tolist(),
    }


def _end(end: Endpoint) -> dict[str, Any]:
    mdf = end.distribution
    return {
        "name": mdf.name,
        "form": end.label,
        "label": mdf.label,
        "symbol": mdf.parameter.symbol,
        "parameter": mdf.parameter.name,
    }


def filled(data: dict[str, Any]) -> bytes:
    """Return the template with its title and data, in which no text is taken for a tag."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    template = files(__package__).joinpath(_TEMPLATE).read_text(encoding="utf-8")
    page = template.replace(_TITLE, html.escape(data["title"]))
    return file_bytes(page.replace(_DATA, text.replace("<", "\\u003c")).rstrip())
