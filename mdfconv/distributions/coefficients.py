"""Coefficients of the elementary functions, highest power first.

They are made by ``python -m tests.generate_elementary``.
"""

from typing import NamedTuple


class Coefficients(NamedTuple):
    """Those of one floating-point type.

    π/2 is a sum of two numbers, fractions have a numerator and a denominator.
    """

    half_pi: tuple[float, float]
    tangent: tuple[tuple[float, ...], tuple[float, ...]]
    exponential: tuple[tuple[float, ...], tuple[float, ...]]
    versine: tuple[tuple[float, ...]]
    sine: tuple[tuple[float, ...]]


FLOAT32 = Coefficients(
    half_pi=(1.5707963705062866, -4.371138828673793e-08),
    tangent=(
        (
            1.0,
            -20.664264678955078,
        ),
        (
            0.00047151316539384425,
            1.0830756425857544,
            -25.124732971191406,
        ),
    ),
    exponential=(
        (
            1.0,
            20.81816864013672,
        ),
        (
            0.057700399309396744,
            7.215027332305908,
        ),
    ),
    versine=(
        (
            2.62975163423107e-07,
            -2.4774579287623055e-05,
            0.0013888651737943292,
            -0.0416666604578495,
            0.5,
        ),
    ),
    sine=(
        (
            0.008314349688589573,
            -0.1666662096977234,
            1.0,
        ),
    ),
)
FLOAT64 = Coefficients(
    half_pi=(1.5707963267948966, 6.123233995736766e-17),
    tangent=(
        (
            1.0,
            -288.52964053304794,
            18078.333048170793,
            -255623.772275423,
        ),
        (
            1.0230338987192071,
            -308.32689652756943,
            20338.115185528066,
            -310801.23808878317,
        ),
    ),
    exponential=(
        (
            1.0,
            233.1777519752325,
            4368.078795177389,
        ),
        (
            0.023094399453830353,
            20.2016706494636,
            1513.860750670445,
        ),
    ),
    versine=(
        (
            -4.6276759850181716e-14,
            1.1464689885720029e-11,
            -2.0876630867422994e-09,
            2.755731776732053e-07,
            -2.4801587292446213e-05,
            0.0013888888888860709,
            -0.04166666666666634,
            0.5,
        ),
    ),
    sine=(
        (
            2.7517358063905194e-06,
            -0.00019841247521141327,
            0.008333333328244244,
            -0.16666666666662605,
            1.0,
        ),
    ),
)
