"""Rays of the user's own: arrays ``origins``, ``directions`` and perhaps others in an .npz file.

An .npz is a zip of arrays, each with a header that tells its shape and its type. What the headers
say is looked at first: an array that is no rays, or does not fit into memory, is never unpacked,
nor is one of another name. Objects are not read, since reading them may run what a file says.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import InputError
from ...geometry.rays import BYTES_PER_RAY, Rays
from ...memory import refuse_if_too_large
from ...reading import refuse_if_no_file

if TYPE_CHECKING:
    import zipfile

NEEDED = "origins", "directions"

COLUMNS = {
    "t_max": "t_max", "t_min": "t_min", "query": "queries", "ray_class": "classes",
    "source": "sources", "target": "targets", "time": "times", "mask": "masks", "pixel": "pixels",
}  # fmt: skip
"""What else a file may say of each ray, and the column of :class:`Rays` that it becomes."""

CLASS_NAMES = "class_names"
"""The array of words that name the classes."""

OPTIONAL = (*COLUMNS, CLASS_NAMES)

NUMBERS = "biuf"
"""Kinds of types that are real numbers."""

LONGEST_NAMES = 100_000
"""Bytes of the names of classes."""

LONGEST_HEADER = 10_000
"""Bytes; that of an array of numbers has a hundred."""


class Header(NamedTuple):
    """What a file says of an array.

    Attributes
    ----------
    member : str
        By which name it is stored.
    stored : int
        How many bytes follow the header, as the zip has it.
    shape : tuple of int
    dtype : dtype
    """

    member: str
    stored: int
    shape: tuple[int, ...]
    dtype: np.dtype

    @property
    def size(self) -> int:
        """How many bytes the numbers take."""
        return math.prod(self.shape) * self.dtype.itemsize


def headers_of(path: Path) -> dict[str, Header]:
    """Return the headers of a file's rays by the names of the arrays; no array is unpacked.

    Raises
    ------
    InputError
        If there is no such file, or the arrays in it are no rays or too large.
    """
    with _opened(path) as archive:
        members = {member.removesuffix(".npy"): member for member in archive.namelist()}
        headers = {
            name: _header(archive, members[name]) for name in NEEDED + OPTIONAL if name in members
        }
    missing = [name for name in NEEDED if name not in headers]
    if missing:
        raise InputError(f"{path} has no array named {', '.join(missing)}")
    for name, header in headers.items():
        if header.dtype.hasobject:
            raise InputError(f"{path}: {name} holds objects, which are not read; save numbers")
        if name == CLASS_NAMES:
            if header.dtype.kind != "U" or len(header.shape) != 1 or header.size > LONGEST_NAMES:
                raise InputError(f"{path}: {name} must be a short list of words")
        elif header.dtype.kind not in NUMBERS:
            raise InputError(f"{path}: {name} holds {header.dtype}, not real numbers")
    shapes = [headers[name].shape for name in NEEDED]
    count = shapes[0][0] if shapes[0] else 0
    if shapes != [(count, 3), (count, 3)]:
        raise InputError(
            f"{path}: origins and directions must both be n x 3, not {shapes[0]} and {shapes[1]}"
        )
    if count == 0:
        raise InputError(f"{path} has no rays; ask for at least one")
    for name in COLUMNS:
        if name in headers and headers[name].shape not in ((), (1,), (count,)):
            raise InputError(
                f"{path}: {name} must have one value per ray ({count}), not {headers[name].shape}"
            )
    needed = count * BYTES_PER_RAY + sum(header.size for header in headers.values())
    refuse_if_too_large(needed, f"{path} with {count} rays", "take fewer rays")
    for name, header in headers.items():
        if header.stored < header.size:
            raise InputError(f"{path}: {name} is cut off; save it again")
    return headers


def read_rays(path: Path) -> Rays:
    """Return the rays of a file.

    Raises
    ------
    InputError
        If there are none, or the file is broken.
    """
    headers = headers_of(path)
    arrays = {}
    with _opened(path) as archive:
        for name, header in headers.items():
            with archive.open(header.member) as member:
                arrays[name] = np.lib.format.read_array(member, allow_pickle=False)
    try:
        columns = {COLUMNS[name]: arrays[name] for name in COLUMNS if name in arrays}
        largest = int(np.max(columns.get("classes", 0), initial=0))
        names = tuple(str(name) for name in arrays.get(CLASS_NAMES, ()))
        if not names:
            names = ("file",) if largest < 1 else tuple(f"class {n}" for n in range(largest + 1))
        return Rays.from_arrays(
            arrays["origins"], arrays["directions"], class_names=names, **columns
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def columns_of(rays: Rays) -> dict[str, np.ndarray]:
    """Return the arrays of rays by the names that they have in a file."""
    return {
        **{name: getattr(rays, name) for name in NEEDED},
        **{name: getattr(rays, column) for name, column in COLUMNS.items()},
        CLASS_NAMES: np.array(rays.class_names),
    }


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open a file, and turn whatever goes wrong with it into one line."""
    import zipfile  # most rays come from no file

    refuse_if_no_file(path)
    try:
        with path.open("rb") as file:
            magic = file.read(len(np.lib.format.MAGIC_PREFIX))
        if magic == np.lib.format.MAGIC_PREFIX:
            raise InputError(
                f"{path} is a single array (.npy), whatever its name; save the rays with "
                "numpy.savez(path, origins=..., directions=...)"
            )
        with zipfile.ZipFile(path) as archive:
            yield archive
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(f"{path} does not fit into memory: {error}") from None
    except Exception as error:  # NumPy, zipfile, zlib and tokenize raise a dozen different things
        raise InputError(
            f"{path} cannot be read as .npz: {type(error).__name__}: {error}"
        ) from error


def _header(archive: zipfile.ZipFile, name: str) -> Header:
    """Return the header of a member."""
    with archive.open(name) as member:
        version = np.lib.format.read_magic(member)
        width = 2 if version == (1, 0) else 4
        length = int.from_bytes(member.read(width), "little")
        # NumPy would unpack all of a header before it looks how long that is.
        if length > LONGEST_HEADER:
            raise ValueError(f"{name} has a header of {length} bytes")
        member.seek(0)
        np.lib.format.read_magic(member)
        if version == (1, 0):
            shape, _, dtype = np.lib.format.read_array_header_1_0(member)
        elif version == (2, 0):
            shape, _, dtype = np.lib.format.read_array_header_2_0(member)
        else:
            # The third version is for types whose fields have names beyond Latin-1.
            raise ValueError(f"{name} is no plain array")
        stored = archive.getinfo(name).file_size - member.tell()
    if any(not 0 <= side < 1 << 63 for side in shape):
        raise ValueError(f"{name} has a side that no array has")
    return Header(name, stored, shape, dtype)
