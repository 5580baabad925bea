"""DispatchRays: a program over a scene's camera, pixel by pixel, on all cores."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..contract.events import make_log, no_log
from ..contract.structure import Structure
from ..errors import InputError
from ..geometry.instances import Instanced, levels_of_mesh
from ..geometry.rays import Rays
from ..geometry.solids.mixed import MOVING_TRIANGLE, Mixed
from ..geometry.triangles import Triangles
from ..kernels import call, has_numba, is_plain
from ..parallel import Spare, for_chunks
from ..progress import SILENT, Progress
from ..scene import Scene
from . import shaders as shading
from . import stage as stages
from .candidates import shaded
from .program import Program
from .records import LinkedRow, Row, declared
from .shaders import Shaders, shaders_of
from .stage import MOST_TYPES, STAGE_NAMES, STAGES, Stage, make_frames
from .system import Launch, Output, Ray
from .system import Scene as SceneRecord
from .tables import scene_words, set_limits, shader_tables, tables_of
from .trace import Bundle, dispatch_rays, trace


@dataclass(frozen=True)
class Launched:
    """What a launch has made.

    Attributes
    ----------
    width, height : int
    colours : (height, width, 4) float64
        Red, green, blue and alpha as the program wrote them.
    calls : (height, width, len(STAGE_NAMES)) int32
        How often each stage was called for each pixel.
    by_type : dict of str to dict of str to int
        The same over all pixels, for each class of rays.
    seconds : float
        Without compiling, if anything was compiled before.
    """

    width: int
    height: int
    colours: np.ndarray
    calls: np.ndarray
    by_type: dict[str, dict[str, int]]
    seconds: float

    @property
    def totals(self) -> dict[str, int]:
        """How often each stage was called, by name."""
        sums = self.calls.sum(axis=(0, 1), dtype=np.int64)
        return dict(zip(STAGE_NAMES, sums.tolist()))

    @property
    def picture(self) -> np.ndarray:
        """The picture, (height, width, 3) float64 from 0 to 1, over black where alpha is less."""
        colours = np.clip(np.nan_to_num(self.colours), 0.0, 1.0)
        return colours[:, :, :3] * colours[:, :, 3:]


@dataclass(frozen=True)
class State:
    """A state of a ray, as :func:`.stage.tell` notes it.

    Attributes
    ----------
    name : str
        One of :data:`.stage.STATE_NAMES`.
    depth : int
        Of recursion; 0 in ray generation.
    ray_type : int
    instance, primitive : int
        -1 for none.
    t : float
    origin, direction : (float, float, float), optional
        Of the ray that begins, if the state is ``trace_ray``.
    """

    name: str
    depth: int
    ray_type: int
    instance: int
    primitive: int
    t: float
    origin: tuple[float, ...] = ()
    direction: tuple[float, ...] = ()


def state_of(told: tuple[Any, ...]) -> State:
    """Return a state as :func:`.stage.tell` has noted it."""
    number, depth, kind, instance, primitive, t, *ray = told
    name = stages.STATE_NAMES[number]
    where = (tuple(float(each) for each in vector) for vector in ray)
    return State(name, int(depth), int(kind), int(instance), int(primitive), float(t), *where)


class Pipeline:
    """A program made ready for a structure.

    Parameters
    ----------
    structure : Structure
    program : Program
    geometry_flags : sequence of int
        GEOMETRY_FLAG_... of each geometry of a mesh: each object, where there are no instances.

    Raises
    ------
    InputError
        If the program is none for this scene, or the structure none for every ray.
    """

    def __init__(
        self, structure: Structure, program: Program, geometry_flags: Sequence[int] = (0,)
    ) -> None:
        refuse_structure(structure)
        self.structure, self.program = structure, program
        self.shaders = shaders_of(program)
        refuse_scene(structure.scene, self.shaders)
        self.compiler = shading.Compiler()
        self._tables = tables_of(structure, geometry_flags)

    def launch(
        self,
        rays: Rays,
        width: int,
        height: int,
        *,
        threads: int = 0,
        progress: Progress = SILENT,
    ) -> Launched:
        """Run the program for every pixel.

        Parameters
        ----------
        rays : Rays
            The camera's, row by row from the top left, (width * height).
        threads : int
            0 takes every core.

        Raises
        ------
        InputError
            For what a shader does that the specification leaves undefined, or cannot be compiled.
        Cancelled
            From `progress`.
        """
        count = width * height
        colours = np.zeros((count, 4))
        calls = np.zeros((count, len(STAGES)), np.int32)
        made: list[Desk] = []

        def make() -> Desk:
            desk = PlainDesk(self) if is_plain() or not has_numba() else CompiledDesk(self)
            made.append(desk)
            return desk

        spare = Spare(make)
        with spare.lent():
            pass  # compiled, if need be, before the clock runs
        start = time.perf_counter()

        def run(first: int, last: int) -> None:
            with spare.lent() as desk:
                try:
                    desk.run(rays, width, height, first, last, colours, calls)
                except (InputError, RuntimeError):
                    raise
                except Exception as error:
                    pixel = int(desk.stage.now[stages.PIXEL])
                    raise self._explained(error, rays, width, height, pixel) from error

        for_chunks(run, count, threads, progress, "Running the program")
        seconds = time.perf_counter() - start
        by_type = sum((desk.stage.calls for desk in made), np.zeros((MOST_TYPES, len(STAGES)), int))
        return Launched(
            width, height, colours.reshape(height, width, 4),
            calls.reshape(height, width, len(STAGES)), self._named(by_type), seconds,
        )  # fmt: skip

    def record(self, rays: Rays, width: int, height: int, pixel: int) -> tuple[list[State], Any]:
        """Run the program for one pixel in plain Python, by the same functions; tell all states.

        Returns
        -------
        states : list of State
        log : Log
            What the walks of its rays noted, one after the other.
        """
        log = make_log(1 << 16)
        desk = PlainDesk(self, log=log)
        states: list[tuple[Any, ...]] = []
        desk.set_states(states)
        colours, calls = np.zeros((width * height, 4)), np.zeros((width * height, len(STAGES)), int)
        try:
            desk.run(rays, width, height, pixel, pixel + 1, colours, calls)
        except (InputError, RuntimeError):
            raise
        except Exception as error:
            raise self._explained(error, rays, width, height, pixel) from error
        return [state_of(told) for told in states], log

    def _explained(
        self, error: Exception, rays: Rays, width: int, height: int, pixel: int
    ) -> Exception:
        """Return what a shader has raised as the user's error, with the line of its source.

        Compiled code does not know its lines: the pixel is made again in plain Python.
        """
        files = {each.function.__code__.co_filename for each in self.shaders.all_of_them()}
        if line_in(error, files) is None:
            nothing = np.zeros((width * height, 4)), np.zeros((width * height, len(STAGES)), int)
            try:
                PlainDesk(self).run(rays, width, height, pixel, pixel + 1, *nothing)
            except Exception as again:
                error = again
        where = line_in(error, files)
        if where is None:
            return error  # a defect of ours
        return InputError(
            f"{where}: {type(error).__name__}: {error} (pixel {pixel % width},{pixel // width})"
        )

    def _named(self, by_type: np.ndarray) -> dict[str, dict[str, int]]:
        names = list(self.program.ray_types)
        found = {}
        for number, row in enumerate(by_type):
            if number < len(names) or row.any():
                name = names[number] if number < len(names) else f"type {number}"
                found[name] = dict(zip(STAGE_NAMES, row.tolist()))
        return found


def line_in(error: Exception, files: set[str]) -> str | None:
    """Return file and line of the innermost call in one of some files that raised an exception."""
    found, trace = None, error.__traceback__
    while trace is not None:
        name = trace.tb_frame.f_code.co_filename
        if name in files:
            found = f"{Path(name).name}, line {trace.tb_lineno}"
        trace = trace.tb_next
    return found


class Desk:
    """What one thread works at."""

    stage: Stage

    def run(
        self, rays: Rays, width: int, height: int, first: int, last: int, colours: np.ndarray,
        calls: np.ndarray,
    ) -> None:  # fmt: skip
        """Run the program for some pixels, and write what they become."""
        raise NotImplementedError


def records() -> tuple[np.ndarray, np.ndarray]:
    """Return room for what ray generation is given: launch and output."""
    return np.zeros((1, declared(Launch).size)), np.zeros((1, declared(Output).size))


class PlainDesk(Desk):
    """A desk where everything is plain Python."""

    def __init__(self, pipeline: Pipeline, log: Any = None) -> None:
        links: dict[str, Any] = {}
        structure = pipeline.structure
        own = pipeline.shaders
        tables = shader_tables(own, lambda shader: shading.plain(shader, links))
        words, lights = scene_words(structure.scene)
        scene = LinkedRow(
            declared(SceneRecord).constant, words, trace=trace_plainly, light_rows=lights
        )
        payloads = np.empty((stages.MOST_RECURSION + 1, 2), dtype=object)
        self.stage = Stage(
            **tables, **pipeline._tables, **make_frames(), payloads=payloads, scene=scene,
            states=np.zeros(0, np.int64),
        )  # fmt: skip
        set_limits(self.stage, pipeline.program, own)
        self._links, self._scene, self._structure = links, scene, structure
        self._log = no_log() if log is None else log
        self._ray_generation = shading.plain(own.ray_generation, links)
        self._link()

    def set_states(self, states: list[Any]) -> None:
        """Note states into a list from now on."""
        self.stage = self.stage._replace(states=states)
        self._link()

    def _link(self) -> None:
        self._links["stage"] = self.stage
        bundle = Bundle(
            self._structure.arrays, shaded(self._structure.geometry, self.stage),
            self._structure._deep_workspace(), self._log,
        )  # fmt: skip
        object.__setattr__(self._scene, "bundle", bundle)

    def run(
        self, rays: Rays, width: int, height: int, first: int, last: int, colours: np.ndarray,
        calls: np.ndarray,
    ) -> None:  # fmt: skip
        """Run the program for some pixels in plain Python."""
        run = getattr(dispatch_rays, "py_func", dispatch_rays)
        with np.errstate(all="ignore"):
            run(
                self.stage, self._ray_generation, *records(), rays.origins, rays.directions,
                width, height, first, last, colours, calls,
            )  # fmt: skip


def trace_plainly(*arguments: Any) -> int:
    """Trace a ray in plain Python, whatever else is compiled."""
    return int(getattr(trace, "py_func", trace)(*arguments))


class CompiledDesk(Desk):
    """A desk of addresses."""

    def __init__(self, pipeline: Pipeline) -> None:
        import numba

        from .compiled import PointerType, kept

        structure, own = pipeline.structure, pipeline.shaders
        tables = shader_tables(own, pipeline.compiler.address)
        words, lights = scene_words(structure.scene)
        payloads = np.zeros((stages.MOST_RECURSION + 1, 2), np.int64)
        self.stage = Stage(
            **tables, **pipeline._tables, **make_frames(), payloads=payloads,
            scene=int(words.ctypes.data), states=np.zeros(0, np.int64),
        )  # fmt: skip
        set_limits(self.stage, pipeline.program, own)
        stage_memory = kept(self.stage)
        self._address = int(stage_memory.ctypes.data)
        bundle = Bundle(
            structure.arrays, shaded(structure.geometry, self._address),
            structure._deep_workspace(), no_log(),
        )  # fmt: skip
        bundle_memory = kept(bundle)
        whole = numba.types.int64
        kinds = PointerType(numba.typeof(bundle)), *(whole,) * 8
        scene = Row(declared(SceneRecord), words)
        scene.light_rows = int(lights.ctypes.data)
        scene.bundle = int(bundle_memory.ctypes.data)
        traced: Any = trace
        scene.trace, _ = traced.compiled_at(kinds)
        self._ray_generation = pipeline.compiler.address(own.ray_generation)
        # Addresses keep nothing alive.
        self._alive = words, lights, stage_memory, bundle, bundle_memory, scene
        for depth in range(stages.MOST_RECURSION + 1):
            Row(declared(Ray), self.stage.frames[depth]).stage = self._address

    def run(
        self, rays: Rays, width: int, height: int, first: int, last: int, colours: np.ndarray,
        calls: np.ndarray,
    ) -> None:  # fmt: skip
        """Run the program for some pixels."""
        call(
            dispatch_rays, self._address, self._ray_generation, *records(), rays.origins,
            rays.directions, width, height, first, last, colours, calls,
        )  # fmt: skip


# --------------------------------------------------------------------------- what is refused


def refuse_structure(structure: Structure) -> None:
    """Refuse a structure through which a ray cannot be traced on its own.

    Raises
    ------
    InputError
        Naming others.
    """
    others = "choose bvh, kdtree, octree, grid or naive"
    if structure.answers is not None or not hasattr(structure.arrays, "_fields"):
        raise InputError(f"{structure.name} does not answer every ray of a program; {others}")
    if structure.made() is not None:
        advice = "leave 'lazy' at no" if hasattr(structure.settings, "lazy") else others
        raise InputError(
            f"the cells of {structure.name} are made by rays: one that met a cell not made yet "
            f"would begin anew, and call its shaders again; {advice}"
        )
    if len(structure.remembered):
        raise InputError(f"{structure.name} remembers what rays before have hit; {others}")


def refuse_scene(scene: Scene, own: Shaders) -> None:
    """Refuse a scene of which a program has no hit groups.

    Raises
    ------
    InputError
    """
    if levels_of_mesh(scene.geometry) > 1:
        raise InputError(
            f"{scene.name} has instances within instances; the pipeline knows two levels, as DXR "
            "does: choose --instances flatten",
            scene.name,
        )
    bottom = [scene.geometry]
    if isinstance(scene.geometry, Instanced):
        bottom = list(scene.geometry.meshes)
    if not all(isinstance(each, Triangles | Mixed) for each in bottom):
        raise InputError(
            f"{scene.name} holds solids that are made of others; a program meets triangles and "
            "elementary solids only",
            scene.name,
        )
    # Of each mesh, whether its items are triangles.
    are = [
        np.ones(1, bool) if isinstance(each, Triangles) else each.kinds <= MOVING_TRIANGLE
        for each in bottom
    ]
    has_triangles = any(each.any() for each in are)
    has_procedurals = not all(each.all() for each in are)
    if has_procedurals and not own.procedurals:
        raise InputError(
            f"{scene.name} holds solids, which are procedural primitives, and the program has no "
            "hit group with an intersection shader; choose one that has (spheres, torus), or "
            "triangles",
            scene.name,
        )
    if has_triangles and not own.triangles:
        raise InputError(
            f"{scene.name} holds triangles, and the program has hit groups for procedural "
            "primitives only; add one without an intersection shader",
            scene.name,
        )
