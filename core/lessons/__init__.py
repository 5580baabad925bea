"""Lessons: one file for each idea that is shown.

A module in this folder that defines ``LESSONS`` is found by itself.
"""

from __future__ import annotations

import difflib
import functools
import importlib
import pkgutil

from ..contract.structure import Structure
from ..errors import InputError
from .lesson import Lesson, any_structure


@functools.cache
def lessons() -> dict[str, Lesson]:
    """Return every lesson by name, in the order of the slides."""
    found: list[Lesson] = []
    for module in sorted(pkgutil.iter_modules(__path__), key=lambda module: module.name):
        found += getattr(importlib.import_module(f"{__name__}.{module.name}"), "LESSONS", ())
    return {lesson.name: lesson for lesson in sorted(found, key=lambda lesson: lesson.place)}


def lesson_named(name: str) -> Lesson:
    """Return the lesson called `name`.

    Raises
    ------
    InputError
        Naming those whose names are alike.
    """
    try:
        return lessons()[name]
    except KeyError:
        alike = " or ".join(difflib.get_close_matches(name, lessons()))
        meant = f"; perhaps {alike} is meant" if alike else ""
        said = f"there is no lesson '{name}'{meant}; accelscope lessons lists them"
        raise InputError(said) from None


def lessons_about(structure: Structure) -> list[Lesson]:
    """Return the lessons that are about structures of one kind, of which this one is.

    Programs of the ray tracing pipeline may be run through most of them, and are about none.
    """
    return [
        lesson
        for lesson in lessons().values()
        if len(lesson.structures) == 1
        and lesson.suits is not any_structure
        and not lesson.source.startswith("pipeline.")
        and not lesson.suits(structure)
    ]
