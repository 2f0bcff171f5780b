"""Short formulas for shaders and importers: exact ones, and those found by search over a family.

`exact_relation` has the one between stored forms of the same lobe, `write_relation` its code;
`cheapest` finds one for a pair, a range and a tolerance, `write_formula` its code.
"""

from mdfconv.formula.exact import exact_relation
from mdfconv.formula.languages import LANGUAGES, write_formula, write_relation
from mdfconv.formula.search import SearchProblem, cheapest, pareto_front

__all__ = [
    "LANGUAGES",
    "SearchProblem",
    "cheapest",
    "exact_relation",
    "pareto_front",
    "write_formula",
    "write_relation",
]
