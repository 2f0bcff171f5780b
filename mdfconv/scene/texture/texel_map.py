"""Texels of one type converted: through a table, dithered, and counted for the report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from mdfconv.errors import MdfconvError
from mdfconv.scene.stored import Outcome
from mdfconv.scene.texture.rule import TextureRule, ValueConverter

# Rows that are rounded together, of a narrow picture: the memory grows with their square.
_ROWS = 256
# Shares of the neighbours: right, and below to the left, in the middle and to the right.
_SHARES = tuple(np.float32(part / 16) for part in (7, 3, 5, 1))


class ErrorDiffusion:
    """Rounding to 8 bits that hands each texel's error to its neighbours (Floyd & Steinberg 1976).

    The error of a texel goes by 7/16 to the right, 3/16, 5/16 and 1/16 to the left, middle and
    right below. It is at most half a level, and only what leaves the picture is lost: the sums
    before and after differ by at most half a level for each texel of the last row and the two
    edges.
    """

    def __init__(self, width: int) -> None:
        self._width = width
        # Of the row above, from x = −1.
        self._above = np.zeros(width + 2, np.float32)

    def __call__(self, levels: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Round the next rows of a picture, in units of the level from 0 to 255."""
        if levels.size == 0:
            return levels.astype(np.uint8)
        step = max(_ROWS, self._width)
        parts = [self._round(levels[top : top + step]) for top in range(0, len(levels), step)]
        return np.concatenate(parts)

    def _round(self, levels: NDArray[np.float32]) -> NDArray[np.uint8]:
        rows, width = levels.shape
        # Texels with the same x + 2y wait for none of each other: they are one row of the
        # sheared picture, and one step.
        steps = width + 2 * (rows - 1)
        sheared = np.zeros((steps, rows), np.float32)
        shear = (sheared.strides[0] * 2 + sheared.strides[1], sheared.strides[0])
        picture = as_strided(sheared, levels.shape, shear)
        picture[...] = levels
        # Three steps before the first, and in front of every step the row above.
        error = np.zeros((steps + 3, rows + 1), np.float32)
        error[: width + 2, 0] = self._above
        self._diffuse(sheared, error)
        self._above[1:-1] = error[3 + 2 * (rows - 1) :, rows]
        return picture.astype(np.uint8)

    def _diffuse(self, sheared: NDArray[np.float32], error: NDArray[np.float32]) -> None:
        """Round the sheared picture in place, step by step."""
        rows = sheared.shape[1]
        part = np.empty(rows, np.float32)
        for step in range(sheared.shape[0]):
            first = max(0, (step - self._width) // 2 + 1)
            last = min(rows, step // 2 + 1)
            one, two, three = error[step + 2], error[step + 1], error[step]
            value, share = sheared[step, first:last], part[first:last]
            above = one[first:last], two[first:last], three[first:last]
            for source, weight in zip((one[first + 1 : last + 1], *above), _SHARES, strict=True):
                np.multiply(source, weight, out=share)
                value += share
            np.rint(value, out=share)
            np.clip(share, 0, 255, out=share)
            np.subtract(value, share, out=error[step + 3, first + 1 : last + 1])
            value[...] = share


BLOCK = 1 << 19  # texels converted at a time
BINS = 256  # of a histogram
DEPTHS = (8, 16)  # bits of an integer texel
# Types of which every value fits into a table.
_TABLED = (np.dtype(np.uint8), np.dtype(np.uint16), np.dtype(np.float16))
_TYPES = (*_TABLED, np.dtype(np.float32), np.dtype(np.float64))


def result_type(dtype: np.dtype[Any], depth: int | None, dither: bool) -> np.dtype[Any]:
    """Return the type of the converted texels, of so many bits; None keeps that of a texture."""
    native = dtype.newbyteorder("=")
    if native not in _TYPES:
        names = ", ".join(known.name for known in _TYPES)
        raise MdfconvError(f"a texture is an array of {names}, not {dtype.name}")
    if depth is not None:
        if depth not in DEPTHS:
            raise MdfconvError(f"the depth of a texture is 8 or 16 bits, not {depth}")
        if native.kind == "f":
            raise MdfconvError("a depth is for integers: a texture of floats keeps its type")
        native = np.dtype(f"u{depth // 8}")
    if dither and native != np.uint8:
        raise MdfconvError(f"dither is for results of 8 bits, not for {native.name}")
    return native


@dataclass(frozen=True)
class TextureReport:
    """What a conversion did to a texture.

    Parameters
    ----------
    source, target : str
        Distribution and encoding.
    keeps : str
        What the conversion keeps, in words; "" if the two are the same lobes.
    texels : int
        How many were converted.
    outcomes : dict of Outcome to int
        How many were answered, and how many were treated as `ValueConverter` says.
    before, after : numpy.ndarray of int, shape (256,)
        Histograms of the stored values from 0 to 1; without NaN.
    levels : tuple of two int
        Of a result rounded to 8 bits, how many different texels it has, and how many it would
        have with 16 bits, but for no more than 256; (0, 0) of others.
    channels : str
        Which channels of a file were converted, such as ``"green"``, or ``"green from alpha"``;
        "" if it has but one.
    remarks : tuple of str
        What else the user must know.
    """

    source: str
    target: str
    keeps: str
    texels: int
    outcomes: dict[Outcome, int]
    before: NDArray[np.int64]
    after: NDArray[np.int64]
    levels: tuple[int, int] = (0, 0)
    channels: str = ""
    remarks: tuple[str, ...] = ()

    def notes(self, *, limits: bool = True) -> list[str]:
        """Return what the user must know; `limits` includes mirrors and the roughest."""
        source, target = self.source, self.target
        texts = {
            Outcome.MIRROR: f"perfect mirrors in {source}: they get the smoothest {target}",
            Outcome.UNIFORM: f"as rough as can be in {source}: they get the roughest {target}",
            Outcome.UNANSWERED: "without an answer by the method, clamped to the nearest",
            Outcome.BEYOND: f"clamped: their results are outside 0..1 in {target}",
            Outcome.OUTSIDE: f"clamped: they are outside 0..1 in {source}",
            Outcome.NAN: "NaN, and left so",
        }
        if not limits:
            del texts[Outcome.MIRROR], texts[Outcome.UNIFORM]
        counts = [
            f"{self.outcomes[outcome]} of {self.texels} texels are {text}"
            for outcome, text in texts.items()
            if self.outcomes[outcome]
        ]
        return [*counts, *self.remarks]

    def lost_levels(self) -> str:
        """Return how many levels remain in 8 bits, if fewer than half do; else ""."""
        left, levels = self.levels
        return f"{left} of {levels} levels remain" if 2 * left < levels else ""


def draw_histograms(report: TextureReport, title: str, dpi: int = 150) -> bytes:
    """Return a PNG of the stored values before and after, as shares of the texels."""
    from mdfconv.output.figures import PAGE, encoded, line_style, new_figure

    figure = new_figure(*PAGE)
    panels = figure.subplots(2, 1, sharex=True, sharey=True)
    edges = np.linspace(0, 1, BINS + 1)
    histograms = (report.source, report.before), (report.target, report.after)
    for panel, (name, counts) in zip(panels, histograms, strict=True):
        color = line_style(name.partition(":")[0])["color"]
        shares = 100 * counts / max(1, counts.sum())
        panel.stairs(shares, edges, fill=True, color=color, alpha=0.35)
        panel.stairs(shares, edges, color=color, linewidth=1)
        panel.set_ylabel("texels [%]")
        panel.set_xlabel(f"stored value, {name}")
        panel.tick_params(labelbottom=True)
    # A texture of few values has spikes; a root shows what is between them.
    panels[0].set_yscale("function", functions=(np.sqrt, np.square))
    panels[0].set_xlim(0, 1)
    panels[0].set_title(title)
    return encoded(figure, dpi=dpi)


class _ValueTable:
    """What becomes of every value of a short type, and how often each was met."""

    def __init__(self, convert: ValueConverter, dtype: np.dtype[Any]) -> None:
        self._key = np.dtype(f"u{dtype.itemsize}")
        self._texels = np.arange(1 << 8 * dtype.itemsize).astype(self._key).view(dtype)
        stored = self._texels.astype(np.float64)
        if dtype.kind == "u":
            stored /= stored[-1]
        self.values, self._outcomes = convert(stored)
        self._counts = np.zeros(stored.size, np.int64)

    def keys(self, texels: NDArray[Any]) -> NDArray[Any]:
        """Return the places of texels in the table, and count them."""
        keys = texels.view(self._key)
        self._counts += np.bincount(keys.ravel(), minlength=self._counts.size)
        return keys

    def outcomes(self) -> NDArray[np.int64]:
        """Return how often there was each outcome."""
        return _sums(self._outcomes, self._counts, len(Outcome))

    def levels(self, most: int) -> int:
        """Return how many levels, from 0 to `most`, the texels that were met become."""
        return np.unique(np.rint(self.values[self._counts > 0] * most)).size

    def histogram(self) -> NDArray[np.int64]:
        """Return the histogram of the texels that were met."""
        known = ~np.isnan(self._texels)
        return _sums(_bins(self._texels[known]), self._counts[known], BINS)


class TexelMap:
    """A rule on texels of one type; integers and halves go through a table.

    With the width of a row the errors of rounding are diffused, in each channel by themselves.
    """

    def __init__(
        self,
        rule: TextureRule,
        dtype: np.dtype[Any],
        depth: int | None,
        width: int | None = None,
        *,
        channels: int = 1,
    ) -> None:
        self.dtype = result_type(dtype, depth, width is not None)
        self.source_dtype = dtype.newbyteorder("=")
        self._convert = ValueConverter(rule)
        self._dither = [] if width is None else [ErrorDiffusion(width) for _ in range(channels)]
        self._outcomes = np.zeros(len(Outcome), np.int64)
        self._before, self._after = (np.zeros(BINS, np.int64) for _ in range(2))
        tabled = self.source_dtype in _TABLED
        self._table = _ValueTable(self._convert, self.source_dtype) if tabled else None
        self._results = self._stored(self._table.values) if self._table else np.empty(0)

    def __call__(self, block: NDArray[Any], channel: int = 0) -> NDArray[Any]:
        """Convert some texels, any shape; with dither the next rows of a channel."""
        texels = block.astype(self.source_dtype, copy=False)
        if self._table:
            converted = self._results[self._table.keys(texels)]
            if self._dither:
                converted = self._dither[channel](converted)
        else:
            with np.errstate(invalid="ignore"):  # NaN that signals is NaN, too
                doubles = texels.astype(np.float64)
            values, outcomes = self._convert(doubles)
            converted = self._stored(values)
            self._outcomes += np.bincount(outcomes.ravel(), minlength=len(Outcome))
            self._before += _histogram(texels)
        self._after += _histogram(converted)
        return converted

    def _stored(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return results in their type, or in its levels if they are to be dithered."""
        if self.dtype.kind == "f":
            return values.astype(self.dtype)
        levels = values * np.iinfo(self.dtype).max
        return levels.astype(np.float32) if self._dither else np.rint(levels).astype(self.dtype)

    def report(self) -> TextureReport:
        """Return what was done so far."""
        outcomes = self._table.outcomes() if self._table else self._outcomes
        return TextureReport(
            *self._convert.labels,
            self._convert.keeps,
            texels=int(outcomes.sum()),
            outcomes=dict(zip(Outcome, outcomes.tolist(), strict=True)),
            before=self._table.histogram() if self._table else self._before.copy(),
            after=self._after.copy(),
            levels=self._levels(),
        )

    def _levels(self) -> tuple[int, int]:
        """Return how many levels there are, and how many there were with 16 bits."""
        if self.dtype != np.uint8 or self._table is None or self._dither:
            return 0, 0
        deep = self._table.levels(np.iinfo(np.uint16).max)
        return self._table.levels(np.iinfo(np.uint8).max), min(BINS, deep)


def _sums(places: NDArray[Any], counts: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """Return sums of counts by their places."""
    return np.bincount(places, counts, size).astype(np.int64)


def _histogram(texels: NDArray[Any]) -> NDArray[np.int64]:
    known = texels if texels.dtype.kind == "u" else texels[~np.isnan(texels)]
    return np.bincount(_bins(known).ravel(), minlength=BINS)


def _bins(texels: NDArray[Any]) -> NDArray[Any]:
    """Return which of 256 bins from 0 to 1 each texel falls into."""
    if texels.dtype == np.uint8:
        return texels
    if texels.dtype == np.uint16:
        return texels >> 8
    scaled = np.clip(texels, 0, 1) * (BINS - 1)
    return np.rint(scaled).astype(np.uint8)
