"""JSON text of which some values are changed: every other character stays as it is."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from mdfconv.errors import MdfconvError
from mdfconv.scene.material_files import spliced

_BYTE_ORDER_MARK = "\ufeff"
_BLANKS = " \t\n\r"
_SPACE = re.compile(r"[ \t\n\r]*")
_KEY = re.compile(r'[ \t\n\r]*("(?:[^"\\]|\\.)*")([ \t\n\r]*:[ \t\n\r]*)', re.DOTALL)
_COMMA = re.compile(r"[ \t\n\r]*,[ \t\n\r]*")
_NUMBER = r"[ \t\n\r]*:[ \t\n\r]*([-+.0-9eE]*)"
# Python does not read integers of thousands of digits.
_DECODER, _ALL_FLOATS = json.JSONDecoder(), json.JSONDecoder(parse_int=float)


class Place(NamedTuple):
    """A value and where it stands in the text, the character after its last one included."""

    value: Any
    start: int
    end: int
    # The first character of the key; that of the value itself in an array.
    key_start: int
    # What stands between key and value.
    colon: str = ""


class JsonText:
    """The text of a JSON object, and the changes to it.

    Of several members with one name the last counts, as for most readers. The text may start with
    a byte order mark; what is no object, or nested more deeply than Python reads, is refused.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._edits: list[tuple[int, int, str]] = []
        self.start = _skip(text, text.startswith(_BYTE_ORDER_MARK))
        try:
            self.root = self._checked_members()
        except json.JSONDecodeError as error:
            raise MdfconvError(f"is no JSON: {error}") from None
        except RecursionError:
            raise MdfconvError("is JSON that is nested too deeply") from None
        self.value = {name: place.value for name, place in self.root.items()}

    def _checked_members(self) -> dict[str, Place]:
        """Return the members of the whole object; raise if anything else is in the text."""
        if not self._text.startswith("{", self.start):
            _decode(self._text, self.start)
            raise MdfconvError("is JSON, but no object")
        members = self.members(self.start)
        end = max((place.end for place in members.values()), default=self.start + 1)
        end = _skip(self._text, end)
        if not self._text.startswith("}", end):
            raise json.JSONDecodeError("Expecting a name, a colon, a comma or }", self._text, end)
        end = _skip(self._text, end + 1)
        if end < len(self._text):
            raise json.JSONDecodeError("Extra data", self._text, end)
        return members

    def members(self, start: int) -> dict[str, Place]:
        """Return the members of the object that starts at a character."""
        text, position = self._text, start + 1
        members = {}
        while match := _KEY.match(text, position):
            value, end = _decode(text, match.end())
            key = match[1]
            name = key[1:-1] if key.isprintable() and "\\" not in key else json.loads(key)
            members[name] = Place(value, match.end(), end, match.start(1), match[2])
            comma = _COMMA.match(text, end)
            if not comma:
                break
            position = comma.end()
        return members

    def elements(self, start: int) -> list[Place]:
        """Return the elements of the array that starts at a character."""
        text, position = self._text, _skip(self._text, start + 1)
        elements: list[Place] = []
        while text[position] != "]":
            value, end = _decode(text, position)
            elements.append(Place(value, position, end, position))
            comma = _COMMA.match(text, end)
            if not comma:
                break
            position = comma.end()
        return elements

    def text_of(self, place: Place) -> str:
        """Return a value as it stands in the text, without the changes."""
        return self._text[place.start : place.end]

    def numbers_named(self, name: str, place: Place) -> list[tuple[int, int]] | None:
        """Return where the numbers of all members of one name stand, however deeply.

        Start and end are the same for what is no number; None if names may be written in escapes.
        It takes a tenth of the time of looking at every member.
        """
        if self._text.find("\\u", place.start, place.end) >= 0:
            return None
        key = re.compile(f'"{name}"{_NUMBER}')
        return [
            match.span(1)
            for match in key.finditer(self._text, place.start, place.end)
            if self._text[match.start() - 1] != "\\"
        ]

    def replace(self, start: int, end: int, value: str) -> None:
        """Replace a value by one in JSON."""
        self._edits.append((start, end, value))

    def set_members(
        self, start: int, values: Mapping[str, str], renamed: Mapping[str, str] | None = None
    ) -> None:
        """Replace members of the object at a character, or add them behind its last one.

        The values are in JSON; what is added is in the object's layout. Members may get new names.
        """
        members = self.members(start)
        for name, new_name in (renamed or {}).items():
            key_start = members[name].key_start
            key_end = members[name].start - len(members[name].colon)
            self._edits.append((key_start, key_end, json.dumps(new_name)))
        for name in values.keys() & members.keys():
            self._edits.append((members[name].start, members[name].end, values[name]))
        added = [name for name in values if name not in members]
        if not members:
            self._edits.append((start + 1, start + 1, object_text(values)[1:-1]))
        elif added:
            last = max(members.values(), key=lambda place: place.end)
            texts = [f"{json.dumps(name)}{last.colon}{values[name]}" for name in added]
            self._add_behind(last, texts)

    def append(self, start: int, values: Sequence[str]) -> None:
        """Add values in JSON behind the last of an array, which is not empty, in its layout."""
        self._add_behind(self.elements(start)[-1], values)

    def _add_behind(self, last: Place, texts: Sequence[str]) -> None:
        blank = last.key_start
        while self._text[blank - 1] in _BLANKS:
            blank -= 1
        before = f",{self._text[blank : last.key_start]}"
        self._edits.append((last.end, last.end, "".join(before + text for text in texts)))

    def changed(self) -> str:
        """Return the text with all changes."""
        return spliced(self._text, self._edits)


def object_text(members: Mapping[str, str]) -> str:
    """Return an object of members in JSON."""
    texts = (f"{json.dumps(name)}: {value}" for name, value in members.items())
    return f"{{{', '.join(texts)}}}"


def read_json(data: bytes) -> JsonText:
    """Return the JSON that bytes hold."""
    try:
        return JsonText(data.decode())
    except UnicodeDecodeError as error:
        raise MdfconvError(f"is no JSON: byte {error.start} is not UTF-8") from None


def _decode(text: str, start: int) -> tuple[Any, int]:
    """Return the value at a character, and where it ends."""
    try:
        return _DECODER.raw_decode(text, start)
    except json.JSONDecodeError:
        raise
    except ValueError:
        return _ALL_FLOATS.raw_decode(text, start)


def _skip(text: str, position: int) -> int:
    """Return the next character that is not blank."""
    match = _SPACE.match(text, position)
    return match.end() if match else position
