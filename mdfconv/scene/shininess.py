"""Wavefront's exponent Ns and the roughness of physically based renderers: by fit, and by rules.

Ns is Blinn/Phong's exponent, Pr the roughness of GGX with α = Pr². Ns 0 is the uniform lobe, which
GGX has at Pr 1; Pr 0 is a mirror, which no exponent reaches. Importers turn exponents into
roughness by rules of their own: what they make of one, and what that costs, stands here too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.conversion import convert
from mdfconv.distributions import list_distributions
from mdfconv.distributions.dialects import DIALECTS, SAME, Dialect, Specular
from mdfconv.distributions.endpoint import endpoints, stored_forms
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.solve import errors_of_many
from mdfconv.scene.stored import UNIFORM_BELOW, StoredConverter

SHININESS, ROUGHNESS = "blinn-phong", "ggx:roughness"
# Of linear red, green and blue, in the digits of obj2gltf and assimp.
_LUMINANCE = (0.2125, 0.7154, 0.0721)
# Its Pr is 4e-5: no library means anything beyond.
_LARGEST_EXPONENT = 1e18


def luminance(colour: Sequence[float]) -> float:
    """Return the specular weight that importers take from a specular colour of three numbers."""
    return math.fsum(share * part for share, part in zip(_LUMINANCE, colour, strict=True))


def roughness_of(exponent: Array, metric: Metric) -> Array:
    """Return the Pr, from 0 to 1, that fits each Ns ≥ 0 best, shape (n,); 1 for Ns 0."""
    roughness = np.ones_like(exponent)
    lobes = exponent >= UNIFORM_BELOW
    # With the cautions of a conversion.
    roughness[lobes] = convert(exponent[lobes], SHININESS, ROUGHNESS, metric=metric)
    return roughness


def exponent_of(roughness: Array, metric: Metric) -> Array:
    """Return the Ns whose best GGX has each Pr, shape (n,): the inverse of `roughness_of`.

    It is 0 for Pr 1, NaN for a mirror and otherwise from 1e-6 to 1e18.
    """
    from scipy.optimize import elementwise

    def difference(log_exponent: Array, roughness: Array) -> Array:
        return roughness_of(np.exp(log_exponent), metric) - roughness

    limits = np.log([UNIFORM_BELOW, _LARGEST_EXPONENT])
    roughest, smoothest = roughness_of(np.exp(limits), metric)
    bracket = tuple(np.full(roughness.shape, limit) for limit in limits)
    reachable = np.clip(roughness, smoothest, roughest)
    root = elementwise.find_root(difference, bracket, args=(reachable,))
    return np.select([roughness == 0, roughness < 1], [np.nan, np.exp(root.x)], 0.0)


def error_of(exponent: Array, roughness: Array, metric: Metric) -> Array:
    """Return the error of GGX of each Pr in the place of Blinn/Phong of each Ns, shape (n,).

    It is the relative root mean square of `remaining_error`; infinite for a mirror (Pr 0).
    """
    converter = StoredConverter(*endpoints(SHININESS, ROUGHNESS), metric)
    rmse = converter.remaining(np.maximum(exponent, UNIFORM_BELOW), roughness)
    rmse[roughness == 0] = np.inf
    # Both are the uniform lobe, whose signal may be nothing that an error is relative to.
    rmse[(exponent < UNIFORM_BELOW) & (roughness == 1)] = 0.0
    return rmse


def fit_error(exponent: Array, metric: Metric) -> Array:
    """Return `error_of` the roughness that fits best, shape (n,), of many to 1e-4; NaN for NaN."""

    def error(exponent: Array) -> Array:
        return error_of(exponent, roughness_of(exponent, metric), metric)

    rmse = np.full_like(exponent, np.nan)
    known = ~np.isnan(exponent)
    rmse[known] = errors_of_many(error, np.maximum(exponent[known], UNIFORM_BELOW))
    rmse[exponent < UNIFORM_BELOW] = 0.0
    return rmse


def _importer(dialect: Dialect) -> str:
    """Return the name of a rule, with the scale that is taken for an example."""
    return dialect.name if dialect.specular is not Specular.no else dialect.example


# The programs that store a roughness for an exponent, and render it with GGX.
IMPORTERS = {_importer(dialect): dialect for dialect in DIALECTS if dialect.roughness}


def importer_roughness(importer: str, exponent: Array, weight: ArrayLike = 1.0) -> Array:
    """Return the roughness that one of `IMPORTERS` makes of exponents, from 0 to 1.

    The specular weights are for rules that depend on one, shape as the exponents or one for all.
    """
    dialect = IMPORTERS[importer]
    assert dialect.roughness is not None
    setting = np.asarray(dialect.setting.example if dialect.setting else 1.0)
    if dialect.specular is not Specular.no:
        setting = np.asarray(weight)
    with np.errstate(divide="ignore"):
        stored = dialect.encode(exponent, setting)
    clipped: Array = np.clip(dialect.roughness(stored), 0, 1)
    return clipped


class ImporterResult(NamedTuple):
    """What an importer makes of an exponent.

    Parameters
    ----------
    roughness : float
        The roughness by its rule.
    rmse : float
        The error that it leaves, as `error_of`; infinite for a mirror.
    """

    roughness: float
    rmse: float


def importer_results(
    exponent: Array,
    metric: Metric,
    *,
    weight: ArrayLike = 1.0,
    surface: Sequence[Array] = (),
) -> list[dict[str, ImporterResult]]:
    """Return what each of `IMPORTERS` makes of each exponent, shape (n,).

    The errors are relative to the surface: its exponents or, where those are NaN, its roughness;
    Blinn/Phong of the exponents that the importers read if it is not given.
    """
    true_exponent, true_roughness = surface or (exponent, np.full_like(exponent, np.nan))
    phong = ~np.isnan(true_exponent)
    results: list[dict[str, ImporterResult]] = [{} for _ in exponent]
    for importer in IMPORTERS:
        roughness = importer_roughness(importer, exponent, weight)
        rmse = _roughness_errors(true_roughness, roughness, metric)
        rmse[phong] = error_of(true_exponent[phong], roughness[phong], metric)
        for result, *pair in zip(results, roughness.tolist(), rmse.tolist(), strict=True):
            result[importer] = ImporterResult(*pair)
    return results


def _roughness_errors(known: Array, roughness: Array, metric: Metric) -> Array:
    """Return the errors of GGX of each roughness in the place of GGX of a known one, or NaN."""
    converter = StoredConverter(*endpoints(ROUGHNESS, ROUGHNESS), metric)
    rmse = converter.remaining(converter.source.decode_legal(known), roughness)
    rmse[(roughness == 0) & (known > 0)] = np.inf
    rmse[known == roughness] = 0.0
    return rmse


# Where the error of a rule for exponents is given.
EXPONENTS = (10, 100, 1000)


def encoding_records(metric: Metric) -> list[dict[str, Any]]:
    """Return every encoding and dialect, with the error that its rule leaves under a metric.

    A record has ``encoding`` as in ``"blinn-phong:fbx"``, its ``formula``, the legal ``range`` of
    the stored number, what is ``clamped``, the ``programs``, where their ``source`` is, a
    ``note``, ``specular`` ("no", "optional" or "needed"), the symbol of the rule's ``setting``,
    what the program's textures hold (``texels``: "same", an endpoint, or "" if it is not known),
    and of what stores a roughness for an exponent ``roughness_100`` and ``rmse_100``, and so on
    for each of `EXPONENTS`: of GGX in Blinn/Phong's place, with a specular weight of 1; infinite
    for a mirror.
    """
    by_exponent = importer_results(np.array(EXPONENTS, float), metric)
    records = []
    for owner in list_distributions():
        for end, dialect in stored_forms(owner):
            assert end.encoding is not None, "it is a stored form"
            name = dialect.name if dialect else end.encoding.name
            record: dict[str, Any] = {
                "encoding": f"{owner.name}:{name}",
                "formula": end.encoding.formula,
                "range": end.stored.legal,
                "clamped": "; ".join(end.clamped(np.empty(0))),
                "programs": dialect.program if dialect else "",
                "source": dialect.source if dialect else "",
                "note": dialect.note if dialect else "",
                "specular": (dialect.specular if dialect else Specular.no).value,
                "setting": dialect.setting.symbol if dialect and dialect.setting else "",
                "texels": dialect.texels if dialect else SAME,
            }
            for n, results in zip(EXPONENTS, by_exponent, strict=True):
                importer = _importer(dialect) if dialect else name
                roughness, rmse = results.get(importer, (None, None))
                record |= {f"roughness_{n}": roughness, f"rmse_{n}": rmse}
            records.append(record)
    return records
