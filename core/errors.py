"""The one exception whose message is meant for the user."""


class InputError(ValueError):
    """Input that cannot be used; the message says what is wrong and what to do.

    The panel reports it, the command line prints it on one line and exits with 2.
    Every other exception is a defect of AccelScope and keeps its traceback.
    """
