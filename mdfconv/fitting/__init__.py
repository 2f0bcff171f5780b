"""Least-squares fits between distributions, under metrics that say what a fit keeps."""
