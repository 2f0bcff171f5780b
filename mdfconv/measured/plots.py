"""Plots of a fit as SVG in a page of HTML, whose style has the colours, also in the dark."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.measured.panels import SUBSCRIPT, AnyPanel, Curve, Disc, Panel
from mdfconv.output.records import power_of_ten

# A plot fills a telephone; a wider page makes it larger, and its text less so.
_WIDTH = 360
HEIGHT = 220
# Two low ones stand beside a tall one.
TALL_HEIGHT, LOW_HEIGHT = 336, 168
_LEFT, _RIGHT, _TOP, _BOTTOM = 46, 350, 20, 34
# Room of the text of a label, and of one line.
_LETTER, _LINE = 7.0, 12.0
# Of a curve; what is nearer to a straight line is one.
_TOLERANCE = 0.15
# Width and height of a sketch.
_SKETCH = (96, 32)
# Steps of an axis, of which one is a power of ten times as large.
_STEPS = (1.0, 2.0, 5.0, 10.0)
# Colours of residuals, an odd number.
_SHADES = 9
# A disc and the scale of colours, which stand beside each other.
_DISC_WIDTH, _DISC_HEIGHT, _RADIUS = 176, 188, 80
_SCALE_HEIGHT = 40


def drawn(panel: AnyPanel, height: int = HEIGHT) -> str:
    """Return a plot, or discs, as elements of a page."""
    if isinstance(panel, Panel):
        return _svg(panel.title, _WIDTH, height, _plot(panel, height))
    discs = (
        _svg(disc.label, _DISC_WIDTH, _DISC_HEIGHT, _disc(disc, panel.limit))
        for disc in panel.discs
    )
    scale = _svg("ln(fit/data)", _DISC_WIDTH, _SCALE_HEIGHT, _shade_scale(panel.limit))
    return f'<div class="discs">{chr(10).join((*discs, scale))}</div>'


def sketch(panel: AnyPanel) -> str:
    """Return the lines of a plot without axes, small enough for a table."""
    if not isinstance(panel, Panel):
        return ""
    to_x = _scale(panel.x_range, (0, _SKETCH[0]))
    to_y = _scale(panel.y_range, (_SKETCH[1], 0), logarithmic=panel.logarithmic)
    lines = (curve for curve in panel.curves if curve.kind == "line")
    parts = (_drawn(curve, to_x(curve.x), to_y, panel.y_range) for curve in lines)
    return _svg(panel.title, *_SKETCH, parts)


def _svg(title: str, width: int, height: int, parts: Iterator[str]) -> str:
    """Return an element of a page, whose units are pixels on a telephone."""
    return (
        f'<svg viewBox="0 0 {width} {height}" role="img" aria-label="{html.escape(plain(title))}">'
        f"{''.join(parts)}</svg>"
    )


def plain(text: str) -> str:
    """Return text in which a character that does not print is seen as its escape."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def symbols(text: str) -> str:
    """Return text as HTML, in which the index of f_r or θ_i is a subscript."""
    return SUBSCRIPT.sub(r"\1<sub>\2</sub>\3", html.escape(plain(text)))


def ticks(low: float, high: float, most: int) -> Array:
    """Return round numbers in a range, at most so many."""
    power = 10.0 ** np.floor(np.log10((high - low) / most))
    for step in (power * factor for factor in _STEPS):
        first, last = np.ceil(low / step), np.floor(high / step)
        if last - first < most:
            break
    return np.arange(first, last + 1) * step


def decades(low: float, high: float, most: int) -> Array:
    """Return powers of ten in a range, at most so many; of a narrow one other numbers too."""
    first, last = int(np.ceil(np.log10(low) - 1e-9)), int(np.floor(np.log10(high) + 1e-9))
    if last - first >= 2:
        every = -(-(last - first + 1) // most)
        return 10.0 ** np.arange(first, last + 1, every)
    between = np.outer(10.0 ** np.arange(first - 1, last + 1), [1, 2, 5]).ravel()
    inside = between[(between >= low) & (between <= high)]
    return inside if inside.size > 2 else ticks(low, high, most)


def number(value: float) -> str:
    """Return the number at a tick."""
    if value != 0 and not 1e-3 <= abs(value) < 1e4:
        power = int(np.floor(np.log10(abs(value)) + 1e-9))
        factor = value / 10.0**power
        head = "" if abs(factor - 1) < 1e-6 else f"{factor:.3g}·"
        return f"{head}{power_of_ten(power)}"
    # Adding 0 makes 0 of −0.
    return f"{value + 0.0:.4g}".replace("-", "−")


def _plot(panel: Panel, height: int) -> Iterator[str]:
    bottom = height - _BOTTOM
    to_x = _scale(panel.x_range, (_LEFT, _RIGHT))
    to_y = _scale(panel.y_range, (bottom, _TOP), logarithmic=panel.logarithmic)
    low, high = panel.y_range
    if panel.band:
        top, base = (float(to_y(np.clip(edge, low, high))) for edge in panel.band[::-1])
        yield (
            f'<rect class="band" x="{_LEFT}" y="{top:.1f}" width="{_RIGHT - _LEFT}" '
            f'height="{base - top:.1f}"/>'
        )
    yield from _axes(panel, to_x, to_y, bottom)
    for curve in panel.curves:
        yield _drawn(curve, to_x(curve.x), to_y, panel.y_range)
    yield from _labels(panel, to_x, to_y)


def _scale(
    range_: tuple[float, float], ends: tuple[float, float], *, logarithmic: bool = False
) -> Callable[[Array], Array]:
    """Return what places a number between the ends of an axis."""
    form = np.log if logarithmic else np.asarray
    low, high = (float(form(value)) for value in range_)

    def placed(values: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(ends[0] + (form(values) - low) / (high - low) * (ends[1] - ends[0]))

    return placed


def _axes(
    panel: Panel, to_x: Callable[[Array], Array], to_y: Callable[[Array], Array], bottom: int
) -> Iterator[str]:
    most = 5 if bottom < HEIGHT else 8
    marks = decades if panel.logarithmic else ticks
    lines, texts = [], []
    for value in marks(*panel.y_range, most):
        y = float(to_y(value))
        lines.append(f"M{_LEFT} {y:.1f}H{_RIGHT}")
        texts.append(_text(_LEFT - 5, y + 4, number(value), "end"))
    for value in ticks(*panel.x_range, 9):
        x = float(to_x(value))
        lines.append(f"M{x:.1f} {_TOP}V{bottom}")
        texts.append(_text(x, bottom + 14, number(value), "middle"))
    yield f'<path class="grid" d="{"".join(lines)}"/>'
    yield f'<path class="axis" d="M{_LEFT} {_TOP}V{bottom}H{_RIGHT}"/>'
    texts.append(_text(2, 12, panel.y_label, "start"))
    texts.append(_text((_LEFT + _RIGHT) / 2, bottom + 30, panel.x_label, "middle"))
    yield "".join(texts)


def _text(x: float, y: float, text: str, anchor: str, kind: str = "") -> str:
    lowered = '<tspan class="sub" dy="3">'
    shown = SUBSCRIPT.sub(
        rf'\1{lowered}\2</tspan><tspan dy="-3">\3</tspan>', html.escape(plain(text))
    )
    of_kind = f' class="{kind}"' if kind else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{of_kind}>{shown}</text>'


def _drawn(
    curve: Curve, x: Array, to_y: Callable[[Array], Array], y_range: tuple[float, float]
) -> str:
    low, high = y_range
    y, inside = to_y(curve.y), (curve.y >= low) & (curve.y <= high)
    kind = f"{curve.kind} {_color(curve.color)}"
    if curve.kind in ("line", "dotted"):
        return f'<path class="{kind}" d="{_path(x, y, inside)}"/>'
    path = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x[inside], y[inside], strict=True))
    if curve.error is not None:
        ends = (to_y(np.clip(curve.y + side * curve.error, low, high)) for side in (-1, 1))
        bars = zip(x[inside], *(end[inside] for end in ends), strict=True)
        rods = "".join(f"M{a:.1f} {b:.1f}V{c:.1f}" for a, b, c in bars)
        return f'<path class="rods {_color(curve.color)}" d="{rods}"/>' + (
            f'<path class="{kind}" d="{path}"/>'
        )
    return f'<path class="{kind}" d="{path}"/>'


def _color(color: int | None) -> str:
    return "ink" if color is None else f"c{color}"


def _path(x: Array, y: Array, inside: NDArray[np.bool_]) -> str:
    """Return a line through points, broken where they are outside the axes."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    parts = []
    for first, last in ends.reshape(-1, 2):
        keep = first + _corners(x[first:last], y[first:last])
        points = (f"{a:.1f} {b:.1f}" for a, b in zip(x[keep], y[keep], strict=True))
        parts.append(f"M{'L'.join(points)}")
    return "".join(parts)


def _corners(x: Array, y: Array) -> Indices:
    """Return which points of a line a drawing needs (Ramer 1972, Douglas & Peucker 1973)."""
    keep = np.zeros(x.size, bool)
    keep[[0, -1]] = True
    parts = [(0, x.size - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        across, up = x[last] - x[first], y[last] - y[first]
        away = across * (y[first:last] - y[first]) - up * (x[first:last] - x[first])
        farthest = int(np.argmax(np.abs(away)))
        if abs(away[farthest]) > _TOLERANCE * np.hypot(across, up):
            keep[first + farthest] = True
            parts += [(first, first + farthest), (first + farthest, last)]
    return np.flatnonzero(keep)


def _labels(
    panel: Panel, to_x: Callable[[Array], Array], to_y: Callable[[Array], Array]
) -> Iterator[str]:
    """Yield the labels of curves above their highest points, none on another."""
    taken: list[tuple[float, float, float]] = []
    for curve in panel.curves:
        if not curve.label:
            continue
        top = int(np.argmax(np.where(curve.y <= panel.y_range[1], curve.y, -np.inf)))
        half = _LETTER * len(curve.label) / 2
        x = float(np.clip(to_x(curve.x[top]), _LEFT + half, _RIGHT - half))
        y = float(to_y(curve.y[top])) - 5
        while any(abs(x - a) < half + b and abs(y - c) < _LINE for a, b, c in taken):
            y -= _LINE / 2
        taken.append((x, half, y))
        yield _text(x, y, curve.label, "middle", f"label {_color(curve.color)}")


def _disc(disc: Disc, limit: float) -> Iterator[str]:
    x, y = _DISC_WIDTH / 2, _DISC_HEIGHT - _RADIUS - 4
    yield _text(x, y - _RADIUS - 6, disc.label, "middle")
    circles = (_RADIUS * degrees / 90 for degrees in (30, 60, 90))
    yield "".join(f'<circle class="grid" cx="{x}" cy="{y}" r="{r:.1f}"/>' for r in circles)
    shade = np.round((disc.value / limit + 1) / 2 * (_SHADES - 1))
    for value in range(_SHADES):
        some = shade == value
        points = zip(x + _RADIUS * disc.x[some], y - _RADIUS * disc.y[some], strict=True)
        path = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in points)
        if path:
            yield f'<path class="dots d{value}" d="{path}"/>'
    for degrees in (30, 60):
        yield _text(x, y + _RADIUS * degrees / 90 + 4, f"{degrees}°", "middle", "label")
    yield f'<path class="axis" d="M{x + _RADIUS * disc.mirror - 6:.1f} {y}h12m-6 -6v12"/>'


def _shade_scale(limit: float) -> Iterator[str]:
    width = 13
    left = (_DISC_WIDTH - _SHADES * width) / 2
    for value in range(_SHADES):
        yield f'<rect class="d{value}" x="{left + value * width}" width="{width}" height="8"/>'
    end = number(float(f"{limit:.2g}"))
    middle = _DISC_WIDTH / 2
    for x, text in ((left, f"−{end}"), (middle, "0"), (_DISC_WIDTH - left, end)):
        yield _text(x, 20, text, "middle")
    yield _text(middle, 36, "ln(fit/data)", "middle")
