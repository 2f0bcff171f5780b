"""The measurements of speed against error for people: tables in few digits, a page, a figure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import cycle, groupby
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from mdfconv.output.figures import encoded, line_style, new_figure
from mdfconv.output.records import markdown_text
from mdfconv.studies.bench import LOOP, PRECISIONS, Measurements, Row
from mdfconv.studies.pages import fill
from mdfconv.timing import NOISE, Spread

TITLES = {
    "substitutes": "Distributions as substitutes",
    "methods": "Conversion methods",
    "kernels": "Kernels",
}


def tables(measurements: Measurements) -> dict[str, list[Row]]:
    """Return the tables by name, in rounded cells, a median with its quartiles in one."""
    measured = measurements.tables
    by_reference = itemgetter("reference", "reference_parameter")
    substitutes = [
        {
            "reference": f"{row['reference']} {row['reference_parameter']:g}",
            "distribution": row["distribution"],
            "parameter": _rounded(row["parameter"], 5),
            "operations": row["operations"],
            "float32 ns": _times(row["ns_float32"]),
            "float64 ns": _times(row["ns_float64"]),
            "RMSE": _rounded(row["rmse"]),
            "max error": _rounded(row["max_error"]),
            "energy error": _rounded(row["energy_error"]),
            "unbeaten": unbeaten,
        }
        for _, group in groupby(measured["substitutes"], by_reference)
        for row, unbeaten in _judged(list(group))
    ]
    methods = [
        {
            "method": row["method"],
            "metric": row["metric"],
            "values": row["values"],
            "ns a value": _times(_nanoseconds(row)),
            "values per second": f"{_rounded(row['per_second'].median):,.0f}",
            "parameter error": _rounded(row["parameter_error"]),
            "largest": _rounded(row["parameter_error_max"]),
            "RMSE": _rounded(row["rmse"]),
            "largest RMSE": _rounded(row["rmse_max"]),
            "answered": f"{100 * row['answered']:.3g} %",
        }
        for row in measured["methods"]
    ]
    kernels = [
        {
            "distribution": row["distribution"],
            "type": row["precision"],
            "kernel ns": _times(row["kernel_ns"]),
            "textbook ns": _times(row["textbook_ns"]),
            "textbook / kernel": _rounded(row["speedup"]),
            "Dr.Jit ns": _times(row["drjit_ns"]) if "drjit_ns" in row else "",
        }
        for row in measured["kernels"]
    ]
    return {"substitutes": substitutes, "methods": methods, "kernels": kernels}


def title(measurements: Measurements, name: str) -> str:
    """Return the heading of a table."""
    return TITLES[name] + (f", {_pair(measurements)}" if name == "methods" else "")


def _pair(measurements: Measurements) -> str:
    return "{from} → {to}".format_map(measurements.tables["methods"][0])


def markdown_page(measurements: Measurements, picture: str | None = None) -> str:
    """Return the measurements as a Markdown page, which shows a picture if one is named."""
    methods = measurements.tables["methods"]
    speeds = {(row["method"], row["metric"]): row["per_second"].median for row in methods}
    gains = [
        speed / speeds[LOOP, metric]
        for (method, metric), speed in speeds.items()
        if method == "fit"
    ]
    formulas = [row for row in methods if row["method"] not in ("fit", LOOP)]
    quickest = max(formulas, key=lambda row: row["per_second"].median)
    kernels = measurements.tables["kernels"]
    shares = {
        precision: [1 / row["speedup"] for row in kernels if row["precision"] == precision]
        for precision in PRECISIONS
    }
    shown = f"![Error against time, distributions and methods]({picture})\n\n" if picture else ""
    return fill(
        "speed-error",
        least_gain=min(gains),
        most_gain=max(gains),
        loop_error=max(row["parameter_error_max"] for row in methods if row["method"] == LOOP),
        quickest=quickest,
        per_second=_rounded(quickest["per_second"].median, 2),
        least_share={name: min(values) for name, values in shares.items()},
        most_share={name: max(values) for name, values in shares.items()},
        machine=measurements.machine,
        sizes=vars(measurements.sizes),
        picture=shown,
        pair=_pair(measurements),
        **{name: markdown_text(list(rows[0]), rows) for name, rows in tables(measurements).items()},
    )


def _judged(rows: Sequence[Row]) -> list[tuple[Row, bool]]:
    """Return substitutes with whether none is both quicker, beyond noise, and nearer."""
    unbeaten = front([(row["ns_float32"].median, row["rmse"]) for row in rows], NOISE)
    return [(row, number in unbeaten) for number, row in enumerate(rows)]


def front(points: Sequence[tuple[float, float]], tie: float = 0.0) -> list[int]:
    """Return which points are the Pareto front of two costs, the first cost rising.

    First costs count as equal if one exceeds the other by at most the share `tie`. Of equal
    points the first is on the front; a point with NaN never is.

    Examples
    --------
    >>> front([(3.0, 0.0), (1.0, 0.2), (2.0, 0.3), (1.0, 0.2)])
    [1, 0]
    """
    indices: list[int] = []
    lowest = float("inf")
    comparable = [index for index, point in enumerate(points) if not np.isnan(point[0])]
    for index in sorted(comparable, key=lambda index: points[index]):
        cost, error = points[index]
        if error < lowest:
            lowest = error
            while indices and cost <= (1 + tie) * points[indices[-1]][0]:
                indices.pop()
            indices.append(index)
    return indices


def _rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


def _times(times: Spread) -> str:
    median, low, high = (f"{ns:#.3g}" if ns < 100 else f"{_rounded(ns):,.0f}" for ns in times)
    return f"{median} ({low}–{high})"


def _nanoseconds(row: Row) -> Spread:
    """Return the time of a value, from the values a second."""
    median, low, high = (1e9 / value for value in row["per_second"])
    return Spread(median, high, low)


_SIZE = (11.0, 6.5)  # inches
_MARKERS = "osD^vPX*<>hp"
# Tell apart variants of one name: parameters of the reference, metrics of a method.
_FILLS = ("full", "none", "left", "top", "right", "bottom")
_FRONTS = ("-", "--", ":", "-.")
_COLORS = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_ROUNDING = 1e-12  # smaller errors are none


class _Point(NamedTuple):
    name: str
    variant: str
    nanoseconds: Spread
    error: float


def draw(measurements: Measurements, dpi: int = 120) -> bytes:
    """Return a PNG of error against time, of distributions and of methods.

    Low and left is better. What has no error to show is left out.
    """
    figure = new_figure(*_SIZE)
    # Not before `new_figure` has prepared Matplotlib.
    from matplotlib.ticker import LogLocator

    left, right = figure.subplots(1, 2)
    variant = "for {reference} {reference_parameter:.4g}".format_map
    substitutes = [
        _Point(row["distribution"], variant(row), row["ns_float32"], row["rmse"])
        for row in measurements.tables["substitutes"]
    ]
    methods = [
        _Point(row["method"], f"metric {row['metric']}", _nanoseconds(row), row["parameter_error"])
        for row in measurements.tables["methods"]
    ]
    names = dict.fromkeys(point.name for point in methods)
    _draw_panel(left, substitutes, {p.name: line_style(p.name)["color"] for p in substitutes})
    _draw_panel(right, methods, dict(zip(names, cycle(_COLORS), strict=False)))
    left.set(title=TITLES["substitutes"], xlabel="time of an evaluation, float32 [ns]")
    left.set_ylabel("RMSE of the best fit, unit form")
    # So few powers of ten that one cannot read between them.
    left.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    left.xaxis.set_major_formatter("{x:g}")
    left.xaxis.set_minor_formatter("")
    right.set(title=title(measurements, "methods"), xlabel="time of a conversion [ns]")
    right.set_ylabel("median relative error of the parameter against fit")
    return encoded(figure, dpi=dpi)


def _draw_panel(axes: Any, points: Iterable[_Point], colors: dict[str, str]) -> None:
    """Draw points with their quartiles, the Pareto front of each variant, and a legend."""
    points = [point for point in points if np.isfinite(point.error)]
    shapes = dict(zip(colors, cycle(_MARKERS), strict=False))
    variants = dict.fromkeys(point.variant for point in points)
    named: set[str] = set()
    for variant, filling, line in zip(variants, cycle(_FILLS), cycle(_FRONTS), strict=False):
        own = [point for point in points if point.variant == variant]
        style = {"fillstyle": filling, "markerfacecoloralt": "white"}
        costs = [(point.nanoseconds.median, point.error) for point in own]
        corners = zip(*(costs[index] for index in front(costs, NOISE)), strict=True)
        axes.step(
            *corners, where="post", marker="o", color="0.55", linestyle=line, label=variant, **style
        )
        for point in own:
            median, low, high = point.nanoseconds
            quartiles = {"xerr": [[median - low], [high - median]], "elinewidth": 0.8}
            label = None if point.name in named else point.name
            marked = style | {"marker": shapes[point.name], "color": colors[point.name]}
            axes.errorbar(median, point.error, label=label, linestyle="", **quartiles, **marked)
            named.add(point.name)
    caption = "lines: what nothing is both quicker and nearer than"
    below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.13), "ncols": 3}
    axes.legend(title=caption, fontsize=8, title_fontsize=8, **below)
    # Linear below the smallest error, so that an error of 0 is shown.
    smallest = min((point.error for point in points if point.error > _ROUNDING), default=1.0)
    axes.set_yscale("symlog", linthresh=smallest)
    axes.set_ylim(bottom=-0.2 * smallest)
    axes.set_xscale("log")
