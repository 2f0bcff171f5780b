"""Distributions fitted to measurements of reflectance or of a distribution of normals."""
