"""What languages write of a formula: expressions, names for all in them, and what to know."""

from __future__ import annotations

import keyword
import re
import unicodedata
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mdfconv import __version__
from mdfconv.distributions.endpoint import Endpoint
from mdfconv.distributions.parameter import number_text
from mdfconv.formula.exact import ExactRelation, StoredNumber
from mdfconv.formula.expression import Expression, variable
from mdfconv.formula.family import Formula, evaluate
from mdfconv.formula.search import SearchProblem, is_glossy

# What an argument cannot be called: words of the emitted code, and of the languages. Words with
# digits or capitals are not listed, as no argument has any.
_WORDS = """
    u v w sqrt sqrtf rsqrt inversesqrt clamp fminf fmaxf np

    active alias alignas alignof asm asm_fragment ast async atomic atomic_uint attribute auto await
    become bitcast bool break buffer case cast catch cbuffer centroid char class closure coherent
    color column_major common compile compile_fragment const const_assert const_cast constant
    constexpr constinit continue continuing coroutine default delete demote device diagnostic
    discard displacement do double dword dynamic_cast else emit enable enum explicit export extends
    extern external fallthrough false filter final finally fixed flat float fn for fragment friend
    from fxgroup get goto groupshared half handle highp if illuminance illuminate impl implements
    import in inline inout input instanceof int interface interpolate invariant kernel layout let
    light line lineadj linear long loop lowp macro macro_rules match matrix mediump meta metal mod
    module move mut mutable namespace nil noinline nointerpolation noperspective normal noexcept
    nullptr of operator out output override package packoffset partition pass patch pixelfragment
    point precise precision premerge private protected ptr pub public readonly ref regardless
    register reinterpret_cast requires resource restrict return row_major sample sampler self set
    shader shared short signed sizeof smooth snorm static static_assert static_cast std stateblock
    storage string struct subroutine super superp surface switch target tbuffer technique template
    texture this thread thread_local threadgroup throw trait triangle triangleadj true try type
    typedef typeid typename typeof uint uniform union unless unorm unsafe unsigned unsized use
    using var varying vector vertex vertexfragment virtual void volatile volume wgsl where while
    with workgroup write writeonly yield
"""
_TAKEN = {*_WORDS.split(), *keyword.kwlist}


@dataclass(frozen=True)
class Code:
    """What languages write: an expression for each result, of the same arguments.

    Parameters
    ----------
    ends : tuple of two Endpoint
        Source and target.
    arguments, results : list of StoredNumber
        What the source stores, in the range in which the code holds, and what the target stores.
    expressions : list of Expression
        Those of the results; the names of their variables are those of the arguments.
    facts : list of str
        What a reader must know, in ASCII.
    """

    ends: tuple[Endpoint, Endpoint]
    arguments: Sequence[StoredNumber]
    results: Sequence[StoredNumber]
    expressions: Sequence[Expression]
    facts: Sequence[str]

    def function_name(self, results: Sequence[StoredNumber]) -> str:
        """Return an identifier that says what of what is computed, and γ if it is not the usual."""
        source, target = map(_end_name, self.ends)
        made, given = (" ".join(one.name for one in some) for some in (results, self.arguments))
        return _identifier(f"{target} {made} from {source} {given}")


class Language(ABC):
    """A language in which formulas are written; `comment` is what starts a line of comment."""

    comment: str = "//"

    def remark(self, text: str) -> str:
        """Return a line of comment."""
        return f"{self.comment} {text}"

    @abstractmethod
    def lines(self, code: Code) -> list[str]:
        """Return what is pasted."""

    @abstractmethod
    def short(self, code: Code) -> str:
        """Return what is computed, in one line."""

    def one_line(self, formula: Formula, problem: SearchProblem) -> str:
        """Return what a formula computes, in one line."""
        return self.short(fitted_code(formula, problem))


def fitted_code(formula: Formula, problem: SearchProblem) -> Code:
    """Return what is written of a formula that was searched for."""
    given, made = problem.source.stored, problem.target.stored
    name = argument_name(given.name)
    w = variable(name)
    if not formula.shape.is_constant:
        clamped = np.clip(w, problem.low, problem.high)
        w = (1 - clamped if is_glossy(problem.source) else clamped).named("w")
    value = evaluate(formula, w, np.power, Expression.named)
    within = replace(
        given, lower=problem.low, upper=problem.high, lower_closed=True, upper_closed=True
    )
    return Code(
        (problem.source, problem.target),
        [StoredNumber(name, given.symbol, within)],
        [StoredNumber(_identifier(made.name), made.symbol, made)],
        [1 - value if is_glossy(problem.target) else value],
        _facts(formula, problem),
    )


def exact_code(relation: ExactRelation) -> Code:
    """Return what is written of an exact relation; raise `MdfconvError` if it is no formula."""
    arguments = [
        replace(one, name=argument_name(one.name)) for one in relation.stored(relation.source)
    ]
    return Code(
        (relation.source, relation.target),
        arguments,
        [replace(one, name=_identifier(one.name)) for one in relation.stored(relation.target)],
        relation.expressions([one.name for one in arguments]),
        _exact_facts(relation),
    )


def argument_name(name: str) -> str:
    """Return a parameter's name as that of an argument, ``_value`` after what has a meaning."""
    identifier = _identifier(name).lower()
    plain = identifier not in _TAKEN and not any(map(str.isdigit, identifier))
    return identifier if plain else f"{identifier}_value"


def _identifier(text: str) -> str:
    # In GLSL two underscores in a row are reserved.
    words = re.findall("[A-Za-z0-9]+", ascii_text(text))
    return "_".join(words if words and words[0][0].isalpha() else ["f", *words])


def _end_name(end: Endpoint) -> str:
    """Return the distribution, γ if it is not the usual, and the form if its number does not say.

    The number that is stored follows.
    """
    owner, second = end.distribution, end.distribution.second_parameter
    words = [owner.name]
    if second and owner.gamma != second.default:
        words.append(f"{second.name} {number_text(owner.gamma)}")
    if end.encoding and end.encoding.name != end.stored.name:
        words.append(end.encoding.name)
    return " ".join(words)


def ascii_text(text: str, greek: str = "{}") -> str:
    """Return a text with its Greek letters spelled, in a form such as ``<{}>``."""
    text = text.replace("≤", "<=").replace("≥", ">=")
    return "".join(
        letter if letter.isascii() else greek.format(unicodedata.name(letter).split()[-1].lower())
        for letter in text
    )


def _facts(formula: Formula, problem: SearchProblem) -> list[str]:
    """Return what a reader of the code must know, in ASCII."""
    metric = problem.metric
    # A metric may be named after a file; a comment is one line.
    named = "".join(letter if letter.isprintable() else "?" for letter in str(metric))
    low, high = number_text(problem.low), number_text(problem.high)
    of = " of 1 - g" if is_glossy(problem.target) else ""
    source, target = (_end_text(end, end.stored.symbol) for end in (problem.source, problem.target))
    return [
        f"{source} to {target}, for {low} to {high}; outside, the input is clamped.",
        f"Least squares under the {named} metric: keeps the {metric.keeps}.",
        f"Worst relative error{of} {formula.error:.2g} in float32; {formula.shape.operations} "
        "operations (+ - * count 1, clamp 2, / sqrt 1/sqrt 4).",
        f"By mdfconv {__version__}.",
    ]


def _exact_facts(relation: ExactRelation) -> list[str]:
    """Return what a reader of the code must know, in ASCII."""
    texts, ranges = [], []
    for end in (relation.source, relation.target):
        stored = relation.stored(end)
        texts.append(_end_text(end, ", ".join(one.symbol for one in stored)))
        legal = (replace(one.parameter, symbol=one.symbol).legal for one in stored)
        ranges.append(ascii_text(", ".join(legal)))
    facts = [f"{' to '.join(texts)}: exact where {' and '.join(ranges)}."]
    if relation.is_pair:
        facts.append("The two axes of a surface; x is the rougher one.")
    for end in (relation.source, relation.target):
        symbols = end.stored.symbol, end.distribution.parameter.symbol
        clamps = end.encoding.clamps if end.encoding else ()
        facts += [f"{end.label}: {ascii_text(clamp.text(*symbols))}." for clamp in clamps]
    return [*facts, f"By mdfconv {__version__}."]


def _end_text(end: Endpoint, symbols: str) -> str:
    owner, second = end.distribution, end.distribution.second_parameter
    gamma = f" at {second.symbol} = {number_text(owner.gamma)}" if second else ""
    return ascii_text(f"{end.label} {symbols}{gamma}")
