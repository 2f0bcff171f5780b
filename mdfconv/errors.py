"""The one family of errors that mdfconv raises at its border."""


class MdfconvWarning(UserWarning):
    """What a careful user must know of an answer, such as that elements of it are NaN."""


class MdfconvError(ValueError):
    """A request that cannot be answered; the message is written for the user.

    The command line prints the message as one line and exits with status 2.

    Parameters
    ----------
    reason : str
        What is wrong.
    hint : str
        What would be right, if that is known.
    argument : str
        The name of the argument that would make it right, if there is one: the command line adds
        the option of that name.
    """

    def __init__(self, reason: str, hint: str = "", *, argument: str = "") -> None:
        super().__init__(f"{reason}; {hint}" if hint else reason)
        self.reason, self.hint, self.argument = reason, hint, argument
