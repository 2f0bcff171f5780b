"""Distributions fitted to measurements of reflectance or of a distribution of normals."""

from mdfconv.measured.analysis import Analysis, fit
from mdfconv.measured.materials import snippets
from mdfconv.measured.readers import ReadOptions, read
from mdfconv.measured.samples import DirectionalSamples, Samples, directional_samples

__all__ = [
    "Analysis",
    "DirectionalSamples",
    "ReadOptions",
    "Samples",
    "directional_samples",
    "fit",
    "read",
    "snippets",
]
