"""Files that are read: what stands in their place is looked at before."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from .errors import InputError


def refuse_if_no_file(path: str | Path) -> None:
    """Refuse a path at which there is no file that could be read, such as a folder or a pipe.

    ``Path.is_file`` is no help: it raises what the system says of names that are too long, and of
    folders that may not be looked into.

    Raises
    ------
    InputError
        In one line that names the path.
    """
    try:
        if stat.S_ISREG(os.stat(path).st_mode):
            return
    except (FileNotFoundError, NotADirectoryError, ValueError):  # the last for what is no name
        pass
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}", str(path)) from None
    raise InputError(f"there is no file {path}", str(path))
