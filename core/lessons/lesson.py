"""Lessons: everything that is a picture with a knob.

A module in this folder that defines ``LESSONS`` is found by itself: its lessons appear in the
panel, on the command line, in the handout and in the test matrix.

A lesson is played once, which may take as long as a build and can be cancelled; afterwards its
pictures are made at once, whatever its knobs say. A knob that decides what is played is named in
:attr:`Lesson.replays`.
"""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..contract.needs import in_words
from ..contract.structure import Structure
from ..errors import InputError
from ..geometry.rays import Rays
from ..progress import SILENT, Progress
from ..scene import Scene
from ..scene.camera_rays import PRIMARY
from ..settings import parse, parse_spec
from ..structures import structure_named
from .moment import Moment
from .picture import Picture
from .slides import SLIDES

PAGE = 4
"""Pictures of a lesson that names none: first, last, and even steps between."""

FILM = 48
"""Pictures of a film over a knob that is no whole number."""


@dataclass(frozen=True)
class Subject:
    """What a lesson is about.

    Attributes
    ----------
    scene : Scene
    structures : tuple of Structure
        As many as the lesson names, in its order; each was built with a log.
    rays : Rays, optional
        Rays from which the lesson shall choose `ray`; without any it makes its own.
    ray : int
    history : sequence of Moment
        The animation whose first frame the scene is, of the lessons that take one; without any
        they make their own.
    """

    scene: Scene
    structures: tuple[Structure, ...] = ()
    rays: Rays | None = None
    ray: int = 0
    history: Sequence[Moment] = ()


class Play(abc.ABC):
    """A lesson that was played: everything its pictures need.

    Attributes
    ----------
    ends : mapping of str to int
        The last value of those knobs that end where their content ends, by name. They are whole
        numbers that begin with 0, and declare no maximum.
    """

    ends: Mapping[str, int] = {}

    @abc.abstractmethod
    def picture(self, settings: Any) -> Picture:
        """Return the picture of these knobs; within 50 ms, at 250,000 triangles, too.

        Parameters
        ----------
        settings : Lesson.Settings
            Those in :attr:`Lesson.replays` are as when it was played; none is beyond its end.
        """

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the knobs of those pictures that tell most; some along the film by default."""
        values = self.film(lesson)
        chosen = sorted({round(i * (len(values) - 1) / (PAGE - 1)) for i in range(PAGE)})
        return [dataclasses.replace(settings, **{lesson.film: values[i]}) for i in chosen]

    def film(self, lesson: Lesson) -> Sequence[Any]:
        """Return all values of the knob that a film goes through, from the first to the last."""
        (field,) = (
            each for each in dataclasses.fields(lesson.Settings) if each.name == lesson.film
        )
        meta = field.metadata
        if meta["choices"]:
            return list(meta["choices"])
        if isinstance(field.default, bool):
            return [False, True]
        if isinstance(field.default, int):
            last = self.ends.get(field.name, meta["maximum"])
            return range(int(meta["minimum"]), int(last) + 1)
        low, high = meta["minimum"], meta["maximum"]
        return [low + (high - low) * i / (FILM - 1) for i in range(FILM)]

    def ray_shown(self, settings: Any) -> Rays | None:
        """Return the ray that these knobs choose, as a batch of one; None if they choose none."""
        return None

    def within(self, settings: Any) -> Any:
        """Return knobs of which none is beyond its end."""
        beyond = {name: last for name, last in self.ends.items() if getattr(settings, name) > last}
        return dataclasses.replace(settings, **beyond)


def any_structure(structure: Structure) -> str:
    """Accept every structure that answers the rays of a picture, see :attr:`Lesson.suits`."""
    if structure.answers is None or PRIMARY in structure.answers:
        return ""
    return f"{structure.name} answers {in_words(structure.answers)} rays only"


def only_its_own(structure: Structure) -> str:
    """Accept no other structure: for lessons that compare some of given settings."""
    return "the lesson compares structures with settings of its own"


@dataclass(frozen=True)
class Lesson:
    """One lesson.

    Attributes
    ----------
    name, label : str
        Key (a Python name), and name in the panel, in Title Case.
    slide : str
        Whose picture it is, one of :data:`.slides.SLIDES`.
    begin, look_for : str
        The sentence to begin with, and what to look for.
    question, answer : str
        To the class.
    source : str
        The module that does what is shown, such as ``"structures.grid.dda"``, below core.
    sample : str
        The sample scene it is taught on: ``"suzanne:subdivisions=3"``.
    play : callable
        Gets the subject, the settings and a Progress, and returns a :class:`Play`. It may offer
        coarser ones meanwhile (:meth:`..progress.Progress.offer`), complete by themselves.
        Raises InputError for a subject of which there is nothing to show, and Cancelled.
    Settings : type
        Its knobs.
    film : str
        The knob that a film goes through.
    structures : tuple of str
        Specs of the structures that it is about, such as ``"bvh:builder=median"``.
    suits : callable
        Whether another structure can stand in the place of the first of them: returns "", or why
        not in one sentence without a full stop.
    replays : tuple of str
        Knobs after which it is played anew.
    takes_frames : bool
        Whether it can be given an animation, as :attr:`Subject.history`.
    takes_ray : bool
        Whether it shows a ray that somebody else may choose, :attr:`Subject.rays`.
    """

    name: str
    label: str
    slide: str
    begin: str
    look_for: str
    question: str
    answer: str
    source: str
    sample: str
    play: Callable[[Subject, Any, Progress], Play]
    Settings: type
    film: str
    structures: tuple[str, ...] = ()
    suits: Callable[[Structure], str] = any_structure
    replays: tuple[str, ...] = ()
    takes_frames: bool = False
    takes_ray: bool = False

    @property
    def place(self) -> int:
        """Its place in the lecture: that of its slide."""
        return SLIDES.index(self.slide)

    @property
    def summary(self) -> str:
        """The sentence to begin with; what lists say of it."""
        return self.begin

    def key(self, settings: Any) -> tuple[Any, ...]:
        """Return what was played with: settings of equal keys share a play."""
        return tuple(getattr(settings, name) for name in self.replays)

    def parse(self, texts: Mapping[str, str]) -> Any:
        """Return the settings that texts of the command line mean.

        Raises
        ------
        InputError
            For an unknown knob or a value that does not fit.
        """
        return parse(self.Settings, texts, f"lesson {self.name}")

    def subject(
        self, scene: Scene, progress: Progress = SILENT, given: Sequence[Structure] = ()
    ) -> Subject:
        """Return what it is about: a scene, and the structures that it names, built over that.

        Parameters
        ----------
        given : sequence of Structure
            Those that stand in the places of the first.

        Raises
        ------
        InputError
            If one of them does not suit, or cannot be built over this scene.
        Cancelled
            From `progress`.
        """
        if len(given) > len(self.structures):
            count = len(self.structures)
            raise InputError(
                f"lesson {self.name} is about {count or 'no'} structure{'s' * (count != 1)}, "
                f"not {len(given)}"
            )
        for structure in given:
            if reason := self.suits(structure):
                raise InputError(f"lesson {self.name} cannot be given this structure: {reason}")
        built = list(given)
        for spec in self.structures[len(given) :]:
            built.append(build(scene, spec, progress))
        return Subject(scene, tuple(built))


def build(scene: Scene, spec: str, progress: Progress = SILENT) -> Structure:
    """Return a structure that a spec such as ``"bvh:arity=4"`` names, built with a log.

    Raises
    ------
    InputError
        If it cannot be built over this scene.
    Cancelled
        From `progress`.
    """
    name, texts = parse_spec(spec)
    entry = structure_named(name)
    settings: Any = parse(entry.Settings, texts, f"structure {name}")
    return entry.build(scene, settings, progress, log=True)
