"""Write the coefficients of `mdfconv.distributions.elementary`, by ``python -m`` this module.

Each rational function interpolates at Chebyshev's points, at 50 digits, which is within a factor of
two of the best one (Powell 1967).
"""

from __future__ import annotations

from pathlib import Path

import mpmath as mp
import numpy as np

FILE = Path(__file__).parents[1] / "mdfconv/distributions/coefficients.py"
# Near 0/0 limits are taken.
_NEARLY = mp.mpf(10) ** -24
with mp.workdps(50):
    _HALF_PI_SQUARE = mp.pi**2 / 4
    _NEAR_SQUARE = mp.asin(0.25) ** 2


def tangent(x: mp.mpf) -> mp.mpf:
    """Return ((tan β)/β − 1) (π²/4 − x)/x for x = β²."""
    if x < _NEARLY:
        return _HALF_PI_SQUARE / 3
    if _HALF_PI_SQUARE - x < _NEARLY:
        return 2 / x
    beta = mp.sqrt(x)
    return (mp.tan(beta) / beta - 1) * (_HALF_PI_SQUARE - x) / x


def exponential(x: mp.mpf) -> mp.mpf:
    """Return f/tanh(½ f ln 2) for x = f²."""
    if x < _NEARLY:
        return 2 / mp.log(2)
    f = mp.sqrt(x)
    return f / mp.tanh(f * mp.log(2) / 2)


def versine(x: mp.mpf) -> mp.mpf:
    """Return (1 − cos β)/x for x = β²."""
    return mp.mpf(0.5) if x < _NEARLY else 2 * (mp.sin(mp.sqrt(x) / 2) ** 2) / x


def sine(x: mp.mpf) -> mp.mpf:
    """Return sin w/w for x = w²."""
    return mp.mpf(1) if x < _NEARLY else mp.sin(mp.sqrt(x)) / mp.sqrt(x)


# The function, the end of its interval from 0, and degrees of numerator and denominator in each
# type: the least that leave the rounding.
FUNCTIONS = {
    "tangent": (tangent, _HALF_PI_SQUARE, {np.float32: (1, 2), np.float64: (3, 3)}),
    "exponential": (exponential, mp.mpf(0.25), {np.float32: (1, 1), np.float64: (2, 2)}),
    "versine": (versine, _HALF_PI_SQUARE, {np.float32: (4, 0), np.float64: (7, 0)}),
    # As far as cos β is less than ¼.
    "sine": (sine, _NEAR_SQUARE, {np.float32: (2, 0), np.float64: (4, 0)}),
}


@mp.workdps(50)
def rational(name: str, kind: type) -> list[list[float]]:
    """Return numerator and denominator, highest power first, rounded to a type.

    The numerator of a fraction begins with 1; a polynomial has no denominator.
    """
    function, end, degrees = FUNCTIONS[name]
    above, below = degrees[kind]
    count = above + below + 1
    nodes = [end / 2 * (1 - mp.cos(mp.pi * (2 * i + 1) / (2 * count))) for i in range(count)]
    rows, values = [], []
    for x in nodes:
        value = function(x)
        rows.append([x**k for k in range(above + 1)])
        rows[-1] += [-value * x**k for k in range(1, below + 1)]
        values.append(value)
    solution = list(mp.lu_solve(mp.matrix(rows), mp.matrix(values)))
    numerator, denominator = solution[: above + 1], [mp.mpf(1), *solution[above + 1 :]]
    scale = numerator[-1] if below else 1
    return [
        [float(kind(float(one / scale))) for one in reversed(part)]
        for part in ((numerator, denominator) if below else (numerator,))
    ]


@mp.workdps(50)
def half_pi(kind: type) -> tuple[float, float]:
    """Return π/2 in two parts."""
    first = float(kind(np.pi / 2))
    return first, float(kind(float(mp.pi / 2 - mp.mpf(first))))


def text() -> str:
    """Return the module of coefficients."""
    lines = [
        '"""Coefficients of the elementary functions, highest power first.',
        "",
        "They are made by ``python -m tests.generate_elementary``.",
        '"""',
        "",
        "from typing import NamedTuple",
        "",
        "",
        "class Coefficients(NamedTuple):",
        '    """Those of one floating-point type.',
        "",
        "    π/2 is a sum of two numbers, fractions have a numerator and a denominator.",
        '    """',
        "",
        "    half_pi: tuple[float, float]",
    ]
    for name in FUNCTIONS:
        kinds = ", ".join(["tuple[float, ...]"] * len(rational(name, np.float64)))
        lines.append(f"    {name}: tuple[{kinds}]")
    for kind in (np.float32, np.float64):
        lines += [""] * (2 if kind is np.float32 else 0)
        lines += [f"{kind.__name__.upper()} = Coefficients(", f"    half_pi={half_pi(kind)!r},"]
        for name in FUNCTIONS:
            lines.append(f"    {name}=(")
            for part in rational(name, kind):
                lines += ["        (", *(f"            {one!r}," for one in part), "        ),"]
            lines.append("    ),")
        lines.append(")")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    FILE.write_text(text())
