"""Programs by name, from files and from texts.

A program is code: it runs when somebody names it, and at no other time. What a scene, a .blend or a
configuration holds is never run.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
import types
from pathlib import Path

from ..errors import InputError
from ..reading import refuse_if_no_file
from . import programs
from .program import Program


@functools.cache
def program_names() -> tuple[str, ...]:
    """Return the names of the programs that come with AccelScope, the lecture's first."""
    names = sorted(module.name for module in pkgutil.iter_modules(programs.__path__))
    return tuple(sorted(names, key=lambda name: name != "lecture"))


def program_named(name: str) -> Program:
    """Return a program that comes with AccelScope.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in program_names():
        raise InputError(
            f"there is no program '{name}'; known are: {', '.join(program_names())}, and any "
            "FILE.py with a PROGRAM"
        )
    return importlib.import_module(f"{programs.__name__}.{name}").PROGRAM


def source_of(name: str) -> str:
    """Return the source of a program that comes with AccelScope."""
    return (Path(programs.__path__[0]) / f"{name}.py").read_text(encoding="utf-8")


def program_at(name: str) -> Program:
    """Return the program that a name or the path of a file means; run that file.

    Raises
    ------
    InputError
        If there is none, or it is none, or running it raises an exception.
    """
    if not name.endswith(".py"):
        return program_named(name)
    refuse_if_no_file(name)
    try:
        text = Path(name).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{name} cannot be read: {error}") from None
    return program_from(text, name)


def program_from(text: str, name: str) -> Program:
    """Run the text of a program, and return the program.

    It may import the language as the programs do that come with AccelScope, by ``from ..language
    import ...``: a copy of one of them is a program.

    Parameters
    ----------
    name : str
        The file's path, or what the text is called; for messages.

    Raises
    ------
    InputError
        If it is no Python, raises an exception, or leaves no PROGRAM behind.
    """
    module = types.ModuleType(f"{programs.__name__}.{Path(name).stem}")
    module.__file__ = name
    module.__package__ = programs.__name__
    try:
        exec(compile(text, name, "exec", dont_inherit=True), module.__dict__)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    except SyntaxError as error:
        raise InputError(f"{name}, line {error.lineno}: {error.msg}") from None
    except Exception as error:
        raise InputError(f"{name}: {type(error).__name__}: {error}{line_in(error, name)}") from None
    program = getattr(module, "PROGRAM", None)
    if not isinstance(program, Program):
        raise InputError(
            f"{name} has no PROGRAM; end it with PROGRAM = Program(ray_generation=..., ...)"
        )
    return program


def line_in(error: BaseException, name: str) -> str:
    """Return ``", line N"`` for where in a file an exception comes from; empty if not from it."""
    found, trace = "", error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == name:
            found = f", line {trace.tb_lineno}"
        trace = trace.tb_next
    return found
