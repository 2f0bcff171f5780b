"""Write the reference values of `mdfconv stability`: run as `python -m tests.generate_stability`.

Everything is computed from the printed formulas at 60 digits and stored with far more than the
type at hand resolves, for inputs that the type represents exactly. The same run always writes the
same files.
"""

import csv
from pathlib import Path

import mpmath as mp
import numpy as np

from mdfconv.distributions import distribution, one_parameter_distributions
from tests import oracles, stability_fits

DATA = Path(__file__).parents[1] / "mdfconv" / "studies" / "data"
# Significant digits that keep a reference far below the rounding of each type.
DIGITS = {np.float64: 19, np.float32: 10, np.float16: 7}
# Below the smallest subnormal number: no type can tell it from 0.
NOTHING = mp.mpf("1e-330")
# A value below this has an exponent that multiplies the rounding: a regime of its own.
TAIL = mp.mpf("1e-6")
EDGE = "edge of support"

NAMES = [entry.name for entry in one_parameter_distributions()]
GAMMAS = {"gtr": [1.5, 4], "student-t": [2.5, 50]}
STEPS = ("1e-12", "1e-6", "1e-3")
NEAR_ONE = ["1", *(f"{sign}{step}" for step in STEPS for sign in "+-")]
NEAR_TWO = [2, *(f"2+{step}" for step in STEPS)]

USUAL = {"alpha": [0.01, 0.1, 1], "exponent": [1, 100, 20000]}
MIRROR = {"alpha": [1e-8, 1e-3], "exponent": [60000, 1e16]}
GRAZING = {"alpha": [0.05, 0.3, 1], "exponent": [0.01, 2.5, 20]}
OFF_AXIS = [0.70711, 0.75, 1.5, 1e5]
NEARLY_UNIFORM = [1e-6, 0.05, "1-1e-12", 1]
# At γ = 2 the maximum is at the normal up to α = 1, and at the horizon beyond.
NEAR_LIMIT = [0.05, 1, 3]
EDGES = [1e-4, 0.3, 0.999]
FROM_EDGE = ["1e-1", "1e-3", "1e-6", "1e-9", "1e-12", "1e-14", "1e-15"]  # relative
# Of the width of the lobe, and from the horizon.
MULTIPLES = [1e-3, 0.1, 0.5, 2, 3, 5, 8, 20, 1e3, 1e6]
FROM_HORIZON = [0.1, 1e-3, 1e-6, 1e-12, 0]


def kind(name):
    return "exponent" if distribution(name).parameter.larger_is_smoother else "alpha"


def in_type(values, dtype):
    """Return the values rounded to a type, each once; not those that it only holds as 0 or inf."""
    with np.errstate(over="ignore"):
        rounded = dict.fromkeys(dtype(value) for value in values)
    limits = np.finfo(dtype)
    return [v for v in rounded if limits.smallest_normal <= v <= limits.max]


def width(name, parameter):
    """Return roughly the angle at which a lobe has fallen to 1/e."""
    return np.sqrt(2 / parameter) if kind(name) == "exponent" else min(parameter, 1)


def lobe_angles(name, parameter, dtype):
    beta = float(width(name, float(parameter))) * np.array(MULTIPLES)
    return [dtype(0), *in_type(beta[beta <= np.pi / 2], dtype)]


def grazing_angles(dtype):
    return in_type([np.pi / 2 - distance for distance in FROM_HORIZON], dtype)


def edge_angles(parameter, dtype):
    """Return angles on both sides of the edge of Schlick's support, cos β = 1 − m."""
    edge = 2 * mp.asin(mp.sqrt(mp.mpf(float(parameter)) / 2))
    around = [edge * (1 + sign * mp.mpf(step)) for step in FROM_EDGE for sign in (1, -1)]
    return in_type([float(angle) for angle in (edge, *around) if angle < oracles.HALF_PI], dtype)


def off_axis_angles(square, dtype):
    """Return angles at and around a maximum at tan²β = `square`, and grazing ones."""
    mode = np.arctan(np.sqrt(max(square, 0)))
    near = mode * np.array([0.5, 0.99, 1, 1.01])
    return [dtype(0), *in_type([*near[near < np.pi / 2], *grazing_angles(dtype)[::2]], dtype)]


def unit(name, beta, parameter, gamma):
    """Return D̄, even across the horizon, of which float32's π/2 lies on the far side."""
    angle = mp.mpf(float(beta))
    angle = min(angle, mp.pi - angle)
    value = oracles.ratio_mp(name, angle, float(parameter), float(gamma))
    return value / oracles.maximum(name, float(parameter), float(gamma))


def kernel_inputs(name, dtype):
    """Yield regime, parameter, gamma and β of the unit form."""
    for gamma in in_type(GAMMAS.get(name, [2]), dtype):
        for parameters, regime in ((USUAL, "usual"), (MIRROR, "mirror-smooth")):
            for parameter in in_type(parameters[kind(name)], dtype):
                for beta in lobe_angles(name, parameter, dtype):
                    yield regime, parameter, gamma, beta
        for parameter in in_type(GRAZING[kind(name)], dtype):
            for beta in grazing_angles(dtype):
                yield "grazing", parameter, gamma, beta
    yield from special_inputs(name, dtype)


def special_inputs(name, dtype):
    """Yield what only some distributions have."""
    return SPECIAL.get(name, lambda dtype: ())(dtype)


def beckmann_inputs(dtype):
    for parameter in in_type(OFF_AXIS, dtype):
        for beta in off_axis_angles(2 * float(parameter) ** 2 - 1, dtype):
            yield "off-axis maximum", parameter, 2, beta


def schlick_inputs(dtype):
    for parameter in in_type(EDGES, dtype):
        for beta in edge_angles(parameter, dtype):
            yield EDGE, parameter, 2, beta


def gtr_inputs(dtype):
    for gamma, alpha in near(NEAR_ONE, NEARLY_UNIFORM, dtype):
        for beta in in_type([float(alpha), min(20 * float(alpha), 1.5)], dtype):
            yield "γ near 1", alpha, gamma, beta


def student_t_inputs(dtype):
    for gamma, alpha in near(GAMMAS["student-t"], OFF_AXIS, dtype):
        square = float(oracles.mode_square("student-t", float(alpha), float(gamma)))
        if square:
            for beta in off_axis_angles(square, dtype):
                yield "off-axis maximum", alpha, gamma, beta
    for gamma, alpha in near(NEAR_TWO, NEAR_LIMIT, dtype):
        for beta in (*lobe_angles("student-t", alpha, dtype)[::3], *grazing_angles(dtype)[::2]):
            yield "γ near 2", alpha, gamma, beta


SPECIAL = {
    "beckmann": beckmann_inputs,
    "schlick": schlick_inputs,
    "gtr": gtr_inputs,
    "student-t": student_t_inputs,
}


def near(gammas, alphas, dtype):
    gammas, alphas = (in_type(map(sum_of, values), dtype) for values in (gammas, alphas))
    return [(gamma, alpha) for gamma in gammas for alpha in alphas]


def sum_of(text):
    """Return the float for a number, or for a text such as 1-1e-6, 2+1e-6 or +1e-6 (from 1)."""
    if not isinstance(text, str) or text == "1":
        return float(text)
    base = 2 if text.startswith("2") else 1
    return float(base + mp.mpf(text.removeprefix(str(base))))


def normal_inputs(name, dtype):
    """Yield regime, parameter and gamma of the normalized form at β = 0."""
    for gamma in in_type(GAMMAS.get(name, [2]), dtype):
        unbounded = kind(name) == "alpha" and distribution(name).parameter.upper == np.inf
        extremes = OFF_AXIS if unbounded else []
        values = [*USUAL[kind(name)], *MIRROR[kind(name)], *extremes]
        for parameter in in_type(values, dtype):
            yield "at the normal", parameter, gamma
    if name == "gtr":
        for gamma, alpha in near(NEAR_ONE, NEARLY_UNIFORM, dtype):
            yield "γ near 1", alpha, gamma


def kernels(dtype):
    """Yield the rows of one type: a row has the angles of one parameter and regime."""
    for name in NAMES:
        groups = {}
        for regime, parameter, gamma, beta in dict.fromkeys(kernel_inputs(name, dtype)):
            value = unit(name, beta, parameter, gamma)
            if regime != EDGE and np.finfo(dtype).smallest_normal <= value < TAIL:
                regime = "tail"
            group = groups.setdefault(("unit", regime, parameter, gamma), {})
            group[beta] = value
        for regime, parameter, gamma in dict.fromkeys(normal_inputs(name, dtype)):
            value = oracles.at_normal(name, float(parameter), float(gamma))
            groups["normalized", regime, parameter, gamma] = {dtype(0): value}
        for (form, regime, parameter, gamma), values in groups.items():
            yield {
                "distribution": name,
                "form": form,
                "regime": regime,
                "parameter": short(parameter),
                "gamma": short(gamma) if name in GAMMAS else "",
                "beta": " ".join(map(short, values)),
                "value": " ".join(digits(value, dtype) for value in values.values()),
            }


def digits(value, dtype):
    """Return a value as text that has more digits than a type."""
    return "0" if value < NOTHING else mp.nstr(value, DIGITS[dtype])


def short(value):
    """Return the shortest text that reads back as the number, in the number's own type."""
    text = str(value).removesuffix(".0")
    assert type(value)(text) == value
    return text


ENDS = {
    "beckmann": [0.7, 3],
    "gauss": [0.7, 1.5],
    "ggx": [0.5, 0.99],
    "gtr": [0.5, 0.99],
    "blinn-phong": [0.1, 10],
    "schlick": [0.5, 1],
    "sawicki": [0.1, 10],
    "smoothie": [0.5, 100],
    "student-t": [0.5, 3],
}
SMOOTH_ENDS = {"alpha": [1e-8, 1e-4], "exponent": [1e16, 1e8]}
# The γ of both sides, and the distributions of two parameters that take part: a number that is
# legal and hard for one of them is illegal or Beckmann's for another.
CONVERSION_GAMMAS = {1.5: ["gtr"], 4: ["student-t"]}


def conversions():
    """Yield a row for every method, γ, source and value: the exact results in every target.

    The values are float32's, so that they are the same numbers in both types.
    """
    methods = {"closed-form": closed_form, "half-angle": half_angle, "peak": peak, "ward": ward}
    for number, gamma in enumerate(CONVERSION_GAMMAS):
        for method, exact in methods.items():
            for source in NAMES:
                ends = {"mirror-smooth": SMOOTH_ENDS[kind(source)], "rough": ENDS[source]}
                for regime, values in ends.items():
                    for value in map(np.float32, values):
                        row = conversion_row(exact, source, gamma, float(value), bool(number))
                        if any(row.values()):
                            yield {
                                "method": method,
                                "source": source,
                                "regime": regime,
                                "gamma": gamma,
                                "value": short(value),
                            } | row


def conversion_row(exact, source, gamma, value, only_two):
    """Return the exact results as text, empty where there is none.

    A pair of distributions of one parameter is the same for every γ: with `only_two` it is left
    out.
    """
    two = CONVERSION_GAMMAS[gamma]
    row = dict.fromkeys(NAMES, "")
    for target in NAMES:
        second = [name for name in (source, target) if distribution(name).second_parameter]
        known = all(name in two for name in second) and (second or not only_two)
        if known and source != target:
            row[target] = conversion_text(exact(source, target, value, gamma))
    return row


def conversion_text(value):
    return "" if value is None else mp.nstr(value, 20)


def legal(target, value):
    """Return a result, or None where the target's legal range does not hold it."""
    upper = mp.mpf(distribution(target).parameter.upper)
    return value if mp.im(value) == 0 and 0 < mp.re(value) <= upper else None


def closed_form(source, target, value, gamma):
    if not {source, target} <= oracles.IN_THE_PAPER:
        return None
    if source == "sawicki" and (mp.mpf(value) - mp.mpf("0.3")) / mp.mpf("1.174") <= 0:
        return None
    result = oracles.closed_form(source, target, value)
    through_phong = target == "sawicki" and source != "blinn-phong"
    if through_phong and mp.re(result) <= mp.mpf("0.3"):
        return None
    return legal(target, result)


def ward(source, target, value, gamma):
    names = {"beckmann": "m", "schlick": "m", "blinn-phong": "n"}
    if names.get(source, target) == names.get(target, source):
        same = {source, target} == {"beckmann", "schlick"}
        return legal(target, mp.mpf(value)) if same else None
    if not {source, target} <= names.keys():
        return None
    two_over = 2 / mp.mpf(value)
    return legal(target, two_over / value if names[source] == "m" else mp.sqrt(two_over))


def half_angle(source, target, value, gamma):
    beta_half = oracles.half_width(source, value, gamma)
    return beta_half and oracles.from_half_width(target, beta_half, gamma)


def peak(source, target, value, gamma):
    """Return the parameter with the same D(0)."""
    at_normal = oracles.at_normal(source, value, gamma)
    square = 1 / (mp.pi * at_normal)
    results = {
        **dict.fromkeys(("beckmann", "ggx", "schlick", "student-t"), lambda: mp.sqrt(square)),
        "blinn-phong": lambda: 2 / square - 2,
        "sawicki": lambda: 8 / (3 * square) - 3,
        "smoothie": lambda: mp.sqrt(4 * square / (1 - square)) if square < 1 else mp.mpf(0),
        "gauss": lambda: same_peak("gauss", at_normal, gamma),
        "gtr": lambda: same_peak("gtr", at_normal, gamma),
    }
    # Every distribution is at least as high as one that is 1/π everywhere.
    if target in ("gauss", "gtr") and square >= 1:
        return None
    if target not in results:
        raise oracles.missing(target, "peak", "tests/generate_stability.py")
    return legal(target, results[target]())


def same_peak(target, at_normal, gamma):
    def difference(log_parameter):
        return mp.log(oracles.at_normal(target, mp.exp(log_parameter), gamma) / at_normal)

    start = mp.log(1 / (mp.pi * at_normal)) / 2
    return mp.exp(mp.findroot(difference, (start, start + mp.mpf("0.01"))))


def write(name, rows):
    rows = list(rows)
    with open(DATA / name, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    print(f"{name}: {len(rows)} rows, {(DATA / name).stat().st_size} bytes")


def main():
    """Write the files."""
    for dtype in DIGITS:
        write(f"kernels-{np.dtype(dtype).name}.csv", kernels(dtype))
    write("conversions.csv", conversions())
    write("fits.csv", stability_fits.rows())


if __name__ == "__main__":
    main()
