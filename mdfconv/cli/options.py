"""The options that commands share, each with one wording, and what they stand for."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from mdfconv.cli import completion
from mdfconv.cli.process import tell
from mdfconv.distributions.endpoint import Endpoint, one_parameter_endpoint
from mdfconv.distributions.parameter import percent_hint
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named

if TYPE_CHECKING:
    from mdfconv.conversion.values import Gamma

# Of a page a hundred million pixels, a third of a gigabyte.
_LARGEST_DPI = 1200
# The forms in which results are written.
Format = Literal["table", "plain", "csv", "json", "markdown"]


def option(metavar: str, help_: str, *names: str, words: Any = None, **more: Any) -> Any:
    """Return a Typer option that takes a value, of which the shell completes some `words`.

    Without names it has that of its parameter.
    """
    return typer.Option(*names, metavar=metavar, help=help_, autocompletion=words, **more)


def flag(name: str, help_: str) -> Any:
    """Return a Typer option that takes no value and has no ``--no-`` form."""
    return typer.Option(name, help=help_)


def argument(metavar: str, help_: str, **more: Any) -> Any:
    """Return a Typer argument."""
    return typer.Argument(metavar=metavar, help=help_, **more)


_FROM = option(
    "MDF",
    "Distribution that the values belong to, such as beckmann, ggx or blinn-phong; ggx:roughness "
    "and ggx:glossiness name stored forms of α, blinn-phong:reflected the older Phong exponent.",
    "--from",
    words=completion.endpoints,
)
FromOption = Annotated[str, _FROM]
ToOption = Annotated[
    str,
    option("MDF", "Distribution to convert to, as for --from.", "--to", words=completion.targets),
]
_METHOD = option(
    "METHOD",
    "closed-form (keeps the lobe's shape, approximately), half-angle, ward, peak, "
    "fit: exact, under the metric, or fast: the same from stored polynomials. With --metric "
    "alone the fit, by fast where that reaches.",
    words=completion.methods,
)
MethodOption = Annotated[str | None, _METHOD]
_METRIC = option(
    "METRIC",
    "What a fit keeps, and what errors are taken of: unit (the shape of the lobe), energy "
    "(the light of the sun or a lamp), environment (the light of a natural environment), "
    "light:FILE (that of an environment map) or display (the picture on a screen).",
    words=completion.metrics,
)
MetricOption = Annotated[str, _METRIC]
OptionalMetricOption = Annotated[str | None, _METRIC]
_EXPOSURE = option(
    "E", "Exposure of the display metric; 1, if not given, puts the source's peak at white."
)
ExposureOption = Annotated[float | None, _EXPOSURE]
_GAMMA_HELP = "Second parameter, of gtr and student-t; 2, which is ggx, if not given"
GammaOption = Annotated[str | None, option("G", f"{_GAMMA_HELP}; free fits it.")]
FixedGammaOption = Annotated[str | None, option("G", f"{_GAMMA_HELP}.")]
_SPECULAR = option(
    "L",
    "Weight of the specular lobe or luminance of Ks, above 0 to 1, where a program's rule "
    "depends on it (mdfconv list --encodings).",
)
SpecularOption = Annotated[float | None, _SPECULAR]
_FORMAT = typer.Option(
    "--format",
    help="Form of the output: by default a table on a terminal, in a pipe what a program reads "
    "most easily, in a file what its name ends in.",
)
FormatOption = Annotated[Format | None, _FORMAT]
OutputOption = Annotated[Path | None, option("FILE", "Write to a file instead.", "--output", "-o")]
_FOLDER = option(
    "DIR", "Folder to write to, created if it is not there; by default ./reports.", "--output", "-o"
)
FolderOption = Annotated[Path | None, _FOLDER]
ForceOption = Annotated[
    bool, flag("--force", "Write over files that exist; else they are refused.")
]
DryRunOption = Annotated[bool, flag("--dry-run", "Report what would be converted; write nothing.")]
_TEXELS = option(
    "MDF:ENCODING",
    "What the texels of roughness textures are, such as ggx:roughness, ggx:glossiness or "
    "blinn-phong:exponent; by default what the program is known to write.",
    "--texels",
    words=completion.texels,
)
TexelsOption = Annotated[str | None, _TEXELS]
PngOption = Annotated[Path | None, option("FILE", "Draw the result into a picture.")]
DpiOption = Annotated[
    int, option("N", "Resolution of pictures, dots an inch.", min=10, max=_LARGEST_DPI)
]


def refuse_given(context: typer.Context, names: Collection[str], why: str) -> None:
    """Refuse options that would be ignored; `why` follows the option's name in the refusal."""
    for parameter in context.command.params:
        source = context.get_parameter_source(parameter.name or "")
        if parameter.name in names and source is not None and source.name == "COMMANDLINE":
            raise MdfconvError(f"{parameter.opts[0]} {why}")


def refuse_idle_metric(context: typer.Context, method: str | None) -> None:
    """Refuse ``--metric`` beside a method that follows none."""
    if method is not None:
        from mdfconv.conversion import method_named

        if not method_named(method).follows_metric:
            refuse_given(context, ["metric"], f"goes with a fit, not with --method {method}")


def chosen_metric(name: str, exposure: float | None = None) -> Metric:
    """Return the metric for the two options; refuse an exposure of a metric that has none."""
    if exposure is None:
        return metric_named(name)
    if metric_named(name).setting != "exposure":
        raise MdfconvError(f"the {name} metric has no exposure: give no --exposure")
    if ":" in name:
        raise MdfconvError(f"the exposure is given twice, by --metric {name} and by --exposure")
    return metric_named(f"{name}:{exposure!r}")


def asked_metric(name: str | None, exposure: float | None) -> Metric | None:
    """Return the metric for the two options, None if neither is given."""
    if name is None and exposure is None:
        return None
    return chosen_metric(list_metrics()[0] if name is None else name, exposure)


def every_metric(exposure: float | None = None) -> list[Metric]:
    """Return all metrics, those that have an exposure with the one that was asked for."""
    return [
        chosen_metric(name, exposure if metric_named(name).setting == "exposure" else None)
        for name in list_metrics()
    ]


def fixed_gamma(text: str | None) -> float | None:
    """Return what ``--gamma`` says where it cannot be free."""
    gamma = chosen_gamma(text)
    if gamma is None or isinstance(gamma, float):
        return gamma
    raise MdfconvError("--gamma is a number here", "convert and fit find it")


def chosen_gamma(text: str | None) -> Gamma:
    """Return what ``--gamma`` says: None, a number or ``"free"``."""
    from mdfconv.conversion.values import FREE

    if text is None:
        return None
    if text.strip().lower() == FREE:
        return FREE
    try:
        return float(text)
    except ValueError:
        reason = f"--gamma takes a number or {FREE}, not '{text}'"
        raise MdfconvError(reason, percent_hint(text)) from None


def share(text: str, name: str) -> float:
    """Return a share that is given as a number or in per cent; raise if it is none."""
    number = text.strip()
    try:
        return float(number[:-1]) / 100 if number.endswith("%") else float(number)
    except ValueError:
        raise MdfconvError(f"the {name} '{text}' is no number", "such as 2% or 0.02") from None


def noted(end: Endpoint) -> Endpoint:
    """Return what an option names; what to know of the name goes to standard error, once."""
    if end.caution:
        tell(f"note: {end.caution}")
    return replace(end, caution="")


def asked_endpoint(name: str) -> Endpoint:
    """Return the distribution of one parameter, and its form, that an option names."""
    return noted(one_parameter_endpoint(name))


def in_asked_forms(
    rows: Iterable[dict[str, Any]], ends: Sequence[Endpoint]
) -> list[dict[str, Any]]:
    """Return rows of results with each parameter, and its error, in the forms asked for.

    A row has a ``distribution`` by name, its ``parameter``, and perhaps the ``parameter_stderr``;
    one of another distribution stays as it is.
    """
    rows_asked = []
    for row in rows:
        asked = [end for end in ends if end.distribution.name == row["distribution"]]
        rows_asked += [row | _stored(row, end) for end in asked] or [row]
    return rows_asked


def _stored(row: dict[str, Any], end: Endpoint) -> dict[str, Any]:
    if end.encoding is None or row["parameter"] is None:
        return {}
    value, slope = end.encode_one(row["parameter"])
    stored: dict[str, Any] = {"distribution": end.label, "parameter": value}
    error = row.get("parameter_stderr")
    if error is not None:
        stored["parameter_stderr"] = None if slope is None else slope * error
    return stored
