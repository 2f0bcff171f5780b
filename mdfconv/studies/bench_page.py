"""The measurements of speed against error for people: tables in few digits, a page, a figure."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import cycle, groupby, product
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.output.figures import encoded, line_style, new_figure
from mdfconv.output.records import markdown_text
from mdfconv.recommend import DECIMALS, NUMPY, SHADER, front, unbeaten, use_text
from mdfconv.studies.bench import LOOP, PLAIN_LOOP, PRECISIONS, Measurements, Row
from mdfconv.studies.pages import fill
from mdfconv.timing import NOISE, Spread

TITLES = {
    "substitutes": "Distributions as substitutes",
    "methods": "Conversion methods",
    "kernels": "Kernels",
}
# What kernels are held to, as the columns of their table name it.
_RIVALS = {"drjit": "Dr.Jit", "textbook": "textbook", "copy": "copy"}
# What the picture shows, in it and on the page.
CAPTION = (
    "Cost against error, both better when smaller: a line joins what nothing is both cheaper and "
    "nearer than, and recommend takes the leftmost distribution on it within the tolerance."
)


def tables(measurements: Measurements) -> dict[str, list[Row]]:
    """Return the tables by name, in rounded cells, a median with its quartiles in one."""
    measured = measurements.tables
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
            "unbeaten": use_text([use for use in (SHADER, NUMPY) if number in fronts[use]]),
        }
        for group, fronts in _judged(measurements)
        for number, row in enumerate(group)
    ]
    methods = [
        {
            "method": row["method"],
            "metric": row["metric"],
            "values": row["values"],
            "ns a value": _times(_nanoseconds(row)),
            f"× {LOOP}": _rounded(row["over_loop"]),
            f"× {PLAIN_LOOP}": _rounded(row["over_plain_loop"]),
            "parameter error": _rounded(row["parameter_error"]),
            "largest": _rounded(row["parameter_error_max"]),
            "RMSE": _rounded(row["rmse"]),
            "largest RMSE": _rounded(row["rmse_max"]),
            "answered": f"{100 * row['answered']:.3g} %",
        }
        for row in measured["methods"]
    ]
    rivals = {key: name for key, name in _RIVALS.items() if _timed(measured["kernels"], key)}
    kernels = [
        {
            "distribution": row["distribution"],
            "type": row["precision"],
            "kernel ns": _times(row["kernel_ns"]),
            **{f"kernel / {rivals[key]}": _cell(row, f"per_{key}", _rounded) for key in rivals},
            **{f"{rivals[key]} ns": _cell(row, f"{key}_ns", _times) for key in rivals},
        }
        for row in measured["kernels"]
    ]
    return {"substitutes": substitutes, "methods": methods, "kernels": kernels}


def _judged(measurements: Measurements) -> Iterator[tuple[list[Row], dict[str, list[int]]]]:
    """Yield the substitutes of each reference, and which of them are unbeaten for each use."""
    by_reference = itemgetter("reference", "reference_parameter")
    for _, group in groupby(measurements.tables["substitutes"], by_reference):
        rows = list(group)
        costs = [(row["ns_float32"].median, row["operations"], row["max_error"]) for row in rows]
        yield rows, {use: unbeaten(costs, use) for use in (SHADER, NUMPY)}


def _timed(kernels: Sequence[Row], rival: str) -> list[Row]:
    """Return the kernels that were timed against a rival."""
    return [row for row in kernels if f"per_{rival}" in row]


def _cell(row: Row, column: str, form: Callable[[Any], Any]) -> Any:
    return form(row[column]) if column in row else ""


def title(measurements: Measurements, name: str) -> str:
    """Return the heading of a table."""
    return TITLES[name] + (f", {_pair(measurements)}" if name == "methods" else "")


def _pair(measurements: Measurements) -> str:
    return "{from} → {to}".format_map(measurements.tables["methods"][0])


def markdown_page(measurements: Measurements, picture: str | None = None) -> str:
    """Return the measurements as a Markdown page, which shows a picture if one is named."""
    methods, kernels = measurements.tables["methods"], measurements.tables["kernels"]
    fits = [row for row in methods if row["method"] == "fit"]
    loops = [row for row in methods if row["method"] == LOOP]
    (plain,) = [row for row in methods if row["method"] == PLAIN_LOOP]
    formulas = [row for row in methods if row["method"] not in ("fit", LOOP, PLAIN_LOOP)]
    quickest = max(formulas, key=lambda row: row["per_second"].median)
    compiled = ""
    if _timed(kernels, "drjit"):
        compiled = (
            f"\n  They take {_share(kernels, 'drjit', 'float32')} as long in float32 and "
            f"{_share(kernels, 'drjit', 'float64')} in float64 as Dr.Jit does,\n"
            "  which compiles those expressions."
        )
    shown = f"![Error against cost, distributions and methods]({picture})" if picture else ""
    return fill(
        "speed-error",
        gain=_range([row["over_loop"] for row in fits]),
        plain_gain=_range([row["over_plain_loop"] for row in fits]),
        loop_error=max(row["parameter_error_max"] for row in loops),
        plain_error=plain["parameter_error_max"],
        quickest=quickest,
        per_second=_rounded(quickest["per_second"].median, 2),
        share={one: _share(kernels, "textbook", one) for one in PRECISIONS},
        compiled=compiled,
        noise=NOISE,
        machine=measurements.machine,
        sizes=vars(measurements.sizes),
        picture=f"{shown}\n\n{CAPTION}\n\n" if picture else "",
        pair=_pair(measurements),
        **{name: markdown_text(list(rows[0]), rows) for name, rows in tables(measurements).items()},
    )


def _share(kernels: Sequence[Row], rival: str, precision: str) -> str:
    """Return how many times as long as a rival the kernels of a precision take."""
    rows = [row for row in _timed(kernels, rival) if row["precision"] == precision]
    return f"{_range([row[f'per_{rival}'] for row in rows])} times"


def _range(values: Sequence[float]) -> str:
    return f"{min(values):.2g} to {max(values):.2g}"


def _rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


def _times(times: Spread) -> str:
    median, low, high = (f"{ns:#.3g}" if ns < 100 else f"{_rounded(ns):,.0f}" for ns in times)
    return f"{median} ({low}–{high})"


def _nanoseconds(row: Row) -> Spread:
    """Return the time of a value, from the values a second."""
    median, low, high = (1e9 / value for value in row["per_second"])
    return Spread(median, high, low)


_WIDTH, _HEIGHT, _LEAST_HEIGHT = 14.0, 3.6, 4.8  # inches; the second is that of a reference
_DPI = 120
# Metrics are told apart by colour, marker and line, distributions by their colours and labels.
_METRIC_STYLES = (
    ("#0072B2", "o", "-"), ("#D55E00", "s", "--"), ("#009E73", "^", ":"), ("#CC79A7", "D", "-."),
    ("#000000", "v", (0, (6, 2, 1, 2))), ("#E69F00", "P", (0, (1, 3))),
)  # fmt: skip
_ROUNDING = 1e-12  # smaller errors are none
# Of labels and markers, in points: their sizes, how far labels are apart at least, and how far from
# its point one may be.
_LABEL_SIZE, _MARKER_SIZE, _APART = 8, 5, 2
_DISTANCES = (0, 4, 9, 15, 22, 30, 40, 52, 66, 82, 100, 120)
# To the right first, then more and more away from it, up before down.
_DIRECTIONS = [
    np.array([np.cos(angle), side * np.sin(angle)])
    for angle in np.linspace(0, np.pi, 13)
    for side in (1, -1)
]


class _Point(NamedTuple):
    label: str
    cost: Spread
    error: float
    color: str
    marker: str


def draw(measurements: Measurements) -> bytes:
    """Return a PNG of error against cost, of distributions and of methods.

    Low and left is better. What has no error to show is left out.
    """
    return encoded(figure_of(measurements), dpi=_DPI)


def figure_of(measurements: Measurements) -> Any:
    """Return the figure: a row of panels for each reference, and one for the methods."""
    judged = list(_judged(measurements))
    figure = new_figure(_WIDTH, max(_LEAST_HEIGHT, _HEIGHT * len(judged)))
    figure.set_dpi(_DPI)
    figure.suptitle(CAPTION)
    grid = figure.add_gridspec(len(judged), 3, width_ratios=(1, 1, 1.2))
    panels = {}
    for (number, (rows, fronts)), use in product(enumerate(judged), (SHADER, NUMPY)):
        axes = figure.add_subplot(grid[number, use == NUMPY])
        panels[axes] = _draw_substitutes(axes, rows, use, fronts[use])
    axes = figure.add_subplot(grid[:, 2])
    panels[axes] = _draw_methods(axes, measurements.tables["methods"])
    axes.set_title(title(measurements, "methods"))
    for axes, points in panels.items():
        for point in points:
            median, low, high = point.cost
            quartiles = {"xerr": [[median - low], [high - median]], "elinewidth": 0.8}
            style = {"fmt": point.marker, "color": point.color, "markersize": _MARKER_SIZE}
            axes.errorbar(median, point.error, **style, **quartiles)
        _scale(axes, points)
    # Where there is room is known once everything else has its place, which it keeps.
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes, points in panels.items():
        _label(axes, points)
    return figure


def _draw_substitutes(
    axes: Any, rows: Sequence[Row], use: str, unbeaten_rows: Sequence[int]
) -> list[_Point]:
    """Draw the distributions in the place of one reference, by their cost for a use."""
    points = []
    for row in rows:
        name, color = row["distribution"], line_style(row["distribution"])["color"]
        error = round(row["max_error"], DECIMALS)
        points.append(_Point(name, _cost(row, use), error, color, "o"))
    _join(axes, [points[number] for number in unbeaten_rows], "0.6", "-")
    whose, programs = "{reference} {reference_parameter:.4g}".format_map(rows[0]), _PROGRAMS[use]
    axes.set(title=f"In the place of {whose}, for {programs[0]}", xlabel=programs[1])
    axes.set_ylabel("maximum error of the best fit, unit form")
    return points


_PROGRAMS = {
    SHADER: ("a shader", "operations of an evaluation"),
    NUMPY: ("NumPy", "time of an evaluation, float32 [ns]"),
}


def _cost(row: Row, use: str) -> Spread:
    cost: Spread = row["ns_float32"]
    return cost if use == NUMPY else Spread(*[float(row["operations"])] * 3)


def _draw_methods(axes: Any, rows: Sequence[Row]) -> list[_Point]:
    """Draw the methods and the loops beside them by the time of a value, a colour a metric."""
    drawn = []
    metrics = dict.fromkeys(row["metric"] for row in rows)
    for metric, (color, marker, line) in zip(metrics, cycle(_METRIC_STYLES)):
        points = [
            _Point(row["method"], _nanoseconds(row), row["parameter_error"], color, marker)
            for row in rows
            if row["metric"] == metric
        ]
        costs = [(point.cost.median, point.error) for point in points]
        _join(axes, [points[index] for index in front(costs, NOISE)], color, line, marker, metric)
        drawn += points
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=4, title="metric")
    axes.set(xlabel="time of a value [ns]", ylabel="median error of the parameter against fit")
    return drawn


def _join(
    axes: Any, points: Sequence[_Point], color: str, line: Any, marker: str = "", label: str = ""
) -> None:
    """Join the points of a front, right and then down."""
    costs = [point.cost.median for point in points for _ in range(2)][1:]
    errors = [point.error for point in points for _ in range(2)][:-1]
    style = {"color": color, "linestyle": line, "linewidth": 1.0, "zorder": 1.5}
    marks = {"marker": marker, "markevery": 2, "markersize": _MARKER_SIZE}
    axes.plot(costs, errors, label=label, **style, **marks)


def _scale(axes: Any, points: Sequence[_Point]) -> None:
    """Scale both axes by logarithms, except errors below the smallest, so that 0 is shown."""
    from matplotlib.ticker import LogLocator

    smallest = min((point.error for point in points if point.error > _ROUNDING), default=1.0)
    axes.set_xscale("log")
    axes.set_yscale("symlog", linthresh=smallest)
    axes.margins(x=0.15, y=0.15)
    axes.set_ylim(bottom=-0.4 * smallest)
    low, high = axes.get_xlim()
    if high < 1000 * low:
        # So few powers of ten that one cannot read between them.
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter("")


def _label(axes: Any, points: Sequence[_Point]) -> None:
    """Write the label of each point as near to it as there is room, and lead from one to the other.

    Labels cover neither each other nor markers, quartiles, lines and leaders.
    """
    from matplotlib.text import Text

    shown = [point for point in points if np.isfinite(point.error)]
    places = np.reshape([(point.cost.median, point.error) for point in shown], (-1, 2))
    room = _Room(axes, axes.transData.transform(places))
    for number, point in enumerate(shown):
        text = axes.annotate(
            point.label, (point.cost.median, point.error), (0, 0), textcoords="offset points",
            ha="center", va="center", fontsize=_LABEL_SIZE, color=point.color, in_layout=False,
            arrowprops={"arrowstyle": "-", "color": "0.5", "linewidth": 0.5, "shrinkB": 0},
        )  # fmt: skip
        offset, distance = room.take(number, np.array(Text.get_window_extent(text).size))
        text.set_position(offset)
        text.arrow_patch.set_visible(distance > 0)


class _Room:
    """What is drawn in axes, in pixels: points at their centers, their quartiles, and lines."""

    def __init__(self, axes: Any, centers: Array) -> None:
        from matplotlib.transforms import Bbox

        self.inside, self.centers = axes.bbox, centers
        self.point_size = axes.figure.dpi / 72
        self.reach = (_MARKER_SIZE / 2 + 1) * self.point_size
        self.markers = [Bbox([center - self.reach, center + self.reach]) for center in centers]
        quartiles = [path for bars in axes.collections for path in bars.get_paths()]
        drawn = [*quartiles, *(line.get_path() for line in axes.lines)]
        self.lines = [axes.transData.transform_path(path) for path in drawn]
        self.labels: list[Any] = []

    def take(self, number: int, size: Array) -> tuple[Array, int]:
        """Take room for the label of a point; return its offset and its distance, in points."""
        from matplotlib.path import Path
        from matplotlib.transforms import Bbox

        center, half = self.centers[number], (size + _APART * self.point_size) / 2
        fewest: float = np.inf
        for distance, direction in product(_DISTANCES, _DIRECTIONS):
            place = center + direction * (half + self.reach + distance * self.point_size)
            box, leader = Bbox([place - half, place + half]), Path([center, place])
            found = self._covered(number, box, leader)
            if found < fewest:
                fewest, best = found, (place, distance, box, leader)
            if not found:
                break
        place, distance, box, leader = best
        self.labels.append(box)
        self.lines.append(leader)
        return (place - center) / self.point_size, distance

    def _covered(self, number: int, box: Any, leader: Any) -> int:
        """Return how much a label of a point, and the line that leads to it, would cover."""
        outside = sum(not self.inside.contains(*corner) for corner in box.get_points())
        under = sum(line.intersects_bbox(box, filled=False) for line in self.lines)
        own = self.markers[number]
        apart = [marker for marker in self.markers if not marker.overlaps(own)]
        crossed = sum(leader.intersects_bbox(one, filled=False) for one in apart + self.labels)
        return outside + under + crossed + box.count_overlaps(self.markers + self.labels)
