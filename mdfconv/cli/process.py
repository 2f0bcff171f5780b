"""How a run of the command line begins and ends: its streams, and its exit status.

The statuses: 0 for an answer, also where its reader leaves early; 1 where something was left as
it is; 2 for a request that has none; 3 for a mistake of mdfconv itself; 130 for Ctrl-C.
"""

from __future__ import annotations

import os
import sys
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TextIO

import typer

from mdfconv.errors import MdfconvError, MdfconvWarning

REFUSED, MISTAKEN, INTERRUPTED = 2, 3, 130
_STANDARD_ERROR = 2
# With this variable set a mistake shows where it happened.
_DEBUG = "MDFCONV_DEBUG"
_ISSUES = "https://github.com/mdfconv/mdfconv/issues"
# Typer exports BadParameter but not its base, the family of all mistakes in the arguments.
_UsageError: type[Any] = typer.BadParameter.__mro__[1]


def run(command: Callable[[], int | None]) -> int:
    """Run a command that returns a status, None for 0; say what goes wrong in one line."""
    _prepare_streams()
    try:
        if sys.stdout is None:
            raise MdfconvError("standard output is closed")
        with warnings.catch_warnings():
            notes = _collect_warnings()
            status = command() or 0
        # Of a request that has no answer only the reason is of interest.
        for note in dict.fromkeys(notes):
            tell(f"note: {note}")
        sys.stdout.flush()
    except SystemExit as end:
        if isinstance(end.__context__, BrokenPipeError):
            # Typer ends the process by itself where the reader of a pipe has gone.
            status = _without_reader()
        elif end.code is None or isinstance(end.code, int):
            status = end.code or 0
        else:
            status = _refuse(str(end.code))
    except BrokenPipeError:
        status = _without_reader()
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    except Exception as error:
        status = _failed(error)
    _flush_errors()
    return status


def _failed(error: Exception) -> int:
    """Say what went wrong in one line; return the exit status."""
    if isinstance(error, MdfconvError):
        return _refuse(str(error))
    if isinstance(error, _UsageError):
        return _refuse(error.format_message())
    if isinstance(error, MemoryError):
        return _refuse("not enough memory for this request")
    if isinstance(error, OSError) and error.filename is None:
        # Standard output failed (a full disk); what is left in its buffer would fail again.
        _discard(sys.stdout)
        return _refuse(f"cannot write the output: {error.strerror}")
    if os.environ.get(_DEBUG):
        traceback.print_exc()
    text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    tell(
        f"a mistake of mdfconv, not of yours: {text}; please report it at {_ISSUES} with the "
        f"command and what it prints with {_DEBUG}=1"
    )
    return MISTAKEN


def _without_reader() -> int:
    """Let go of standard output, whose reader has what it wanted."""
    _discard(sys.stdout)
    return 0


def _prepare_streams() -> None:
    """Make every standard stream one that can be written to, or None: standard output."""
    if sys.stderr is None:
        # No file that is opened later may become the descriptor of a stream that is closed.
        while (descriptor := os.open(os.devnull, os.O_RDWR)) < _STANDARD_ERROR:
            pass
        sys.stderr = open(descriptor, "w")  # noqa: SIM115 (as long as the process)
    for stream in (sys.stdout, sys.stderr):
        # A terminal that cannot show α shows ? instead of a traceback.
        if stream is not None:
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]


def _discard(stream: TextIO) -> None:
    """Send what is still in the buffer of a stream that failed nowhere."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _flush_errors() -> None:
    try:
        sys.stderr.flush()
    except (OSError, ValueError):
        _discard(sys.stderr)


def _collect_warnings() -> list[str]:
    """Return a list that takes what the library warns of; other warnings are shown as usual."""
    usual, notes = warnings.showwarning, []

    def show(message: Any, category: type[Warning], *place: Any, **more: Any) -> None:
        if issubclass(category, MdfconvWarning):
            notes.append(str(message))
        else:
            usual(message, category, *place, **more)

    warnings.showwarning = show
    warnings.simplefilter("always", MdfconvWarning)
    return notes


def _refuse(message: str) -> int:
    tell(message)
    return REFUSED


def tell(message: str) -> None:
    """Write one line to standard error."""
    # What nobody can read there must not take the place of the answer and its status.
    with suppress(OSError):
        typer.echo(f"mdfconv: {' '.join(message.split())}", err=True)
