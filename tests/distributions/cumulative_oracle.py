"""F(β) and 1 − F(β) at as many digits as it takes, from integrals done by hand.

Nothing here comes from mdfconv. The digits make up for the differences.
"""

from functools import cache

import mpmath as mp

from tests.oracles import missing

# Enough where a narrow lobe's tail is a difference of numbers that agree in hundreds of them.
DIGITS = 420


def slope_square(beta):
    return mp.tan(beta) ** 2


def beckmann(beta, m, gamma):
    tail = mp.exp(-slope_square(beta) / m**2)
    return 1 - tail, tail


def trowbridge_reitz(beta, alpha):
    square = slope_square(beta)
    return square / (square + alpha**2), alpha**2 / (square + alpha**2)


def gtr(beta, alpha, gamma):
    sine, cosine = mp.sin(beta), mp.cos(beta)
    if alpha == 1:
        return sine**2, cosine**2
    largest = (1 - alpha**2) / alpha**2
    x = sine**2 * largest
    if gamma == 1:
        share = mp.log(1 + x) / mp.log(1 + largest)
    else:
        share = (1 - (1 + x) ** (1 - gamma)) / (1 - (1 + largest) ** (1 - gamma))
    return share, 1 - share


def student_t(beta, alpha, gamma):
    tail = (1 + slope_square(beta) / ((gamma - 1) * alpha**2)) ** (1 - gamma)
    return 1 - tail, tail


def blinn_phong(beta, n, gamma):
    tail = mp.cos(beta) ** (n + 2)
    return 1 - tail, tail


def gauss(beta, m, gamma):
    """With the error function of a complex number, as the square is completed."""
    # Of F about 2 log₁₀(m/β) digits go, of 1 − F as many as its own smallness.
    lost = 2 * abs(mp.log10(m / beta)) + 0.45 * min((beta / m) ** 2, 400) if beta else 0
    with mp.workdps(40 * (2 + int(min(lost, 600)) // 40)):
        start, middle, end = (_primitive(b, m, mp.mp.dps) for b in (mp.mpf(0), beta, None))
        return (middle - start) / (end - start), (end - middle) / (end - start)


@cache
def _primitive(beta, m, digits):
    angle = mp.pi / 2 if beta is None else beta
    return mp.im(mp.erf(angle / m - 1j * m))


def schlick(beta, m, gamma):
    x = mp.cos(beta) + m - 1
    if x < 0:
        return mp.mpf(1), mp.mpf(0)
    share = 1 - x**2 if m == 1 else (1 - m**3 / (m**2 - (1 - m) * x**2)) / (1 - m)
    return share, 1 - share


def sawicki(beta, n, gamma):
    cosine = mp.cos(beta)
    tail = (4 * cosine / ((1 - n) * cosine + n + 3)) ** 3
    return 1 - tail, tail


FORMS = {
    "beckmann": beckmann,
    "gauss": gauss,
    "ggx": lambda beta, alpha, gamma: trowbridge_reitz(beta, alpha),
    "gtr": gtr,
    "blinn-phong": blinn_phong,
    "ashikhmin-shirley": blinn_phong,
    "schlick": schlick,
    "sawicki": sawicki,
    "smoothie": lambda beta, alpha, gamma: trowbridge_reitz(beta, alpha / mp.sqrt(4 + alpha**2)),
    "student-t": student_t,
}


def cumulative(name, beta, parameter, gamma=None):
    """Return F and 1 − F for numbers as floats hold them."""
    with mp.workdps(DIGITS):
        numbers = [mp.mpf(float(value)) for value in (beta, parameter, gamma or 2)]
        if name not in FORMS:
            raise missing(name, "FORMS", "tests/distributions/cumulative_oracle.py")
        return FORMS[name](*numbers)
