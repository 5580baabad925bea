"""Files of what rays have seen: the picture, and where its samples went."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from ...lessons.heat_map import viridis
from ...lessons.picture import Image
from ...writing import write_bytes
from ..rays.workload import Outcome
from .png import png_bytes


def images_of(outcome: Outcome) -> tuple[Image, ...]:
    """Return the picture as an image, and where pixels differ in their samples, these as well."""
    picture = Image("picture", np.minimum(outcome.picture, 1.0))
    if outcome.samples.min() == outcome.samples.max():
        return (picture,)
    return picture, Image("samples", map_of_samples(outcome.samples), outcome.samples)


def picture_files(path: str | Path) -> tuple[Path, ...]:
    """Return the files of a picture, all that there may be: two images, two of numbers."""
    path = Path(path)
    beside = path.with_name(f"{path.stem}_samples{path.suffix}")
    return path, path.with_suffix(".npy"), beside, beside.with_suffix(".npy")


def write_picture(path: str | Path, outcome: Outcome) -> None:
    """Write a picture as PNG, and beside it as it is, (height, width, 3) float64, as .npy.

    Where pixels have different numbers of samples, these are written, too.

    Raises
    ------
    InputError
        If a place cannot be written to.
    """
    files = picture_files(path)
    numbers = outcome.picture, outcome.samples
    for n, image in enumerate(images_of(outcome)):
        write_bytes(files[2 * n], png_bytes(image.pixels))
        write_bytes(files[2 * n + 1], npy_bytes(numbers[n]))


def write_numbers(path: str | Path, image: np.ndarray, numbers: np.ndarray) -> None:
    """Write an image, (height, width, 3) from 0 to 1, as PNG, and what it shows beside it as .npy.

    Raises
    ------
    InputError
        If a place cannot be written to.
    """
    write_bytes(Path(path), png_bytes(image))
    write_bytes(Path(path).with_suffix(".npy"), npy_bytes(numbers))


def map_of_calls(calls: np.ndarray) -> np.ndarray:
    """Return colours, (height, width, 3), of calls of shaders, (height, width, stages), together.

    Dark is a pixel for which as few were called as for any, bright one for which most were.
    """
    counts = calls.sum(axis=2)
    low, high = counts.min(), counts.max()
    return viridis((counts - low) / max(high - low, 1))


def map_of_samples(samples: np.ndarray) -> np.ndarray:
    """Return colours, (height, width, 3), of numbers of samples: dark for the fewest, 1."""
    return viridis(np.log2(samples) / max(np.log2(samples.max()), 1.0))


def npy_bytes(values: np.ndarray) -> bytes:
    """Return what a .npy file of an array holds."""
    buffer = io.BytesIO()
    np.save(buffer, values, allow_pickle=False)
    return buffer.getvalue()
