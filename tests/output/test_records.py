"""Numbers with their errors, as people read them."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mdfconv.output.records import percent, power_of_ten, with_error

NAN = float("nan")


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        # The three cases of the Particle Data Group: 0.827 with 0.119, 0.367 and 0.963.
        (0.827, 0.119, "0.83 ± 0.12"),
        (0.827, 0.367, "0.8 ± 0.4"),
        (0.827, 0.963, "0.8 ± 1.0"),
        (0.10112, 0.0012, "0.1011 ± 0.0012"),
        (1.51, 0.036, "1.51 ± 0.04"),
        (243.3, 12.0, "243 ± 12"),
        (12345.0, 450.0, "12300 ± 400"),
        (3.0, 300.0, "0 ± 300"),
        (-0.001, 0.02, "−0.001 ± 0.020"),
        (-0.0001, 0.02, "0.000 ± 0.020"),
        (1e7, 2e4, "(1.0000 ± 0.0020)·10⁷"),
        (1.2e-6, 4e-7, "(1.2 ± 0.4)·10⁻⁶"),
        (0.5, None, "0.500"),
        (0.5, NAN, "0.500"),
        (0.5, math.inf, "0.500"),
        (1.0, 0.0, "1.00"),
        (0.0, None, "0.00"),
        (1.234e-9, None, "1.23·10⁻⁹"),
        (NAN, 0.1, "—"),
        (math.inf, 0.1, "—"),
    ],
)
def test_by_hand(value, error, text):
    assert with_error(value, error) == text


def test_power():
    assert power_of_ten(-12) == "10⁻¹²"


def parsed(text):
    """Return value and error, and the error as it is written; both have the same decimals."""
    text, _, raised = text.partition("·10")
    power = int(raised.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) or 0)
    value, error = text.strip("()").replace("−", "-").split(" ± ")
    assert len(value.partition(".")[2]) == len(error.partition(".")[2])
    return float(value) * 10.0**power, float(error) * 10.0**power, error


magnitudes = st.floats(-12, 12).map(lambda power: 10.0**power)


@given(magnitudes, st.sampled_from([-1, 1]), magnitudes)
def test_digits_are_those_that_the_error_supports(value, sign, error):
    value *= sign
    # Beyond the digits of a float there is nothing to round.
    assume(error > 1e-13 * abs(value))
    shown, shown_error, text = parsed(with_error(value, error))
    # Rounding loses at most a seventh of the error (0.5/3.55), of both.
    assert abs(shown_error - error) < 0.145 * error
    assert abs(shown - value) < 0.145 * error
    assert len(text.replace(".", "").strip("0")) <= 2


@pytest.mark.parametrize(
    ("share", "text", "aligned"),
    [
        (0.0, "0 %", "0.0 %"),
        (9e-5, "less than 0.01 %", "less than 0.01 %"),
        (0.00012, "0.012 %", "0.012 %"),
        (0.07, "7 %", "7.0 %"),
        (0.0994, "9.9 %", "9.9 %"),
        (0.0995, "10 %", "10 %"),
        (1.234, "123 %", "123 %"),
        (101.0, "more than 10000 %", "more than 10000 %"),
        (math.nan, "nan %", "nan %"),
    ],
)
def test_a_share_has_two_digits(share, text, aligned):
    assert percent(share) == text
    assert percent(share, is_aligned=True) == aligned
