"""The one exception whose message is meant for the user."""


class InputError(ValueError):
    """Input that cannot be used; the message says what is wrong and what to do.

    The panel reports it, the command line prints it on one line and goes on with what else there
    is to do. Every other exception is a defect of AccelScope and keeps its traceback.
    """


def reason_of(error: InputError | MemoryError) -> str:
    """Return what an error says, on one line; a lack of memory says nothing by itself."""
    text = str(error) or "out of memory; use a smaller scene or resolution"
    return " ".join(text.split())
