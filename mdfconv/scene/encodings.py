"""The forms in which files and programs store a parameter, and what their rules cost."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.distributions import list_distributions
from mdfconv.distributions.dialects import Dialect, Specular, dialects_of
from mdfconv.distributions.endpoint import endpoint
from mdfconv.fitting.metrics import Metric
from mdfconv.scene.shininess import error_of, importer_roughness

# Where the error of a rule for exponents is given.
EXPONENTS = (10, 100, 1000)


def encoding_records(metric: Metric) -> list[dict[str, Any]]:
    """Return every encoding and dialect, with the error that its rule leaves.

    Parameters
    ----------
    metric : Metric
        Under which the error is taken.

    Returns
    -------
    list of dict
        ``encoding`` as in ``"blinn-phong:fbx"``, its ``formula``, the legal ``range`` of the
        stored number, what is ``clamped``, the ``programs``, where their ``source`` is, a
        ``note``, ``specular`` ("no", "optional" or "needed"), and of what stores a roughness for
        an exponent ``roughness_100`` and ``rmse_100``, and so on for each of `EXPONENTS`: of GGX
        in Blinn/Phong's place, with a specular weight of 1; infinite for a mirror.
    """
    records = []
    for owner in list_distributions():
        for own in owner.encodings:
            name = f"{owner.name}:{own.name}"
            records.append(_blank(name) | {"formula": own.formula, "range": own.stored.legal})
        for dialect in dialects_of(owner.name).values():
            records.append(_record(owner.name, dialect) | _cost(dialect, metric))
    return records


def _blank(name: str) -> dict[str, Any]:
    texts = ("formula", "range", "clamped", "programs", "source", "note")
    columns = [f"{what}_{n}" for n in EXPONENTS for what in ("roughness", "rmse")]
    empty: dict[str, Any] = {"encoding": name} | dict.fromkeys(texts, "")
    return empty | {"specular": Specular.no.value} | dict.fromkeys(columns)


def _record(owner: str, dialect: Dialect) -> dict[str, Any]:
    name = f"{owner}:{dialect.name}"
    end = endpoint(f"{name}:1" if dialect.specular is Specular.needed else name)
    clamped = end.clamped(np.empty(0))
    return _blank(name) | {
        "formula": dialect.formula,
        "range": end.stored.legal,
        "clamped": "; ".join(clamped),
        "programs": dialect.program,
        "source": dialect.source,
        "note": dialect.note,
        "specular": dialect.specular.value,
    }


def _cost(dialect: Dialect, metric: Metric) -> dict[str, float]:
    if dialect.roughness is None:
        return {}
    exponents = np.array(EXPONENTS, dtype=float)
    roughness = importer_roughness(dialect.name, exponents)
    errors = error_of(exponents, roughness, metric)
    return {
        key: float(value)
        for n, *values in zip(EXPONENTS, roughness, errors, strict=True)
        for key, value in zip((f"roughness_{n}", f"rmse_{n}"), values, strict=True)
    }
