"""Rendered spheres: what GGX in Beckmann's place costs under real light.

``data/renders.csv`` was made outside of mdfconv. An independent production renderer drew a sphere
(Smith masking, F = 1, 1024 samples a pixel) under 18 real environments of high dynamic range (CC0),
with Beckmann at three m_B, and with GGX in its place at 13 ratios α/m_B. A row is an environment
and an m_B, and has

- ``predicted_linear``, the ratio that minimizes Σ (2l+1) C_l (Δk_l)² over the angular power
  spectrum C_l of that environment;
- for each measure of the difference between the pictures ``best_``, the ratio of least error, and
  ``cost_``, the error at five ratios as a multiple of the least. Measures: root mean square of
  linear light, of sRGB values, and of sRGB values after the ACES tone curve; FLIP of low and of
  high dynamic range (Andersson et al. 2020 and 2021).

How far down the 13 ratios went is not recorded. A best ratio of just 0.5, which never occurs in
linear light, may be their end.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from mdfconv.distributions.evaluation import Array

LINEAR, FLIP = "linear RMSE", "HDR-FLIP"
MEASURES = {LINEAR: "linear_rmse", "sRGB RMSE": "srgb_rmse", FLIP: "hdr_flip"}
# The ratios α/m_B of the costs, as the columns spell them, and the metric or rule that has that
# ratio on a smooth surface.
RULES = {
    "0.647": "display",
    "0.781": "environment",
    "0.925": "energy",
    "1.0": "peak",
    "1.2": "shape",
}


@dataclass(frozen=True)
class Renders:
    """The n rendered cases.

    Parameters
    ----------
    environment : tuple of str
        The light of each case.
    m_b : numpy.ndarray, shape (n,)
        Beckmann's m_B.
    predicted : numpy.ndarray, shape (n,)
        The ratio α/m_B that the light's power spectrum predicts.
    best : dict of numpy.ndarray, shape (n,)
        For each measure the ratio of least error.
    costs : dict of numpy.ndarray, shape (n, 5)
        For each measure the error at the ratios of `RULES`, as a multiple of the least.
    """

    environment: tuple[str, ...]
    m_b: Array
    predicted: Array
    best: dict[str, Array]
    costs: dict[str, Array]


def read_renders() -> Renders:
    """Return the rendered cases that come with the package."""
    text = files("mdfconv.studies").joinpath("data", "renders.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))

    def numbers(column: str) -> Array:
        return np.array([float(row[column]) for row in rows])

    return Renders(
        tuple(row["environment"] for row in rows),
        numbers("m_b"),
        numbers("predicted_linear"),
        {name: numbers(f"best_{column}") for name, column in MEASURES.items()},
        {
            name: np.stack([numbers(f"cost_{column}_{ratio}") for ratio in RULES], axis=1)
            for name, column in MEASURES.items()
        },
    )
