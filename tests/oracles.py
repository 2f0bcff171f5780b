"""Independent evaluations: the printed formulas at 50 digits, and adaptive quadrature.

Nothing here comes from mdfconv but whether a parameter is an exponent; the expressions are the
sources' own, cancellation and all.
"""

import mpmath as mp

from mdfconv import distribution

mp.mp.dps = 60

HALF_PI = mp.pi / 2


def unit(name, beta, p, gamma=2):
    """Return D̄ at 50 digits; float32's π/2, which exceeds π/2, counts as π/2."""
    beta, p = min(mp.mpf(float(beta)), HALF_PI), mp.mpf(float(p))
    c, s = mp.cos(beta), mp.sin(beta)
    if name == "beckmann":
        value = mp.exp(-((s / c) ** 2) / p**2) / c**4
        return value / (4 * p**4 * mp.exp(1 / p**2 - 2)) if 2 * p * p > 1 else value
    if name == "gauss":
        return mp.exp(-(beta**2) / p**2)
    if name in ("ggx", "gtr"):
        return (p**2 / (c**2 * (p**2 - 1) + 1)) ** mp.mpf(float(gamma))
    if name in ("blinn-phong", "ashikhmin-shirley"):
        return c**p
    if name == "schlick":
        x = c + p - 1
        return p**5 * x / (c * (p * x**2 - x**2 + p**2) ** 2) if x > 0 else mp.mpf(0)
    if name == "sawicki":
        return 256 * c / ((1 - p) * c + p + 3) ** 4
    if name == "smoothie":
        return (p**2 / (p**2 + 4 * s**2)) ** 2
    if name == "student-t":
        return student_t(c, s, p, mp.mpf(float(gamma))) / maximum(name, p, float(gamma))
    raise missing(name, "unit")


def missing(name, function, file="tests/oracles.py"):
    """Return the error where a distribution has no oracle."""
    return LookupError(f"no oracle for {name}: add a case to `{function}` in {file}")


def is_exponent(name):
    """Return whether a larger parameter is a smoother surface."""
    return distribution(name).parameter.larger_is_smoother


def student_t(c, s, p, gamma):
    """Return D(β)/D(0) of Ribardière et al. 2017, from the printed normalized form."""

    def printed(c, s):
        bottom = mp.pi * c**4 * ((gamma - 1) * p**2 + (s / c) ** 2) ** gamma
        return (gamma - 1) ** gamma * p ** (2 * gamma - 2) / bottom

    return printed(c, s) / printed(mp.mpf(1), mp.mpf(0))


def half_width(name, p, gamma=2):
    """Return β_half by bisection on D(β)/D(0) at 50 digits, None if D stays above one half."""

    # Work on the logarithm: β_half spans many decades.
    low, high = mp.mpf("1e-12"), HALF_PI * (1 - mp.mpf("1e-40"))
    if excess_mp(name, high, p, gamma) > 0:
        return None
    for _ in range(100):
        middle = mp.sqrt(low * high)
        if excess_mp(name, middle, p, gamma) > 0:
            low = middle
        else:
            high = middle
    return low


def from_half_width(name, beta_half, gamma=2):
    """Return the parameter with that β_half by bisection at 50 digits, None if there is none."""
    rising = not is_exponent(name)
    widest = min(distribution(name).parameter.upper, 1e6)
    low, high = map(mp.mpf, ("1e-17", widest) if rising else ("1e-8", "1e17"))
    low_is_wide, high_is_wide = (excess_mp(name, beta_half, p, gamma) > 0 for p in (low, high))
    if high_is_wide != rising or low_is_wide == rising:
        return None
    for _ in range(110):
        middle = mp.sqrt(low * high)
        if (excess_mp(name, beta_half, middle, gamma) > 0) == rising:
            high = middle
        else:
            low = middle
    return low


def excess_mp(name, beta, p, gamma):
    """Return D(β)/D(0) − ½ for an mpf β, without rounding β to a double."""
    return ratio_mp(name, beta, p, gamma) - mp.mpf("0.5")


def ratio_mp(name, beta, p, gamma):
    """Return D(β)/D(0) for an mpf β, without rounding β to a double."""
    c, s, p = mp.cos(beta), mp.sin(beta), mp.mpf(p)
    ratio = {
        "beckmann": lambda: mp.exp(-((s / c) ** 2) / p**2) / c**4,
        "gauss": lambda: mp.exp(-(beta**2) / p**2),
        "ggx": lambda: (p**2 / (p**2 + (1 - p**2) * s**2)) ** 2,
        "gtr": lambda: (p**2 / (p**2 + (1 - p**2) * s**2)) ** mp.mpf(gamma),
        "blinn-phong": lambda: c**p,
        "schlick": lambda: (
            p**5 * (c + p - 1) / (c * (p * (c + p - 1) ** 2 - (c + p - 1) ** 2 + p**2) ** 2)
            if c + p > 1
            else mp.mpf(0)
        ),
        "sawicki": lambda: 256 * c / ((1 - p) * c + p + 3) ** 4,
        "smoothie": lambda: (p**2 / (p**2 + 4 * s**2)) ** 2,
        "student-t": lambda: student_t(c, s, p, mp.mpf(gamma)),
    }
    if name not in ratio:
        raise missing(name, "ratio_mp")
    return ratio[name]()


def mode_square(name, p, gamma=2):
    """Return tan²β of the maximum, 0 if that is at the normal."""
    p, gamma = mp.mpf(p), mp.mpf(gamma)
    if name == "beckmann":
        return max(2 * p * p - 1, mp.mpf(0))
    if name == "student-t":
        above = 2 * (gamma - 1) * p * p - gamma
        return mp.mpf(0) if above <= 0 else above / (gamma - 2) if gamma > 2 else mp.inf
    return mp.mpf(0)


def maximum(name, p, gamma=2):
    """Return max D(β)/D(0)."""
    p, square = mp.mpf(p), mode_square(name, p, gamma)
    if not square:
        return mp.mpf(1)
    if name == "beckmann":
        return 4 * p**4 * mp.exp(1 / p**2 - 2)
    # At γ = 2 it rises to α⁴ at the horizon.
    if mp.isinf(square):
        return p**4
    c = 1 / mp.sqrt(1 + square)
    return student_t(c, mp.sqrt(square) * c, p, mp.mpf(gamma))


def at_normal(name, p, gamma=2):
    """Return D(0) of the normalized form; for the Gaussian by quadrature."""
    p, gamma = mp.mpf(p), mp.mpf(gamma)
    if name in ("beckmann", "ggx", "schlick", "student-t"):
        return 1 / (mp.pi * p**2)
    if name == "gauss":
        ends = [step * p for step in (0, 1, 2, 4, 8, 12, 16) if step * p < HALF_PI]
        if len(ends) < 7:
            ends.append(HALF_PI)
        return 1 / (mp.pi * mp.quad(lambda b: mp.exp(-((b / p) ** 2)) * mp.sin(2 * b), ends))
    if name == "gtr":
        if p == 1:
            return 1 / mp.pi
        bottom = mp.log(p**2) if gamma == 1 else (1 - p ** (2 - 2 * gamma)) / (gamma - 1)
        return (p**2 - 1) / (mp.pi * bottom * p ** (2 * gamma))
    if name == "blinn-phong":
        return (p + 2) / (2 * mp.pi)
    if name == "sawicki":
        return 3 * (3 + p) / (8 * mp.pi)
    if name == "smoothie":
        return (p**2 + 4) / (mp.pi * p**2)
    raise missing(name, "at_normal")


def relative_error(value, exact):
    """Return |value − exact| / |exact| as a float."""
    return float(abs(mp.mpf(float(value)) - exact) / abs(exact))


# What the paper's closed forms convert, Smoothie as the GGX that it is.
IN_THE_PAPER = {"beckmann", "gauss", "ggx", "blinn-phong", "schlick", "sawicki", "smoothie"}


def closed_form(source, target, x):
    """Return the paper's conversion at 50 digits, from equations (11)-(15), Tables 3 and 4."""
    x = mp.mpf(float(x))
    number = lambda text: mp.mpf(text)  # noqa: E731
    if source == target:
        return x
    if source == "schlick" or target == "schlick":
        renamed = tuple("beckmann" if n == "schlick" else n for n in (source, target))
        return closed_form(*renamed, x)
    if source == "smoothie":
        return closed_form("ggx", target, x / mp.sqrt(4 + x**2))
    if target == "smoothie":
        a = _mp(closed_form(source, "ggx", x))
        return 2 * a / mp.sqrt(1 - a**2)
    direct = {
        ("beckmann", "blinn-phong"): lambda: 2 / x**2 - number("2.5"),
        ("blinn-phong", "beckmann"): lambda: mp.sqrt(2) / mp.sqrt(x + number("2.5")),
        ("beckmann", "gauss"): lambda: number("0.5591") * x**3 + x,
        ("gauss", "beckmann"): lambda: x - number("0.4134") * x**3,
        ("gauss", "blinn-phong"): lambda: 2 / x**2 - number("0.5"),
        ("blinn-phong", "gauss"): lambda: mp.sqrt(2) / mp.sqrt(x + number("0.5")),
        ("blinn-phong", "sawicki"): lambda: number("1.174") * x + number("0.3"),
        ("sawicki", "blinn-phong"): lambda: (x - number("0.3")) / number("1.174"),
        ("ggx", "gauss"): lambda: number("0.8222") * x + number("0.82") * x**3,
        ("ggx", "beckmann"): lambda: number("0.8388") * x + number("0.7") * x**4,
        ("ggx", "blinn-phong"): lambda: number("1.696") ** 2 / x**2 - number("4.5"),
        ("gauss", "ggx"): lambda: number("1.186") * x - number("0.835") * x**3,
        ("beckmann", "ggx"): lambda: number("1.2") * x - number("0.56") * x**3,
        ("blinn-phong", "ggx"): lambda: number("1.697") / mp.sqrt(x + number("4.5")),
    }
    if (source, target) in direct:
        return direct[source, target]()
    return _through_phong(source, target, x)


def _through_phong(source, target, x):
    n = (x - mp.mpf("0.3")) / mp.mpf("1.174") if source == "sawicki" else None
    if n is not None:
        tails = {
            "beckmann": mp.sqrt(2 / (n + mp.mpf("2.5"))),
            "gauss": mp.sqrt(2 / (n + mp.mpf("0.5"))),
            "ggx": mp.mpf("1.697") / mp.sqrt(n + mp.mpf("4.5")),
        }
        return tails[target]
    heads = {
        "beckmann": lambda: 2 / x**2 - mp.mpf("2.5"),
        "gauss": lambda: 2 / x**2 - mp.mpf("0.5"),
        "ggx": lambda: mp.mpf("1.696") ** 2 / x**2 - mp.mpf("4.5"),
    }
    return mp.mpf("1.174") * heads[source]() + mp.mpf("0.3")


def _mp(value):
    return value if isinstance(value, mp.mpf) else mp.mpf(float(value))
