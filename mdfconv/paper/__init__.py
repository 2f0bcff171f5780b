"""Sawicki 2021, recomputed: Table 2, its closed forms refitted, and the error curves."""
