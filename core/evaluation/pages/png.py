"""PNG files, written with the standard library: Blender's Python carries no image library."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from ...writing import write_bytes


def write_png(path: Path, image: np.ndarray) -> None:
    """Write an image.

    Parameters
    ----------
    image : (height, width, 3) float in 0 ... 1
        Row 0 is the top.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    write_bytes(path, png_bytes(image))


def png_bytes(image: np.ndarray) -> bytes:
    """Return what a PNG file of an image holds, see :func:`write_png`."""
    pixels = (np.clip(image, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    height, width, _ = pixels.shape
    filtered = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # filter 0 in front of each row
    filtered[:, 1:] = pixels.reshape(height, -1)

    def chunk(name: bytes, data: bytes) -> bytes:
        body = name + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6))
        + chunk(b"IEND", b"")
    )
