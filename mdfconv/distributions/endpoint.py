"""The ends of a conversion: a distribution, and the form in which its parameter is stored.

Here are the look-up of both by name, and the exact relations between two distributions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.distributions import Distribution, distribution, one_parameter_distribution
from mdfconv.distributions.dialects import DIALECTS, SAME, Dialect, Specular, dialects_of
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.distributions.parameter import Encoding, Pairing, Parameter
from mdfconv.errors import MdfconvError
from mdfconv.registry import unknown_name

DEFAULT_ENCODING = "alpha"
# Of a parameter: the step over which the slope of an encoding is taken.
_STEP = 1e-6


@dataclass(frozen=True)
class Endpoint:
    """A distribution and, where the value is stored in another form, its encoding."""

    distribution: Distribution
    encoding: Encoding | None = None
    # What to know of the name by which the user called it.
    caution: str = field(default="", compare=False)

    @property
    def label(self) -> str:
        """The name as the user may write it, such as ``"ggx:roughness"``."""
        suffix = f":{self.encoding.name}" if self.encoding else ""
        return f"{self.distribution.name}{suffix}"

    @property
    def pairing(self) -> Pairing | None:
        """How a pair is stored, unless each axis is stored by itself."""
        return self.encoding.pairing if self.encoding else None

    @property
    def stored(self) -> Parameter:
        """Name, symbol and ranges of the number that the user gives or gets."""
        return self.encoding.stored if self.encoding else self.distribution.parameter

    def text(self, value: float) -> str:
        """Return the number that the user gives or gets behind its symbol, as in ``"α 0.2"``."""
        # Without an exponent, which the second rounding does.
        return f"{self.stored.symbol} {float(f'{value:.4g}'):.10g}"

    def decode_one(self, value: float) -> float:
        """Return the parameter for a single stored value; raise if it is illegal."""
        return float(self.decode(self.stored.check_one(value, self.label)))

    def decode(self, values: ArrayLike) -> Array:
        """Return the parameters (float64) for stored values; raise if one is illegal."""
        for text, which in self.clamped(np.asarray(values)).items():
            if np.any(which):
                raise MdfconvError(f"{self.label} has no inverse here: {text}")
        stored = np.asarray(self.stored.check(values, self.label), dtype=np.float64)
        with np.errstate(all="ignore"):
            parameter = self.encoding.decode(stored) if self.encoding else stored
        mdf = self.distribution
        return np.asarray(mdf.parameter.check(parameter, mdf.name))

    def decode_legal(self, values: Array) -> Array:
        """Return the parameters for stored values (float64); NaN for those that are illegal."""
        values = self.stored.only_accepted(values)
        if not self.encoding:
            return values
        clamped = self.encoding.clamped(values)
        values = np.where(clamped, np.nan, values) if clamped.any() else values
        with np.errstate(all="ignore"):
            return self.distribution.parameter.only_accepted(self.encoding.decode(values))

    def encode(self, parameter: Array) -> Array:
        """Return the stored values for parameters; NaN for what is illegal or cannot be stored."""
        if not self.encoding:
            return self.distribution.parameter.only_accepted(parameter)
        with np.errstate(all="ignore"):
            stored = self.encoding.encode(parameter)
        legal = self.distribution.parameter.accepts(parameter)
        legal = legal & (self.stored.accepts(stored) | self.encoding.clamped(stored))
        return stored if legal.all() else np.where(legal, stored, np.nan)

    def encode_one(self, parameter: float) -> tuple[float | None, float | None]:
        """Return the stored value of a parameter and how much it changes with it, |ds/dp|.

        Either is None where it cannot be stored.
        """
        value, below, above = self.encode(parameter * np.array([1, 1 - _STEP, 1 + _STEP])).tolist()
        slope = abs(above - below) / (2 * _STEP * parameter)
        return None if np.isnan(value) else value, None if np.isnan(slope) else slope

    def clamped(self, stored: Array) -> dict[str, Mask]:
        """Return what stored numbers stand for that have no inverse, in words, and which they are.

        Such a word is ``"r = 0 is any N ≥ 1000"``.
        """
        if not self.encoding:
            return {}
        symbols = self.stored.symbol, self.distribution.parameter.symbol
        return {clamp.text(*symbols): stored == clamp.stored for clamp in self.encoding.clamps}

    def axes(self, values: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return what is stored for each axis by itself; raise if a second number is illegal."""
        if not (self.encoding and self.pairing) or len(values) == 1:
            return values
        first = np.asarray(self.stored.check(values[0], self.label), dtype=np.float64)
        second = np.asarray(self.pairing.second.check(values[1], self.label), dtype=np.float64)
        x, y = self.pairing.axes(first, second)
        if not np.all(self.stored.accepts(x)):
            alpha = float(np.max(self.encoding.decode(x)))
            symbol = self.distribution.parameter.symbol
            raise MdfconvError(
                f"{self.label}: {symbol} along x would be {alpha:.4g}, outside "
                f"{self.distribution.parameter.legal}",
                f"a smaller {self.stored.name} or {self.pairing.second.name} has one",
            )
        return _plain(x), _plain(y)

    def pair(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Return the pair for what is stored for each axis by itself; raise if there is none."""
        if not self.pairing:
            return x, y
        with np.errstate(all="ignore"):
            first, second = self.pairing.pair(np.asarray(x, float), np.asarray(y, float))
        if not np.all(self.stored.accepts(first) & self.pairing.second.accepts(second)):
            raise MdfconvError(
                f"{self.label} has no such pair: its {self.pairing.second.name} is "
                f"{self.pairing.second.legal}, and x is the rougher axis"
            )
        return _plain(first), _plain(second)


def _plain(numbers: Array) -> Any:
    """Return an array, or the float that it is without dimensions."""
    return numbers if np.ndim(numbers) else float(numbers)


def endpoint(name: str | Endpoint) -> Endpoint:
    """Return the endpoint for a name such as ``"ggx"`` or ``"ggx:roughness"``."""
    if isinstance(name, Endpoint):
        return name
    if not isinstance(name, str):
        raise MdfconvError(f"a distribution is named by a string, not {name!r}")
    head, colon, tail = name.partition(":")
    owner = _owner(head)
    if colon:
        form = forms_of(owner).get(tail.strip().lower())
        caution = form.caution if isinstance(form, Dialect) else ""
        return Endpoint(owner, _encoding(owner, tail), caution)
    return Endpoint(owner, caution=owner.ambiguous.get(head.strip().lower(), ""))


def one_parameter_endpoint(name: str | Endpoint) -> Endpoint:
    """Return the endpoint for a name; raise if its distribution is only for pairs of parameters."""
    end = endpoint(name)
    one_parameter_distribution(end.distribution.name)
    return end


def _owner(name: str) -> Distribution:
    """Return a distribution; an error for the name of an encoding says whose it is."""
    try:
        return distribution(name)
    except MdfconvError:
        key = name.strip().lower()
        owners = [owner for dialect in DIALECTS if dialect.name == key for owner in dialect.owners]
        if not owners:
            raise
        meant = [f"{owner}:{key}" for owner in owners]
        raise unknown_name("distribution", name, [], meant) from None


def endpoints(
    source: str | Endpoint, target: str | Endpoint, gamma: float | None = None
) -> tuple[Endpoint, Endpoint]:
    """Return both ends of a conversion, with a γ for each that has one; raise if neither has."""
    first, last = endpoint(source), endpoint(target)
    if gamma is None:
        return first, last
    if not any(end.distribution.second_parameter for end in (first, last)):
        raise MdfconvError(
            f"neither {first.distribution.name} nor {last.distribution.name} has a second "
            "parameter γ"
        )
    first, last = (
        with_gamma(end, gamma) if end.distribution.second_parameter else end
        for end in (first, last)
    )
    return first, last


def with_gamma(end: Endpoint, gamma: float | None) -> Endpoint:
    """Return an endpoint with another γ; raise `MdfconvError` if it has none or it is illegal."""
    if gamma is None:
        return end
    return replace(end, distribution=end.distribution.with_gamma(gamma))


def with_specular(source: str, target: str, specular: float | None) -> tuple[str, str]:
    """Return the names of both ends, with a specular weight for those that depend on it.

    None as the weight changes nothing; one for names that do not depend on it is refused.
    """
    if specular is None:
        return source, target
    source_with, target_with = (_with_weight(name, specular) for name in (source, target))
    if (source_with, target_with) == (source, target):
        raise MdfconvError(
            f"neither {source} nor {target} depends on a specular weight", argument="specular"
        )
    return source_with, target_with


def _with_weight(name: str, specular: float) -> str:
    head, _, tail = name.partition(":")
    dialect = dialects_of(distribution(head).name).get(tail.strip().lower())
    depends = dialect is not None and dialect.specular is not Specular.no
    return f"{name}:{specular!r}" if depends else name


def encodings_of(owner: Distribution) -> list[str]:
    """Return the names of the forms in which a parameter is stored; none if it has but one."""
    forms = list(forms_of(owner))
    # Exponents are not an α.
    named_by_itself = forms and not owner.parameter.larger_is_smoother
    return [DEFAULT_ENCODING, *forms] if named_by_itself else forms


def stored_forms(owner: Distribution) -> list[tuple[Endpoint, Dialect | None]]:
    """Return every form but the parameter itself, and the dialect that it is, if it is one.

    A rule that needs a setting is given a usual one.
    """
    forms: list[tuple[Endpoint, Dialect | None]] = []
    for name, form in forms_of(owner).items():
        dialect = form if isinstance(form, Dialect) else None
        forms.append(
            (Endpoint(owner, _encoding(owner, dialect.example if dialect else name)), dialect)
        )
    return forms


def dialect_of(end: Endpoint) -> Dialect | None:
    """Return the dialect that an endpoint names; None if its form belongs to no program."""
    name = end.encoding.name.partition(":")[0] if end.encoding else ""
    return dialects_of(end.distribution.name).get(name)


def texels_of(end: Endpoint) -> str:
    """Return what textures of a program hold that stores numbers so; "" if it is not known.

    It is the name of an endpoint: a program may store a number by its rule, and textures as they
    are.
    """
    dialect = dialect_of(end)
    return end.label if dialect is None or dialect.texels == SAME else dialect.texels


def forms_of(owner: Distribution) -> dict[str, Encoding | Dialect]:
    """Return the stored forms of a parameter by their names, its own first."""
    own = {encoding.name: encoding for encoding in owner.encodings}
    return own | dialects_of(owner.name)


def _encoding(owner: Distribution, name: str) -> Encoding | None:
    key, _, setting = (part.strip().lower() for part in name.partition(":"))
    known = encodings_of(owner)
    if not known:
        raise MdfconvError(
            f"{owner.name} has no encoding '{name}': its {owner.parameter.name} "
            f"{owner.parameter.symbol} is given as it is"
        )
    if key not in known:
        meant = [owner.meant_by[key]] if key in owner.meant_by else []
        raise unknown_name(f"encoding of {owner.name}", name, known, meant)
    form = forms_of(owner).get(key)
    if isinstance(form, Dialect):
        return form.encoding(owner.parameter, setting)
    if setting:
        raise MdfconvError(f"{owner.name}:{key} takes no '{setting}'")
    return form


@dataclass(frozen=True)
class ParameterMap:
    """A formula from one distribution's parameter to another's, and where it stops being monotonic.

    The text has its place in the source; it is empty where there is nothing to say.
    """

    text: str
    function: Callable[[Array], Array]
    turns_at: float = float("inf")


Steps: TypeAlias = Sequence[ParameterMap]


def to_root(mdf: Distribution, *, same_lobe: bool) -> tuple[Distribution, Steps, Steps]:
    """Return the distribution in whose parameter another one can be expressed, the steps and back.

    A distribution is its own root unless it declares an equivalent, which may have to have the
    same lobes.
    """
    equal = mdf.equivalent
    if equal is None or (same_lobe and not equal.same_lobe):
        return mdf, (), ()
    forward = ParameterMap(equal.forward_text, equal.forward)
    backward = ParameterMap(equal.backward_text, equal.backward)
    return distribution(equal.name), (forward,), (backward,)


def exact_route(source: Distribution, target: Distribution) -> Steps | None:
    """Return the steps between two distributions that have the same lobes; None for others."""
    if source.is_same(target):
        return ()
    first, forward, _ = to_root(source, same_lobe=True)
    last, _, back = to_root(target, same_lobe=True)
    return (*forward, *back) if first.is_same(last) else None


def follow(steps: Steps, parameter: Array) -> Array:
    """Return what the steps make of parameters, one after the other; infinite at an end of both."""
    with np.errstate(all="ignore"):
        for step in steps:
            parameter = step.function(parameter)
    return parameter
