"""The one family of errors that mdfconv raises at its border."""


class MdfconvWarning(UserWarning):
    """Elements of an array that have no answer and come back as NaN."""


class MdfconvError(ValueError):
    """A request that cannot be answered; the message is written for the user.

    The command line prints the message as one line and exits with status 2.
    """


def check_name(kind: str, name: object) -> str:
    """Return a name that is a string; raise `MdfconvError` for anything else."""
    if not isinstance(name, str):
        raise MdfconvError(f"a {kind} is named by a string, not {name!r}")
    return name


def unknown_name(kind: str, name: str, known: list[str]) -> MdfconvError:
    """Return the error for a name that is not known, with the nearest ones that are.

    Parameters
    ----------
    kind : str
        What the name was meant to name, such as ``"distribution"``.
    name : str
        The name as the user wrote it.
    known : list of str
        Every name that would have been accepted.
    """
    from difflib import get_close_matches

    near = get_close_matches(name.lower(), known, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(known)}"
    return MdfconvError(f"unknown {kind} '{name}'; {hint}")
