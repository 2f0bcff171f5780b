"""Random calls of the library: what they are, and which answers are ones."""

import warnings

import numpy as np

import mdfconv
from mdfconv.distributions.endpoint import encodings_of
from mdfconv.fitting.metrics import list_metrics

HARD = [
    0.0, -0.0, 5e-324, 1e-320, 2.3e-308, 1e-300, 1e-200, 1e-160, 1e-154, 1e-100, 1e-45, 1e-38,
    1e-16, 1e-8, 1e-3, 0.01, 0.1, 0.2, 0.5, 0.8, 0.95, 0.99, 0.9999, 1 - 2**-53, 1.0, 1 + 2**-52,
    1.5, 2.0, 10.0, 100.0, 1e4, 65504.0, 65520.0, 1e8, 1e16, 1e38, 1e100, 1e154, 1e200, 1e300,
    1e308, 1.7976931348623157e308, float("inf"), float("-inf"), float("nan"), -1.0, -1e308,
]  # fmt: skip
JUNK = ["", " ", "0.2", "α", "nan", "ggx", "a:b", ":", "all", "free", "-", "x" * 200, "\0", "%s"]
TYPES = ["f2", "f4", "f8", "g", "i1", "u1", "i8", "u8", "?", "c8", "U3", "O", "M8[s]", ">f8", "<f4"]
SHAPES = [(), (0,), (1,), (3,), (2, 0, 3), (2, 3), (1, 1, 1, 1)]
SETTINGS = ["", ":1", ":4", ":0", ":-1", ":1e-320", ":1e308", ":inf", ":nan", ":x", ":", "::"]
EVERY = mdfconv.list_distributions()
KERNELS = ("unit", "normalized", "cumulative", "sample")
WIDTHS = ("half_width", "half_tangent", "peak_alpha", "from_half_tangent", "from_peak_alpha")


def number(choose):
    """Return a float: a usual one more often than not, or a hard one."""
    if choose.random() < 0.75:
        return 10 ** choose.uniform(-3, 0)
    return choose.choice(HARD)


def junk(choose):
    """Return what is no number."""
    return choose.choice(
        [None, "0.2", "", {}, [], (), [[1], [1, 2]], b"1", 1j, object(), 10**400, -(10**400), True,
         np.ma.masked_array([0.2, 0.3], [0, 1]), np.float16(0.3), np.longdouble("1e400"),
         np.datetime64("2020"), range(3), {0.2}, lambda: 1, [None], ["a"], np.array(0.2, "O")]
    )  # fmt: skip


def values(choose):
    """Return what stands for parameters."""
    roll = choose.random()
    if roll < 0.4:
        return number(choose)
    if roll < 0.43:
        return junk(choose)
    if roll < 0.6:
        return tuple(values(choose) for _ in range(choose.choice([1, 2, 2, 2, 3])))
    if roll < 0.7:
        return [number(choose) for _ in range(choose.randrange(4))]
    shape, kind = choose.choice(SHAPES), choose.choice(TYPES if roll < 0.85 else TYPES[:3])
    raw = np.array([number(choose) for _ in range(int(np.prod(shape)))]).reshape(shape)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            array = raw.astype(kind)
        except (ValueError, OverflowError, TypeError):
            return raw
    return array.T if choose.random() < 0.2 else array


def endpoint_name(choose):
    """Return the name of a distribution and an encoding, now and then a mistaken one."""
    if choose.random() < 0.03:
        return choose.choice([*JUNK, None, 5, 0.2])
    mdf = choose.choice(EVERY)
    name = choose.choice([mdf.name, *mdf.aliases])
    if choose.random() < 0.3:
        name += f":{choose.choice([*encodings_of(mdf), 'roughness', 'x', ''])}"
        if choose.random() < 0.2:
            name += choose.choice(SETTINGS)
    return name.upper() if choose.random() < 0.05 else name


def method_name(choose):
    """Return a method, None or a mistake."""
    names = [method.name for method in mdfconv.list_methods()]
    return choose.choice([*names, None, None, None, *names, "Fast", "x", 1])


def metric_name(choose):
    """Return a metric with a setting, None or a mistake."""
    if choose.random() < 0.5:
        return None
    name = choose.choice([*list_metrics(), "display", "light", "x"])
    return name + (choose.choice(SETTINGS) if choose.random() < 0.3 else "")


def gamma(choose):
    """Return a γ, "free" or a mistake."""
    roll = choose.random()
    if roll < 0.7:
        return None
    return choose.choice(["free", "Free", "x"]) if roll < 0.75 else choose.choice([*HARD, "2", [2]])


class _Api:
    """Calls of the library."""

    def draw(self, choose):
        """Return the name of a call, and all of it."""
        call = choose.choice(["convert", "convert", "explain", "kernel", "kernel", "width"])
        return call, getattr(self, f"_draw_{call}")(choose)

    def text(self, case):
        """Return a call as a reader may repeat it."""
        call, arguments, options = case
        return f"{call}{arguments!r} {options!r}"

    def run(self, case):
        """Make a call; return the class of its outcome, raise for what is none."""
        call, arguments, options = case
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("error")
            warnings.simplefilter("always", mdfconv.MdfconvWarning)
            try:
                answer = self._function(call)(*arguments, **options)
            except mdfconv.MdfconvError as error:
                if not str(error).strip() or "\n" in str(error):
                    raise ValueError(
                        f"a refusal without words or of several lines: {error}"
                    ) from None
                return "refused"
        check = getattr(self, f"_check_{call.rpartition('.')[2]}")
        check(answer, arguments, options, warned=bool(told))
        return "answered with a warning" if told else "answered"

    def _function(self, call):
        owner, _, method = call.rpartition(".")
        if not owner:
            return getattr(mdfconv, method)
        return getattr(mdfconv.distribution(owner), method)

    def _draw_convert(self, choose):
        arguments = (values(choose), endpoint_name(choose), endpoint_name(choose))
        options = {"metric": metric_name(choose), "gamma": gamma(choose)}
        if choose.random() < 0.1:
            options["threads"] = choose.choice([1, 2, 0, -1, 10**6, 1.5, "2", None])
        return "convert", (*arguments, method_name(choose)), options

    def _draw_explain(self, choose):
        _, arguments, options = self._draw_convert(choose)
        options.pop("threads", None)
        return "explain", arguments, options | {"errors": choose.random() < 0.5}

    def _draw_kernel(self, choose):
        call, mdf = choose.choice(KERNELS), choose.choice(EVERY)
        options = {}
        if call != "sample" and choose.random() < 0.3:
            options["gamma"] = choose.choice([number(choose), values(choose)])
        if call in KERNELS[:2] and choose.random() < 0.3:
            options["phi"] = choose.choice([number(choose), values(choose)])
        if call in KERNELS[2:]:
            options["complement"] = choose.random() < 0.5
        beta = choose.choice([choose.uniform(0, 1.6), number(choose), values(choose)])
        return f"{mdf.name}.{call}", (beta, values(choose)), options

    def _draw_width(self, choose):
        return f"{choose.choice(EVERY).name}.{choose.choice(WIDTHS)}", (values(choose),), {}

    def _check_convert(self, answer, arguments, options, warned):
        pair = isinstance(arguments[0], tuple) or options["gamma"] == "free"
        for result in answer if pair else (answer,):
            assert warned or np.isfinite(result).all(), f"an answer that is none: {result}"
        if not pair:
            assert np.shape(answer) == np.shape(arguments[0]), "another shape"

    def _check_explain(self, answer, arguments, options, warned):
        for conversion in answer:
            assert np.isfinite(conversion.result).all(), f"no result: {conversion.result}"
            errors = conversion.rmse, conversion.max_error
            if options["errors"] and not conversion.cautions:
                assert np.isfinite(errors).all(), f"no errors: {errors}"
                assert min(errors) >= 0, f"negative errors: {errors}"

    def _check_unit(self, answer, arguments, options, warned):
        _within(answer, 0, 1 + 1e-6, arguments, options)

    def _check_normalized(self, answer, arguments, options, warned):
        half = np.asarray(answer).dtype == np.float16
        _within(answer, 0, np.inf if half else np.finfo(float).max, arguments, options)

    def _check_cumulative(self, answer, arguments, options, warned):
        _within(answer, 0, 1, arguments, options)

    def _check_sample(self, answer, arguments, options, warned):
        _within(answer, 0, np.pi / 2, arguments, options)

    def _check_half_width(self, answer, arguments, options, warned):
        # NaN is an answer: there is no such width.
        assert not (np.asarray(answer) < 0).any(), f"a negative width: {answer}"

    _check_half_tangent = _check_peak_alpha = _check_half_width
    _check_from_half_tangent = _check_from_peak_alpha = _check_half_width


def _within(answer, low, high, arguments, options):
    """Raise unless an answer is in its range, where the angles are numbers."""
    phi = options.get("phi", 0.0)
    angles = [np.asarray(0.0 if phi is None else phi, float), np.asarray(arguments[0], float)]
    if all(np.isfinite(angle).all() for angle in angles):
        array = np.asarray(answer)
        assert ((array >= low) & (array <= high)).all(), f"an answer out of range: {answer}"


API = _Api()
