"""Sample scenes: generated, or made from the small models in ``data/``.

One file per scene. They depend on NumPy and ``core`` only, so that they serve the command line and
the tests as well as Blender.
"""

from __future__ import annotations

from typing import Any

from ..core.errors import InputError
from ..core.scene import Scene
from ..core.settings import parse, parse_spec
from . import (
    balls,
    bunny,
    crowd,
    csg_chain,
    csg_classic,
    csg_plate,
    csg_rook,
    facade,
    forest,
    gears,
    jacks,
    lattice,
    mount,
    nonuniform,
    overlapping,
    rings,
    room,
    sah_example,
    shells,
    sombrero,
    soup,
    suzanne,
    teapot,
    teapot_in_stadium,
    tetra,
    tree,
)
from .sample import Sample

__all__ = ["Sample", "make_sample", "sample_and_settings", "sample_named", "samples"]


def samples() -> dict[str, Sample]:
    """Return every sample scene by name, in the order in which a menu shows them."""
    table = (
        suzanne.SAMPLE,
        bunny.SAMPLE,
        teapot_in_stadium.SAMPLE,
        crowd.SAMPLE,
        forest.SAMPLE,
        overlapping.SAMPLE,
        balls.SAMPLE,
        gears.SAMPLE,
        jacks.SAMPLE,
        lattice.SAMPLE,
        mount.SAMPLE,
        rings.SAMPLE,
        shells.SAMPLE,
        sombrero.SAMPLE,
        teapot.SAMPLE,
        tetra.SAMPLE,
        tree.SAMPLE,
        soup.SAMPLE,
        nonuniform.SAMPLE,
        sah_example.SAMPLE,
        room.SAMPLE,
        facade.SAMPLE,
        csg_classic.SAMPLE,
        csg_rook.SAMPLE,
        csg_plate.SAMPLE,
        csg_chain.SAMPLE,
    )
    return {sample.name: sample for sample in table}


def sample_named(name: str) -> Sample:
    """Return the sample scene called `name`.

    Raises
    ------
    InputError
        Listing the known names.
    """
    try:
        return samples()[name]
    except KeyError:
        known = ", ".join(samples())
        raise InputError(f"there is no sample scene '{name}'; known are: {known}") from None


def make_sample(spec: str) -> Scene:
    """Return the scene that ``NAME[:key=value,...]`` means, for example ``"tetra:size=4"``.

    Raises
    ------
    InputError
        For an unknown name or setting, a value outside its limits, or a scene that does not fit
        into memory; nothing is allocated before.
    """
    sample, settings = sample_and_settings(spec)
    return sample.generate(settings)


def sample_and_settings(spec: str) -> tuple[Sample, Any]:
    """Return the sample that ``NAME[:key=value,...]`` means, and its settings; nothing is made.

    Raises
    ------
    InputError
        For an unknown name or setting, or a value outside its limits.
    """
    name, texts = parse_spec(spec)
    sample = sample_named(name)
    return sample, parse(sample.Settings, texts, f"sample scene {name}")
