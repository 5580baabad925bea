"""Wording: messages of the core as the panel says them.

The core names settings by their keys, as the command line takes them: ``lower max_depth or choose
storage=pointer``. In the panel they have labels: "lower Max Depth or choose Storage Pointer". What
is not ours stays as it is: names of objects and files, values, lines of Python.
"""

from __future__ import annotations

import dataclasses
import functools
import re
from typing import Any, NamedTuple

from ...core.errors import InputError, reason_of
from ...core.geometry.csg.settings import CuttingSettings
from ...core.printing import printable
from ...core.scene.placing import PlacingSettings
from ...core.settings import key_of
from ..settings.generated import name_of

ABBREVIATIONS = {"bsp", "bvh", "kdtree"}
"""Names of structures that are no words."""

KINDS = "structure|rays|sample scene"

QUOTED = r"""\[(?:'[^']*'|"[^"]*")\]|"[^"]*"|(?<!\w)'[^']*[^\w'][^']*'(?!\w)"""
"""What stays as it is: a key of Python's, and what is in quotes. The core puts the key of a setting
in single quotes, too; that is one word alone."""

BETWEEN_WORDS = re.compile(r"(?<!\d)\s+|\s+(?!\d{3}(?!\d))")
"""Where a line may end: not in a number such as 16 161."""


class Names(NamedTuple):
    """What the panel calls things, by their names on the command line."""

    settings: dict[str, str]
    choices: dict[str, str]
    entries: dict[str, str]


@functools.cache
def names() -> Names:
    """Return the labels of all settings, choices, structures, rays and sample scenes."""
    from ...core.evaluation.rays.workloads import workloads
    from ...core.structures import structures
    from ...sample_scenes import samples

    found = Names({}, {}, {})
    entries: list[tuple[str, Any]] = [
        *structures().items(), *workloads().items(), *samples().items(),
    ]  # fmt: skip
    found.entries.update((name, entry.label) for name, entry in entries)
    for settings in (PlacingSettings, CuttingSettings, *(entry.Settings for _, entry in entries)):
        for field in dataclasses.fields(settings):
            found.settings[key_of(field)] = field.metadata["label"]
            for choice in field.metadata["choices"] or ():
                found.choices[choice] = name_of(choice)
    # A structure may be a choice of another's settings, and is called what it is called itself.
    found.choices.update({name: entry.label for name, entry in structures().items()})
    return found


def refusal_in_panel(error: InputError | MemoryError) -> str:
    """Return what an error says, as the panel says it."""
    return in_panel(reason_of(error), *getattr(error, "names", ()))


def in_panel(message: str, *names: str) -> str:
    """Return a message with labels in place of keys, on one line that steers no terminal.

    Parameters
    ----------
    message : str
        Of an InputError, or what work says it is doing.
    *names : str
        What in it stays as it is, beside what is quoted.
    """
    text = " ".join(message.split())
    # The longest first: one may be the beginning of another.
    given = sorted((" ".join(name.split()) for name in names if name.strip()), key=len)[::-1]
    kept = [*(rf"(?<!\w){re.escape(name)}(?!\w)" for name in given), QUOTED]
    said, begin = "", 0
    for match in re.finditer("|".join(kept), text):
        said += _worded(text[begin : match.start()]) + match[0]
        begin = match.end()
    return printable(said + _worded(text[begin:]))


def _worded(text: str) -> str:
    """Return what is ours of a message with labels in place of keys."""
    text = re.sub(rf"^(?:{KINDS}) (\w+):", _entry_before_colon, text)
    text = re.sub(r"(?<![\w/.])(\w+)=([\w.-]+)", _setting_and_value, text)
    text = re.sub(r"(?<![\w-])--(\w+) (\w+)", _setting_and_value, text)
    text = re.sub(r"'(\w+)'", _quoted_key, text)
    return re.sub(r"(?<![\w/.'])\w+(?![\w/'])(?!\.\w)", _word, text)


def in_lines(text: str, characters: int) -> list[str]:
    """Return a text over lines of at most so many characters, unless a word has more."""
    lines = [""]
    for word in BETWEEN_WORDS.split(text.strip()):
        if lines[-1] and len(lines[-1]) + 1 + len(word) > characters:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def _entry_before_colon(match: re.Match[str]) -> str:
    """``structure bvh:`` is ``BVH:``."""
    return f"{names().entries.get(match[1], match[1])}:"


def _setting_and_value(match: re.Match[str]) -> str:
    """``storage=pointer`` is ``Storage Pointer``, as is ``--storage pointer``."""
    key, value = match.groups()
    if key not in names().settings:
        return match[0]
    return f"{names().settings[key]} {names().choices.get(value, value)}"


def _quoted_key(match: re.Match[str]) -> str:
    """``'up'`` is ``Up``, as ``'routed'`` is ``Routed``."""
    known = names()
    return known.settings.get(match[1], known.entries.get(match[1], match[0]))


def _word(match: re.Match[str]) -> str:
    """``max_depth`` is ``Max Depth``, ``sbvh`` is ``SBVH``; words of the language stay."""
    word, known = match[0], names()
    if "_" in word:
        return next((of[word] for of in known if word in of), word)
    if word in ABBREVIATIONS:
        return known.entries[word]
    acronym = known.choices.get(word, "")
    return acronym if acronym.isupper() else word
