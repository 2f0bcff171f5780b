"""Large arrays of angles, shared between threads."""

import numpy as np
import pytest

import mdfconv
from mdfconv.distributions import one_parameter_distributions

BETA = np.linspace(-0.1, 1.7, 1_200_000, dtype=np.float32)


@pytest.mark.parametrize("entry", one_parameter_distributions(), ids=lambda entry: entry.name)
def test_threads_change_nothing(entry):
    parameter = entry.parameter.typical[0]
    for function in (entry.unit, entry.normalized, entry.cumulative):
        alone = function(BETA, parameter)
        np.testing.assert_array_equal(function(BETA, parameter, threads=3), alone)


def test_threads_share_broadcast_arrays():
    gtr, ggx = mdfconv.distribution("gtr"), mdfconv.distribution("ggx")
    beta, gamma = BETA[:400_000], np.array([[1.0], [2.0], [3.5]])
    alone = gtr.unit(beta, 0.3, gamma=gamma)
    np.testing.assert_array_equal(gtr.unit(beta, 0.3, gamma=gamma, threads=2), alone)
    alone = ggx.normalized(BETA, (0.2, 0.4), phi=1.0)
    np.testing.assert_array_equal(ggx.normalized(BETA, (0.2, 0.4), phi=1.0, threads=2), alone)


def test_a_number_of_threads():
    with pytest.raises(mdfconv.MdfconvError, match="0 threads: at least 1"):
        mdfconv.distribution("ggx").unit(BETA, 0.2, threads=0)
