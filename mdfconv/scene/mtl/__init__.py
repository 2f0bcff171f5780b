"""Wavefront material libraries."""
