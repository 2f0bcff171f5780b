"""Which channels of a picture are meant."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mdfconv.errors import MdfconvError

_GREY = ("y", "l", "grey", "gray")


def find_channels(path: Path, names: Sequence[str], wanted: str | None) -> tuple[int, ...]:
    """Return which channels are to be converted.

    Parameters
    ----------
    path : Path
        The picture, for messages.
    names : sequence of str
        Its channels.
    wanted : str or None
        One name, several with commas between, or letters that are names each, as ``"rgb"``;
        None for the only one. Case does not matter where it does not tell two apart, and grey
        has several names.

    Raises
    ------
    MdfconvError
        If the picture has no such channel, or several and none was chosen.
    """
    known = ", ".join(name.lower() if len(name) == 1 else name for name in names)
    if wanted is None:
        if len(names) != 1:
            raise MdfconvError(
                f"{path} has the channels {known}", "choose one channel", argument="channel"
            )
        return (0,)
    whole = _find(names, wanted)
    parts = wanted.split(",") if "," in wanted else list(wanted)
    found = [whole] if whole is not None else [_find(names, part) for part in parts]
    indices = tuple(index for index in found if index is not None)
    if not indices or len(set(indices)) != len(found):
        raise MdfconvError(f"{path} has no channel '{wanted}'", f"its channels are {known}")
    return indices


def _find(names: Sequence[str], wanted: str) -> int | None:
    if wanted in names:
        return names.index(wanted)
    keys = [_key(name) for name in names]
    return keys.index(_key(wanted)) if keys.count(_key(wanted)) == 1 else None


def _key(name: str) -> str:
    key = name.strip().lower()
    return "grey" if key in _GREY else key
