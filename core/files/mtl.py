"""Material libraries of OBJ files (MTL): colours, and what is mirrored and transmitted.

Of a material Kd, Ks, Ns, Ni, d or Tr, and illum are read. By ``illum`` a material mirrors (3 to 9),
or transmits what `d` leaves (4, 6, 7 and 9). Maps are not read.

Wavefront Technologies: Object Files (.obj), Advanced Visualizer manual, appendix B1; MTL material
format, 1995.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..scene.material import SHARP, WHITE, Material
from .text import floats_of, name_of, text_of

MIRRORING, TRANSMITTING = range(3, 10), (4, 6, 7, 9)
"""Values of ``illum``."""

WORDS = {b"Kd": 3, b"Ks": 3, b"Ns": 1, b"Ni": 1, b"d": 1, b"Tr": 1, b"illum": 1}
"""How many numbers follow each statement that is read."""

LARGEST = 10_000_000
"""Bytes of a library; those of a thousand materials have a tenth of a million."""


def materials_in(folder: Path, statements: Iterable[bytes]) -> tuple[dict[str, Material], list]:
    """Return the materials of libraries by name, and sentences on what was not read of them.

    Libraries that are not there are nothing that could be read: their materials are matt.

    Parameters
    ----------
    folder : Path
        Where the OBJ file is.
    statements : iterable of bytes
        What follows each ``mtllib``: a name, which may have blanks in it, or several.
    """
    found: dict[str, Material] = {}
    notes: list[str] = []
    for words in dict.fromkeys(statements):
        names = [name_of(words)]
        if not is_file(folder / names[0]):
            names = [name_of(word) for word in words.split()]
        for name in names:
            try:
                data = (folder / name).read_bytes()
            except (OSError, ValueError):
                continue
            if len(data) > LARGEST:
                notes.append(f"the material library {name} is too large, so that it is left out")
                continue
            materials, maps, broken = read_library(data)
            found |= materials
            if maps:
                notes.append(f"not read of {name}: {', '.join(sorted(maps))}")
            if broken:
                more = f" and {len(broken) - 1} more" if len(broken) > 1 else ""
                notes.append(f"not read of {name}: line {broken[0]}{more}")
    return found, notes


def is_file(path: Path) -> bool:
    """Say whether there is a file; a name may be none that a file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_library(data: bytes) -> tuple[dict[str, Material], set[str], list[int]]:
    """Return the materials of a library by name, kinds of maps in it, and lines not understood."""
    materials: dict[str, Material] = {}
    maps: set[str] = set()
    broken: list[int] = []
    name: str | None = None
    values: dict[bytes, list[float]] = {}
    for number, line in enumerate(text_of(data).split(b"\n"), 1):
        words = line.partition(b"#")[0].split()
        if not words:
            continue
        if words[0] == b"newmtl":
            if name is not None:
                materials[name] = material_of(name, values)
            name, values = name_of(b" ".join(words[1:])), {}
        elif words[0] in WORDS and name is not None:
            numbers = words[1:]
            if words[0] == b"d" and numbers[:1] == [b"-halo"]:
                numbers = numbers[1:]
            try:
                read = floats_of(numbers).tolist()
            except ValueError:
                read = []
            count = WORDS[words[0]]
            if len(read) == 1:
                read *= count  # of three colours, one stands for all
            if len(read) >= count:
                values[words[0]] = read[:count]
            else:
                broken.append(number)
        elif words[0].lower().startswith((b"map_", b"bump", b"disp", b"decal", b"refl", b"norm")):
            maps.add(name_of(words[0]))
    if name is not None:
        materials[name] = material_of(name, values)
    return materials, maps, broken


def material_of(name: str, values: dict[bytes, list[float]]) -> Material:
    """Return a material of what a library says of it; numbers beyond what can be are limited."""
    colour = _colour(values.get(b"Kd", [0.8] * 3))
    (illum,) = values.get(b"illum", [2.0])
    mirrored = _colour(values.get(b"Ks", [0.0] * 3)) if illum in MIRRORING else (0.0,) * 3
    strongest = max(mirrored)
    (opaque,) = values[b"d"] if b"d" in values else [1.0 - values.get(b"Tr", [0.0])[0]]
    clear = 1.0 - _limited(opaque, 1.0) if illum in TRANSMITTING else 0.0
    index = values.get(b"Ni", [1.0])[0]
    tint: Any = tuple(each / strongest for each in mirrored) if strongest else WHITE
    return Material(
        name, colour, diffuse=1.0 - clear, specular=strongest,
        shine=_limited(values.get(b"Ns", [SHARP])[0], SHARP), transmission=clear,
        index_of_refraction=index if 1e-3 < index < 1e3 else 1.0, specular_colour=tint,
    )  # fmt: skip


def _colour(values: list[float]) -> tuple[float, float, float]:
    red, green, blue = (_limited(each, 1.0) for each in values)
    return red, green, blue


def _limited(value: float, largest: float) -> float:
    """Return a number limited to 0 to a largest one; 0 for what is none."""
    return min(max(value, 0.0), largest) if value == value else 0.0
