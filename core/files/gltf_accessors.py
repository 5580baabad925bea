"""Numbers in a glTF file: chunks, buffers, views of them, accessors.

Khronos Group: glTF 2.0 Specification, 2021, chapters 3.6 and 4.
"""

from __future__ import annotations

import base64
import binascii
import contextlib
import json
import math
import reprlib
import struct
import urllib.parse
from pathlib import Path
from typing import Any

import numpy as np

from ..memory import refuse_if_too_large
from .contents import MORE_THAN_ANY, BrokenFile, NotRead

COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}

SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
"""How many numbers an element has. Columns of small matrices would be padded, but no matrix of
bytes or shorts is read."""

COMPRESSIONS = ("EXT_meshopt_compression", "KHR_meshopt_compression")


class Document:
    """A glTF file: its description, and the numbers that it refers to, read when asked for."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._chunk: bytes | None = None
        self._buffers: dict[int, np.ndarray] = {}
        data = path.read_bytes()
        if data[:4] == b"glTF":
            data = self._unpack(data)
        try:
            self.root = json.loads(data.decode("utf-8-sig"))
        except (json.JSONDecodeError, UnicodeDecodeError) as error:
            raise BrokenFile(f"its description is no JSON: {error}") from None
        except RecursionError:
            raise BrokenFile("its description is nested too deep") from None
        except ValueError:
            raise BrokenFile("its description has a number of thousands of digits") from None
        if not isinstance(self.root, dict):
            raise BrokenFile("its description is no JSON object")

    def _unpack(self, data: bytes) -> bytes:
        """Return the description in a GLB file; its binary chunk is kept."""
        if len(data) < 20:
            raise BrokenFile("its header is cut off")
        _, version, length = struct.unpack_from("<4sII", data)
        if version != 2:
            raise BrokenFile(f"it is of version {version} of binary glTF, not 2")
        if length > len(data):
            raise BrokenFile(f"it announces {length} bytes, but ends after {len(data)}")
        chunks: dict[bytes, bytes] = {}
        place = 12
        while place + 8 <= length:
            size, kind = struct.unpack_from("<I4s", data, place)
            if place + 8 + size > length:
                raise BrokenFile("a chunk of it is cut off")
            chunks.setdefault(kind, data[place + 8 : place + 8 + size])
            place += 8 + size
        if b"JSON" not in chunks:
            raise BrokenFile("it has no chunk of JSON")
        self._chunk = chunks.get(b"BIN\0")
        return chunks[b"JSON"]

    def entry(self, kind: str, index: Any) -> dict:
        """Return an entry of one of the lists of the description, such as ``nodes``.

        Raises
        ------
        BrokenFile
            When there is none of this number.
        """
        entries = self.root.get(kind, [])
        if not isinstance(entries, list):
            raise BrokenFile(f"its '{kind}' are no list")
        index = whole(index, f"a number of {kind}")
        if index >= len(entries):
            raise BrokenFile(f"it refers to number {index} of {len(entries)} {kind}")
        if not isinstance(entries[index], dict):
            raise BrokenFile(f"number {index} of its {kind} is no object")
        return entries[index]

    def accessor(self, index: Any, kind: str) -> np.ndarray:
        """Return the elements of an accessor.

        Parameters
        ----------
        kind : str
            The type that is needed, a key of SIZES.

        Returns
        -------
        (count, size) float64, or as the file has them where they are whole and not normalized
        """
        entry = self.entry("accessors", index)
        where = f"accessor {index}"
        if entry.get("type") != kind:
            raise BrokenFile(f"{where} is of type {str(entry.get('type'))[:20]}, not {kind}")
        count = whole(entry.get("count"), f"the count of {where}")
        component, width = _component(entry, where), SIZES[kind]
        if "bufferView" in entry:
            place = whole(entry.get("byteOffset", 0), f"the byteOffset of {where}")
            values = self._view(entry["bufferView"], place, count, component, width, where)
        else:
            # Zeros take no room, but what they are turned into does, more than once.
            refuse_if_too_large(count * width * 24, f"{where} of {self._path}", "repair the file")
            values = np.zeros((count, width), dtype=component)
        if "sparse" in entry:
            values = self._replaced(values, entry["sparse"], component, where)
        if entry.get("normalized") and component.kind != "f":
            return np.maximum(values / float(np.iinfo(component).max), -1.0)
        return values.astype(np.float64) if component.kind == "f" else values

    def _replaced(
        self, values: np.ndarray, sparse: dict, component: np.dtype, where: str
    ) -> np.ndarray:
        """Return values with those replaced that a sparse accessor names."""
        where = f"the sparse part of {where}"
        count = whole(sparse.get("count"), f"the count of {where}")
        parts = []
        for name, dtype, width in (
            ("indices", _component(sparse["indices"], where), 1),
            ("values", component, values.shape[1]),
        ):
            place = whole(sparse[name].get("byteOffset", 0), f"a byteOffset of {where}")
            view = sparse[name].get("bufferView")
            parts.append(self._view(view, place, count, dtype, width, where))
        places = parts[0][:, 0].astype(np.int64)
        if count and places.max() >= len(values):
            raise BrokenFile(f"{where} replaces number {places.max()} of {len(values)}")
        values = values.copy()
        values[places] = parts[1]
        return values

    def _view(
        self, index: Any, place: int, count: int, component: np.dtype, width: int, where: str
    ) -> np.ndarray:
        """Return `count` elements of `width` numbers from byte `place` of a view on, as a view."""
        view = self.entry("bufferViews", index)
        for name in COMPRESSIONS:
            if name in view.get("extensions", {}):
                fallback = self.entry("buffers", view.get("buffer")).get("extensions", {})
                if fallback.get(name, {}).get("fallback"):
                    raise NotRead(f"{where} is compressed with {name}, which is not read")
        buffer = self._buffer(view.get("buffer"))
        begin = whole(view.get("byteOffset", 0), f"the byteOffset of bufferView {index}")
        length = whole(view.get("byteLength"), f"the byteLength of bufferView {index}")
        size = component.itemsize * width
        stride = whole(view.get("byteStride", 0), f"the byteStride of bufferView {index}") or size
        if begin + length > len(buffer):
            raise BrokenFile(f"bufferView {index} ends beyond its buffer of {len(buffer)} bytes")
        if count and place + stride * (count - 1) + size > length:
            raise BrokenFile(f"{where} ends beyond bufferView {index} of {length} bytes")
        if not count:
            return np.zeros((0, width), dtype=component)
        return np.ndarray(
            (count, width), component, buffer, begin + place, (stride, component.itemsize)
        )

    def _buffer(self, index: Any) -> np.ndarray:
        """Return the bytes of a buffer."""
        entry = self.entry("buffers", index)
        if index not in self._buffers:
            uri = entry.get("uri")
            if uri is None and index == 0 and self._chunk is not None:
                data = self._chunk
            elif isinstance(uri, str):
                data = self._fetched(uri)
            else:
                raise BrokenFile(f"buffer {index} has no data")
            # What is announced may count a padding that was not written: every view is checked
            # against what there is.
            self._buffers[index] = np.frombuffer(data, dtype=np.uint8)
        return self._buffers[index]

    def _fetched(self, uri: str) -> bytes:
        """Return what a URI refers to: data in itself, or a file beside this one."""
        if uri.startswith("data:"):
            head, comma, text = uri.partition(",")
            if not comma:
                raise BrokenFile("a data URI has no comma")
            data = urllib.parse.unquote_to_bytes(text)
            if not head.endswith(";base64"):
                return data
            try:
                return base64.b64decode(data, validate=True)
            except binascii.Error as error:
                raise BrokenFile(f"a data URI is no base64: {error}") from None
        if "://" in uri:
            raise BrokenFile(f"its buffer {uri} is not beside it; only files are read")
        folder = self._path.parent
        for name in (urllib.parse.unquote(uri), uri):  # some programs forget to encode
            # Windows asks any machine for what is called \\machine\folder\file.
            if name.startswith(("/", "\\")) or name[1:2] == ":":
                raise BrokenFile(f"its buffer {uri} is not beside it; only files are read")
            try:
                if (folder / name).is_file():
                    return (folder / name).read_bytes()
            except ValueError:
                break  # a NUL, which no name of a file has
        raise BrokenFile(f"there is no file {urllib.parse.unquote(uri)!r} beside it")


def whole(value: Any, what: str) -> int:
    """Return a whole number from 0 to below 2^63; JSON may write it as 3.0.

    Raises
    ------
    BrokenFile
        If it is none.
    """
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise BrokenFile(f"{what} is {reprlib.repr(value)}, not a whole number")
    if value >= MORE_THAN_ANY:
        raise BrokenFile(f"{what} is {reprlib.repr(value)}, more than any file can have")
    return value


def real(value: Any, what: str) -> float:
    """Return a finite number.

    Raises
    ------
    BrokenFile
        If it is none; JSON may write one that is too large.
    """
    number = math.nan
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        with contextlib.suppress(OverflowError):
            number = float(value)
    if not math.isfinite(number):
        raise BrokenFile(f"{what} is {reprlib.repr(value)}, no finite number")
    return number


def _component(entry: dict, where: str) -> np.dtype:
    try:
        return np.dtype("<" + COMPONENTS[entry["componentType"]])
    except (KeyError, TypeError):
        found = reprlib.repr(entry.get("componentType"))
        raise BrokenFile(f"{where} has the componentType {found}, which there is not") from None
