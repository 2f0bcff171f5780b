"""Convert roughness between microfacet distributions.

Examples
--------
>>> import mdfconv
>>> mdfconv.convert(0.2, "beckmann", "ggx")
0.23552
"""

from mdfconv.conversion import Conversion, convert, explain, list_methods
from mdfconv.distributions import Distribution, distribution, list_distributions
from mdfconv.errors import MdfconvError, MdfconvWarning

__version__ = "0.1.0"

__all__ = [
    "Conversion",
    "Distribution",
    "MdfconvError",
    "MdfconvWarning",
    "__version__",
    "convert",
    "distribution",
    "explain",
    "list_distributions",
    "list_methods",
]
