"""One thread for linear algebra, set before NumPy is imported.

The tests run in one process for each processor; more threads would only wait for one another.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from hypothesis import settings

# No test asserts a time.
settings.register_profile("mdfconv", deadline=None)
settings.load_profile("mdfconv")
