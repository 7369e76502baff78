"""The one error type that means "what was handed in is wrong"."""


class InputError(ValueError):
    """The user's input cannot be used: a missing or broken file, an impossible option.

    The message is one line that names the file or option and the remedy. The command line prints it without a
    traceback and ends with exit code 2; in Python it is an ordinary ``ValueError``.
    """
