"""What a walk asks about cells that may still have to be made (:mod:`.lazy`).

Of a structure whose cells were all made by the build, the answers are known when a kernel is
compiled, and nothing is left of the questions.
"""

from __future__ import annotations

from ..kernels import dispatched, implements


@dispatched
def note_if_missing(cells, cell):
    """Say whether a cell is still to be made, and note it then.

    Parameters
    ----------
    cells : NamedTuple of arrays
        A tree or a grid; decides the implementation.
    """
    raise TypeError(f"no cells in {type(cells).__name__}")


@dispatched
def most_missing(cells):
    """Return how many missing cells a walk notes before it gives up."""
    raise TypeError(f"no cells in {type(cells).__name__}")


def never_missing(cells, cell):
    """All cells were made by the build."""
    return False


def none_missing(cells):
    """All cells were made by the build."""
    return 0


def all_made(record: type) -> None:
    """Register a kind of tree or grid whose cells are all made by the build."""
    implements(note_if_missing, record, inline=True)(never_missing)
    implements(most_missing, record, inline=True)(none_missing)
