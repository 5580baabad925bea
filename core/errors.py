"""The one exception whose message is meant for the user."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


class InputError(ValueError):
    """Input that cannot be used; the message says what is wrong and what to do.

    The panel reports it, the command line prints it on one line and goes on with what else there
    is to do. Every other exception is a defect of AccelScope and keeps its traceback.

    Parameters
    ----------
    message : str
    *names : str
        What in it is not ours: names of objects, files, values. The panel has other words for
        settings and structures than the command line; these stay as they are.
    """

    def __init__(self, message: str, *names: str) -> None:
        super().__init__(message)
        self.names = names


@contextlib.contextmanager
def naming(*names: str) -> Iterator[None]:
    """Let every InputError that is raised meanwhile know of these names, too."""
    try:
        yield
    except InputError as error:
        error.names += names
        raise


OUT_OF_MEMORY = "out of memory; use a smaller scene or resolution"


def reason_of(error: InputError | MemoryError) -> str:
    """Return what an error says, on one line; a lack of memory says nothing by itself."""
    return " ".join((str(error) or OUT_OF_MEMORY).split())
