"""The measurements for people: tables in few digits, and a page of them with what they mean."""

from __future__ import annotations

from typing import Any

from mdfconv.output.records import markdown_text
from mdfconv.studies.bench import verdicts
from mdfconv.studies.bench.measure import Measurements
from mdfconv.timing import Spread

TITLES = {
    "substitutes": "Distributions as substitutes",
    "methods": "Conversion methods",
    "scaling": "Time against count",
    "limits": "Where the limit lies",
    "kernels": "Kernels",
    "compiled": "A compiled kernel",
}
_OF_THE_PAIR = ("methods", "scaling", "limits")
_LEGENDS = {
    "substitutes": "ns: time to evaluate the unit form at one angle, from β. operations: "
    "arithmetic from cos β with the constants precomputed, a transcendental function counting "
    "10. RMSE and max error: of the best fit to the unit form, √(∫ ΔD̄² dβ / ∫ D̄_ref² dβ) and "
    "max |ΔD̄|. energy error: of the best fit to the normalized form, "
    "√(∫ ΔD² cos β dω / ∫ D_ref² cos β dω).",
    "methods": "Over lobes as wide as those of the paper's sweep. "
    "parameter error: |p/p_fit − 1|, median and maximum, against the best fit under the metric. "
    "RMSE: what the conversion leaves under the metric, relative to the source's signal. "
    "curve_fit: scipy.optimize.curve_fit called once a value, on the samples and weights that fit "
    "uses, from equal half angles. fit starts from the stored fits, and here "
    "finds each by itself: in arrays of more than 8192 most come from a curve through 4097 of "
    "them, to 1e-8, as time against count shows. cold fit: without stored fits, by a scan.",
    "scaling": "Nanoseconds a value, of one call for an array of so many values, under {metric}; "
    "empty where from the count before it was expected to take longer than {patience:g} s.",
    "limits": "ns: time of a value, as in the table of methods. unavoidable: evaluations that "
    "stand in every conversion of the kind, timed alone on arrays in the cache: for a formula one "
    "square root; for fast the longest polynomial of its map and the changes of variable around "
    "it, or one multiplication where the ratio is constant; for a fit, cold or not, and for "
    "curve_fit the signals of both distributions at the nodes of a fit that starts near the "
    "minimum; the bends of a display need more nodes, which are not counted. ×: the one over the "
    "other, of medians.",
    "kernels": "ns: time to evaluate the unit form at one angle. textbook: the printed "
    "expression in NumPy. functions: the transcendental functions that the form cannot avoid, "
    "with a copy where there are fewer than two, timed alone on whole arrays. copy: copying the "
    "array of β. ×: the kernel's time over that of the textbook, of those functions, of the copy; "
    "medians over rounds. memory: peak of newly allocated memory over the size of the result. The "
    "angles rise: beyond the end of Schlick's lobe whole blocks are skipped; in random order it "
    "takes longer.",
    "compiled": "ns: time to evaluate the unit form at one angle, from β. Dr.Jit: the same form, "
    "with one sine, compiled by its LLVM backend and run in one thread.",
}
_CHOOSING = """\
## Choosing

- A distribution costs a nanosecond or a few; what it gets wrong stays in every picture. Choose \
by the error first, and by the time only among those whose error the scene can bear: \
`mdfconv recommend` does that for one surface.
- The count of operations is not the time: a vector unit evaluates the exponential of several \
numbers at once, and a rational form has steps of its own. Compare the columns.
- For a scene's few thousand materials every method is quick. The closed forms pay for arrays of \
millions, such as textures; where the result has to be right, and for energy and display, which \
they do not know, use `fast` or `fit`.
- Times depend on the processor and on NumPy; run `mdfconv bench` where the code will run."""


def tables(measurements: Measurements) -> dict[str, list[dict[str, Any]]]:
    """Return the tables that have rows, in rounded cells, a median with its quartiles in one."""
    every: dict[str, list[dict[str, Any]]] = {
        "substitutes": [
            {
                "reference": f"{row.reference} {row.reference_parameter:g}",
                "distribution": row.distribution,
                "parameter": _rounded(row.parameter, 5),
                "operations": row.operations,
                "float32 ns": _times(row.ns["float32"]),
                "float64 ns": _times(row.ns["float64"]),
                "RMSE": _rounded(row.rmse),
                "max error": _rounded(row.max_error),
                "energy error": _rounded(row.energy_error),
            }
            for row in measurements.substitutes
        ],
        "methods": [
            {
                "method": row.method,
                "metric": row.metric,
                "values": row.values,
                "values per second": _counts(row.per_second),
                "parameter error": _rounded(row.parameter_error),
                "largest": _rounded(row.parameter_error_max),
                "RMSE": _rounded(row.rmse),
                "largest RMSE": _rounded(row.rmse_max),
                "answered": f"{100 * row.answered:.3g} %",
            }
            for row in measurements.methods
        ],
        "scaling": _scaling_table(measurements),
        "limits": [
            {
                "method": row.method,
                "metric": row.metric,
                "ns": _plain(row.conversion),
                "unavoidable": row.work,
                "its ns": _plain(row.unavoidable),
                "×": _rounded(row.ratio),
            }
            for row in measurements.limits
        ],
        "kernels": [
            {
                "distribution": row.distribution,
                "type": row.precision,
                "kernel ns": _times(row.kernel),
                "textbook ns": _times(row.textbook),
                "functions": row.functions,
                "their ns": _rounded(row.floor.median),
                "copy ns": _rounded(row.copy.median),
                "× textbook": _rounded(1 / row.speedup),
                "× functions": _rounded(row.over_floor),
                "× copy": _rounded(row.over_copy),
                "memory": _rounded(row.memory),
            }
            for row in measurements.kernels
        ],
        "compiled": [
            {
                "distribution": row.distribution,
                "type": row.precision,
                "kernel ns": _times(row.kernel),
                "Dr.Jit ns": _times(row.drjit),
            }
            for row in measurements.compiled
        ],
    }
    return {name: rows for name, rows in every.items() if rows}


def _scaling_table(measurements: Measurements) -> list[dict[str, Any]]:
    """Return a row a method with a column a count."""
    counts = dict.fromkeys(row.values for row in measurements.scaling)
    rows: dict[str, dict[str, Any]] = {}
    for time in measurements.scaling:
        row = rows.setdefault(time.method, {"method": time.method} | {f"{n:,}": "" for n in counts})
        row[f"{time.values:,}"] = _written(1e9 * time.seconds.median / time.values)
    return list(rows.values())


def title(measurements: Measurements, name: str) -> str:
    """Return the heading of a table."""
    if name not in _OF_THE_PAIR:
        return TITLES[name]
    pair = measurements.methods[0]
    return f"{TITLES[name]}, {pair.source} → {pair.target}"


def sentences(measurements: Measurements) -> dict[str, list[str]]:
    """Return what each table that has rows says."""
    every = {
        "substitutes": verdicts.on_substitutes(measurements),
        "methods": verdicts.on_methods(measurements),
        "scaling": verdicts.on_scaling(measurements),
        "limits": verdicts.on_limits(measurements),
        "kernels": verdicts.on_kernels(measurements),
        "compiled": verdicts.on_compiled(measurements),
    }
    return {name: said for name, said in every.items() if said}


def markdown_page(measurements: Measurements, picture: str | None = None) -> str:
    """Return the measurements as a Markdown page.

    Parameters
    ----------
    measurements : Measurements
        What was measured.
    picture : str, optional
        The name of the picture's file, which the page then shows.
    """
    lines = ["# Speed against error", "", _machine(measurements), ""]
    if picture:
        lines += [
            f"![Error against time, distributions and methods; time against count]({picture})",
            "",
        ]
    said = sentences(measurements)
    for name, rows in tables(measurements).items():
        lines += [f"## {title(measurements, name)}", "", _legend(measurements, name), ""]
        lines += [markdown_text(list(rows[0]), rows), ""]
        lines += [*(f"- {sentence}" for sentence in said[name]), ""]
    return "\n".join([*lines, _CHOOSING])


def _legend(measurements: Measurements, name: str) -> str:
    return _LEGENDS[name].format(
        metric=measurements.scaling[0].metric, patience=measurements.sizes.patience
    )


def _machine(measurements: Measurements) -> str:
    machine, sizes = measurements.machine, measurements.sizes
    return (
        f"Measured on {machine['cpu']} ({machine['cpus']} CPUs, {machine['vector_extensions']}), "
        f"{machine['system']}, Python {machine['python']}, NumPy {machine['numpy']}, "
        f"SciPy {machine['scipy']}. "
        f"Medians of {sizes.rounds} interleaved rounds after a warm-up, quartiles in parentheses; "
        f"evaluations on {sizes.angles:,} angles from 0 to π/2; processor time of one thread. "
        "Made by `mdfconv bench --format markdown`."
    )


def _rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


def _times(times: Spread) -> str:
    return f"{times.median:#.3g} ({times.low:#.3g}–{times.high:#.3g})"


def _plain(times: Spread) -> str:
    median, low, high = map(_written, times)
    return f"{median} ({low}–{high})"


def _written(value: float) -> str:
    return f"{_rounded(value):,.10g}"


def _counts(counts: Spread) -> str:
    median, low, high = (f"{_rounded(value):,.0f}" for value in counts)
    return f"{median} ({low}–{high})"
