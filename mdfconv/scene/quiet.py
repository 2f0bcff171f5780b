"""Libraries of C that write to the process's streams what they return as errors, too."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def quiet_streams() -> Iterator[None]:
    """Keep libpng and OpenEXR from the process's streams; it holds for the whole process."""
    streams = {1: sys.stdout, 2: sys.stderr}
    for stream in streams.values():
        if stream is not None:
            stream.flush()
    kept = [(number, os.dup(number)) for number, stream in streams.items() if stream is not None]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for number, _ in kept:
            os.dup2(nowhere, number)
        yield
    finally:
        for number, copy in kept:
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)
