"""Short formulas for shaders and importers, found by search over a family.

`cheapest` finds one for a pair, a range and a tolerance, `write_formula` gives the code.
"""

from mdfconv.formula.languages import LANGUAGES, write_formula
from mdfconv.formula.search import SearchProblem, cheapest, pareto_front

__all__ = ["LANGUAGES", "SearchProblem", "cheapest", "pareto_front", "write_formula"]
