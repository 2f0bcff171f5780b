"""``mdfconv list``."""

from __future__ import annotations

import math
from typing import Annotated, Any

from mdfconv.cli import options, tables
from mdfconv.cli.options import flag
from mdfconv.distributions import Distribution, list_distributions
from mdfconv.distributions.endpoint import forms_of
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named

# Importers' roughness is seen under light from all around.
_NATURAL = "environment"
# Of the table of encodings what a narrow terminal leaves out first.
_SECONDARY = ("N 100", "programs", "N 10", "N 1000")
_FOOTNOTE = (
    "L is the weight of the specular lobe, which --specular gives, too, K a scale, as in "
    "blinn-phong:linear:128. A mirror is what a rule makes of a surface that is none."
)

_ENCODINGS = flag("--encodings", "List what follows a colon: how files and programs store it.")


def command(
    encodings: Annotated[bool, _ENCODINGS] = False,
    metric: options.OptionalMetricOption = None,
    exposure: options.ExposureOption = None,
    format_: options.FormatOption = None,
) -> None:
    """List the distributions, or the forms in which files and programs store their parameters.

    With --encodings the errors are those of GGX with the roughness that a program makes of
    Blinn/Phong's exponent 10, 100 and 1000, under --metric, environment if not given.

    Examples:

    mdfconv list

    mdfconv list --encodings --metric energy

    mdfconv list --encodings --format json
    """
    if encodings:
        _list_encodings(options.asked_metric(metric, exposure) or metric_named(_NATURAL), format_)
        return
    if metric is not None or exposure is not None:
        raise MdfconvError("--metric is of --encodings")
    form = tables.form_of(format_, in_pipe="plain")
    if form == "table":
        rows = [_row(mdf) for mdf in list_distributions()]
        tables.print_table(list(rows[0]), rows)
    else:
        records = [_record(mdf) for mdf in list_distributions()]
        tables.write_table(["name"] if form == "plain" else list(records[0]), records, form)


def _list_encodings(metric: Metric, format_: options.Format | None) -> None:
    """Print the table of encodings and dialects."""
    from mdfconv.scene.shininess import EXPONENTS, encoding_records

    form = tables.form_of(format_)
    records = encoding_records(metric)
    if form != "table":
        tables.write_table(["encoding"] if form == "plain" else list(records[0]), records, form)
        return
    rows = [
        {
            "encoding": record["encoding"]
            + (f"[:{record['setting']}]" if record["setting"] else ""),
            "rule": "; ".join(filter(None, (record["formula"], record["clamped"]))),
            **{f"N {n}": _error(record[f"rmse_{n}"]) for n in EXPONENTS},
            "programs": record["programs"],
        }
        for record in records
    ]
    title = f"Encodings, and the RMSE of their rules under {metric}"
    tables.print_table(list(rows[0]), rows, title, secondary=_SECONDARY)
    tables.console().print(_FOOTNOTE)


def _error(rmse: float | None) -> float | str | None:
    """Return an error in two digits; none where there is no roughness."""
    if rmse is None:
        return None
    return "mirror" if math.isinf(rmse) else float(f"{rmse:.2g}")


def _row(mdf: Distribution) -> dict[str, str]:
    parameters = [
        f"{parameter.name}: {parameter.legal}, typically {low:g} to {high:g}"
        for parameter in mdf.parameters
        for low, high in [parameter.typical]
    ]
    if mdf.anisotropic:
        parameters.append("or a pair X,Y")
    return {
        "name": mdf.name,
        "parameter": "; ".join(parameters),
        "aliases": ", ".join(mdf.aliases),
        "unit form D̄": mdf.unit_formula,
        "source": mdf.source,
        "encodings": ", ".join(_formulas(mdf)),
    }


def _record(mdf: Distribution) -> dict[str, Any]:
    columns = "name", "symbol", "legal", "typical", "larger_is_smoother"
    return {
        "name": mdf.name,
        "aliases": mdf.aliases,
        "anisotropic": mdf.anisotropic,
        "parameters": [
            {column: getattr(parameter, column) for column in columns}
            for parameter in mdf.parameters
        ],
        "encodings": _formulas(mdf),
        "unit_form": mdf.unit_formula,
        "normalized_form": mdf.normalized_formula,
        "source": mdf.source,
    }


def _formulas(mdf: Distribution) -> dict[str, str]:
    """Return the formulas of the forms in which the parameter is stored, by their names."""
    return {name: form.formula for name, form in forms_of(mdf).items()}
