"""The channels of pictures: which are chosen by name, and into which their conversions go."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdfconv.errors import MdfconvError

if TYPE_CHECKING:
    from mdfconv.scene.texture.images import Picture
    from mdfconv.scene.texture.texel_map import TexelMap

GREY, ALPHA = "Y", "A"
_GREY_NAMES = ("y", "l", "grey", "gray")
_COLOURS = ("R", "G", "B")
_WORDS = {"R": "red", "G": "green", "B": "blue", ALPHA: "alpha", GREY: "grey"}


class Layout(NamedTuple):
    """The channels of a picture, and from which channel of its file each comes."""

    names: tuple[str, ...]
    places: tuple[int, ...]

    def with_alpha(self) -> Layout:
        """Return it with an alpha, which all get that is not replaced from the first channel."""
        return Layout((*self.names, ALPHA), (*self.places, 0))

    def with_colours(self) -> Layout:
        """Return it with red, green and blue in the place of grey."""
        at = _find(self.names, GREY)
        names, places = list(self.names), list(self.places)
        if at is not None:
            names[at : at + 1] = _COLOURS
            places[at : at + 1] = 3 * [places[at]]
        return Layout(tuple(names), tuple(places))


class Channels(NamedTuple):
    """Some channels of a layout, by their numbers in it."""

    layout: Layout
    indices: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """What the file calls them."""
        return tuple(self.layout.names[index] for index in self.indices)

    @property
    def places(self) -> tuple[int, ...]:
        """From which channels of the file they come."""
        return tuple(self.layout.places[index] for index in self.indices)

    def __str__(self) -> str:
        return ", ".join(_WORDS.get(name, name) for name in self.names)


def find_channels(
    picture: Picture, chosen: str | None, argument: str = "channel", *, new: bool = False
) -> Channels:
    """Return which channels of a picture an argument chooses.

    Chosen is one name, several with commas between, or letters that are names each, as ``"rgb"``;
    None for the only one. Case does not matter where it does not tell two apart, and grey has
    several names. Grey is red, green and blue where one of these is chosen; alpha may be `new`.
    """
    names = picture.layout.names
    known = ", ".join(name.lower() if len(name) == 1 else name for name in names)
    if chosen is None:
        if len(names) == 1:
            return Channels(picture.layout, (0,))
        reason = f"{picture.source} has the channels {known}"
        raise MdfconvError(reason, "choose one channel", argument=argument)
    for layout in _layouts(picture, new=new):
        if indices := _find_all(layout.names, chosen):
            return Channels(layout, indices)
    raise MdfconvError(f"{picture.source} has no channel '{chosen}'", f"its channels are {known}")


def _layouts(picture: Picture, *, new: bool) -> Iterator[Layout]:
    """Yield how the channels of a picture may be taken, the natural way first."""
    layouts = [picture.layout]
    if picture.whole != picture.layout:
        layouts.append(picture.whole)
    elif new and _find(picture.layout.names, ALPHA) is None:
        layouts.append(picture.layout.with_alpha())
    yield from layouts
    for layout in layouts:
        is_grey = _find(layout.names, GREY) is not None
        if is_grey and all(_find(layout.names, name) is None for name in _COLOURS):
            yield layout.with_colours()


def _find_all(names: Sequence[str], chosen: str) -> tuple[int, ...]:
    """Return the numbers of all names that are chosen; nothing if one is not there."""
    whole = _find(names, chosen)
    parts = chosen.split(",") if "," in chosen else list(chosen)
    places = [whole] if whole is not None else [_find(names, part) for part in parts]
    indices = tuple(index for index in places if index is not None)
    return indices if len(set(indices)) == len(places) else ()


def _find(names: Sequence[str], name: str) -> int | None:
    if name in names:
        return names.index(name)
    keys = [_key(each) for each in names]
    return keys.index(_key(name)) if keys.count(_key(name)) == 1 else None


def _key(name: str) -> str:
    key = name.strip().lower()
    return "grey" if key in _GREY_NAMES else key


class ChannelMove:
    """Which channels of one picture are converted into which of another, or of itself.

    The other has all the other channels of the result.
    """

    def __init__(
        self, source: Picture, base: Picture, channel: str | None, to_channel: str | None
    ) -> None:
        self._source, self._base = source, base
        self._chosen = self._target = find_channels(source, channel)
        self._moved = base is not source or to_channel is not None
        if self._moved:
            self._target = find_channels(base, to_channel or channel, "to_channel", new=True)
        self._check()
        self.layout = self._target.layout
        self.dtype = source.dtype_of(self._chosen.places)
        base_dtype = base.dtype_of(self._target.places)
        if self.dtype.kind != base_dtype.kind:
            kinds = {"f": "floats", "u": "integers"}
            raise MdfconvError(
                f"{source.source} holds {kinds[self.dtype.kind]}, and {base.source} "
                f"{kinds[base_dtype.kind]}"
            )

    def _check(self) -> None:
        """Refuse pictures of two sizes, and as many channels as do not go into others."""
        sizes = [f"{each.width}×{each.height}" for each in (self._source, self._base)]
        if sizes[0] != sizes[1]:
            raise MdfconvError(
                f"{self._base.source} has {sizes[1]} pixels, and {self._source.source} {sizes[0]}",
                "scale one of them to the size of the other",
            )
        if len(self._chosen.indices) != len(self._target.indices):
            raise MdfconvError(
                f"the channels {self._chosen} do not go into {self._target}",
                "name as many as are converted",
                argument="to_channel",
            )

    def remarks(self) -> Iterator[str]:
        """Yield what the user must know of how two pictures were put together."""
        tags = self._source.orientation, self._base.orientation
        if tags[0] != tags[1]:
            yield (
                f"{self._source.source} has the orientation {tags[0]} and {self._base.source} "
                f"{tags[1]}: their texels were put together as they are stored"
            )

    def __len__(self) -> int:
        return len(self._chosen.indices)

    def __str__(self) -> str:
        if len(self._chosen.layout.names) == len(self.layout.names) == 1:
            return ""
        if not self._moved or self._chosen.names == self._target.names:
            return str(self._target)
        stays = self._base is self._source and set(self._chosen.names) <= set(self.layout.names)
        return f"{self._target} from {self._chosen}{' (which stays as it is)' if stays else ''}"

    @property
    def depth(self) -> int | None:
        """The bits of the result, if it is another picture that has them."""
        other = self._base is not self._source and self.dtype.kind == "u"
        return 8 * self._base.block_dtype.itemsize if other else None

    def dtype_of_result(self, convert: TexelMap) -> np.dtype[Any]:
        """Return the type of all channels of the result together."""
        return convert.dtype if self.dtype.kind == "u" else self._base.block_dtype

    @property
    def new_alpha(self) -> bool:
        """Whether alpha is one of those that get what comes from elsewhere."""
        return self._moved and ALPHA in self._target.names

    def rows(self, top: int, bottom: int, convert: TexelMap) -> NDArray[Any]:
        """Return some rows of the result: with the converted channels, and the others kept."""
        texels = self._source.read(top, bottom)
        others = texels if self._base is self._source else self._base.read(top, bottom)
        if self.layout.names != self._base.spec.channelnames:
            others = others[..., self.layout.places]
        rows = _rescaled(others, self.dtype_of_result(convert))
        pairs = zip(self._chosen.places, self._target.indices, strict=True)
        for number, (place, index) in enumerate(pairs):
            # Of floats of several types the block has the widest.
            channel = texels[..., place].astype(self.dtype, copy=False)
            rows[..., index] = convert(channel, number)
        return rows


def _rescaled(block: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the channels that are not converted in the depth of the result."""
    if block.dtype == dtype or dtype.kind == "f":
        return block.copy()
    if dtype == np.uint16:
        return block * np.uint16(257)
    return np.rint(block / np.float32(257)).astype(np.uint8)
