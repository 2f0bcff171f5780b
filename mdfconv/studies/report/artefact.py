"""An entry of the report folder."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Artefact:
    """Files of the report, and what the index says of them.

    Parameters
    ----------
    files : dict
        From file names to contents.
    reproduces : str
        Which table or figure of which source, or what question is answered.
    agreement : str
        How well, in figures.
    command : str
        The command that makes it.
    """

    files: dict[str, bytes]
    reproduces: str
    agreement: str
    command: str
