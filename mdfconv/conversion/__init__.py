"""Conversion of a parameter from one distribution to another."""

from mdfconv.conversion.explanation import Conversion, explain
from mdfconv.conversion.methods import list_methods, method_named
from mdfconv.conversion.values import convert

__all__ = ["Conversion", "convert", "explain", "list_methods", "method_named"]
