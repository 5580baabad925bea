"""Kernels: scalar loops compiled by Numba, or run as plain Python where there is no Numba.

Every loop of the subject is written once, as pseudo-code a student can read, and decorated with
:func:`kernel`. A *dispatched* kernel has one implementation per type of its first argument, so one
driver serves every structure (:func:`dispatched`, :func:`implements`).

Rules, with their reasons:

- float64, no fastmath and no contraction: they change counters and hit ids.
- No ``parallel=True``: threads are ours (:mod:`.parallel`), Numba's would meet Blender's.
- No slices, no sorts, and min() and max() of two: each other number of arguments is a function of
  its own to compile, and a large kernel takes seconds more for a few of those.
- Elements of arrays are made :data:`whole`, indices in innermost loops :data:`unsigned`.

What is compiled (:mod:`.kernel_compiler`) is kept for the next start (:mod:`.kernel_cache`); at a
first use another process helps (:mod:`.another_process`).
"""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import os
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Literal

import numpy as np

from .another_process import CannotHelp, Task
from .kernel_cache import cache_fault, is_kept, keep
from .parallel import core_count
from .progress import Progress

OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
"""How kernels are compiled.

``_nrt=False`` leaves out Numba's reference counts: three quarters of the time of a short walk went
into counting up and down the arrays that all threads share. In return a kernel must not make
arrays; scratch memory comes from the caller. The wrapper for calls from C is never used.
"""

INNER = OPTIONS | {"no_cpython_wrapper": True}
"""For kernels that Python does not call: without the code that takes their arguments from Python,
which for a ray's thirty numbers costs more compiling than the kernel itself."""

INLINED = INNER | {"forceinline": True}
"""For kernels that are compiled into every caller."""

Role = Literal["whole", "part", "shader"]
"""How a kernel goes through Numba's compiler (:mod:`.kernel_compiler`)."""

whole = np.int64
"""What makes a whole number one of the type that kernels have: for an element of an array of
another type, Numba would compile whatever is called with it once more."""

unsigned = np.uint64
"""What makes an index unsigned: at a signed one Numba looks whether it counts from the end, which
takes up to a twentieth of a walk's time."""

ALONE = "ACCELSCOPE_COMPILE_ALONE"
"""The variable of the environment that, set to 1, keeps to one process that compiles."""

_is_plain = False
_one_at_a_time = threading.RLock()


@functools.cache
def _is_numba_there() -> bool:
    """Say whether Numba is installed and switched on, without importing it."""
    # Numba's own switch: it would then leave functions as they are, but not run them as we do.
    is_on = os.environ.get("NUMBA_DISABLE_JIT", "").strip() in ("", "0")
    return is_on and importlib.util.find_spec("numba") is not None


@functools.cache
def numba_fault() -> str | None:
    """Return why Numba does not compile kernels; None if it does.

    Returns
    -------
    str or None
        Empty if it is not installed, or is switched off. Otherwise what it raises when it is
        imported: for a version of NumPy that it does not know, or for one of its variables in the
        environment.
    """
    if not _is_numba_there():
        return ""
    try:
        import numba  # noqa: F401  only to see whether it works; that takes a quarter of a second
    except Exception as error:  # whatever is the matter with it, plain Python will do
        return " ".join(f"{type(error).__name__}: {error}".split())
    return None


def has_numba() -> bool:
    """Say whether kernels are compiled; the interface says so when they are not."""
    return numba_fault() is None


def kernel(function: Callable) -> Callable:
    """Compile a scalar loop with Numba; return it unchanged where there is no Numba."""
    return _declared(function, "whole", OPTIONS)


def inner(function: Callable) -> Callable:
    """Like :func:`kernel`, for what only kernels call; called from Python it is plain Python."""
    return _declared(function, "part", INNER)


def inlined(function: Callable) -> Callable:
    """Like :func:`inner`, for innermost loops: compiled into every caller instead of called.

    A call passes every number of a ray and every field of every array on its own.
    """
    return _declared(function, "part", INLINED)


def addressed(function: Callable) -> Callable:
    """Like :func:`kernel`, for what is called by its address (:meth:`Kernel.compiled_at`)."""
    return _declared(function, "whole", INNER)


def shader(function: Callable) -> Callable:
    """Like :func:`addressed`, for what others write: anything that Numba can compile."""
    return _declared(function, "shader", INNER)


def _declared(function: Callable, role: Role, options: dict[str, Any]) -> Callable:
    return Kernel(function, role, options) if _is_numba_there() else function


class Kernel:
    """A scalar loop that Numba compiles at its first call, or when another that calls it is.

    Only then is Numba asked for, and imported: of several hundred kernels a run needs a few, and
    one that only lists what there is needs none.

    Attributes
    ----------
    py_func : callable
        The loop as it is written.
    is_inner : bool
        Whether Python does not call it. One that Python calls nevertheless is called by a kernel
        that runs plain, and does, too, even if that is not asked for any more: compiled, it has no
        side for Python, and would crash.
    role : str
        Whether it is compiled by itself or as part of what calls it.
    is_plain : bool
        Whether it runs as it is written, whatever the others do.
    """

    def __init__(self, function: Callable, role: Role, options: dict[str, Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.is_inner = bool(options.get("no_cpython_wrapper"))
        self.role: Role = role
        self.is_plain = False
        self._options = options
        self._dispatcher: Any = None

    def __call__(self, *arguments: Any) -> Any:
        """Run it compiled, or as it is written where that is asked for or nothing compiles."""
        if _is_plain or self.is_plain or self.is_inner or not has_numba():
            with np.errstate(all="ignore"):  # as call() does where there is no Numba
                return self.py_func(*arguments)
        return self.dispatcher(*arguments)

    @property
    def dispatcher(self) -> Any:
        """What Numba makes of it: compiled for the types it is called with, or read from disk."""
        if self._dispatcher is None:
            with _one_at_a_time:
                if self._dispatcher is None:
                    self._dispatcher = self._make_dispatcher()
        return self._dispatcher

    def _make_dispatcher(self) -> Any:
        """Let Numba compile it at its first call, and keep what it has compiled."""
        import numba

        from .kernel_compiler import COMPILERS

        compile_by = numba.njit(pipeline_class=COMPILERS[self.role], **self._options)
        dispatcher = compile_by(self.py_func)
        keep(dispatcher, self.py_func, is_part=self.role == "part")
        return dispatcher

    def compiled_at(self, types: tuple[Any, ...]) -> tuple[int, Any]:
        """Return the address of what is compiled for arguments of these types, and what it returns.

        It stays there as long as the kernel does. It is called by Numba's own convention, without
        any side for Python.

        Returns
        -------
        address : int
        returned : Numba's type
        """
        with _one_at_a_time:
            self.dispatcher.compile(types)
            made = self.dispatcher.overloads[types]
            return (
                made.library.get_pointer_to_function(made.fndesc.llvm_func_name),
                made.signature.return_type,
            )

    @functools.cached_property
    def _numba_type_(self) -> Any:
        """What Numba takes it for where another kernel calls it."""
        from .kernel_compiler import KernelType

        return KernelType(f"kernel {self.py_func.__qualname__} {id(self)}", lambda types: self)


def run_plain(is_plain: bool) -> None:
    """Run kernels as plain Python from now on, or compiled again.

    Plain, nothing waits for a compiler. A walk takes a hundred times as long: for a small scene
    and a few rays that is nothing. Results are the same, bit for bit.
    """
    global _is_plain
    _is_plain = is_plain and has_numba()


@contextlib.contextmanager
def plain(is_wanted: bool) -> Iterator[None]:
    """Run kernels as plain Python while the block runs, if that is wanted."""
    run_plain(is_wanted)
    try:
        yield
    finally:
        run_plain(False)


def is_plain() -> bool:
    """Say whether kernels that could be compiled run as plain Python."""
    return _is_plain


@contextlib.contextmanager
def as_written(function: Any) -> Iterator[None]:
    """Run one kernel, and what it calls, as plain Python while the block runs, but no others."""
    if not isinstance(function, Kernel):
        yield
        return
    function.is_plain = True
    try:
        yield
    finally:
        function.is_plain = False


class Dispatched:
    """A kernel with one implementation per type of its first argument.

    Attributes
    ----------
    implementations : dict
        From a NamedTuple type, and another or None, to an implementation as it is written: for a
        first argument of this type where one of the others is of that one.
    """

    def __init__(self, function: Callable) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.implementations: dict[tuple[type, type | None], Callable] = {}
        self._kernels: dict[tuple[type, type | None], Kernel] = {}
        self._is_special = False

    def __call__(self, first: Any, *others: Any) -> Any:
        """Run the implementation for these arguments, as it is written."""
        key = self._chosen(type(first), map(type, others))
        return self.implementations.get(key, self.py_func)(first, *others)

    def add(self, key: tuple[type, type | None], function: Callable, *, inline: bool) -> None:
        """Add an implementation."""
        self._is_special |= key[1] is not None
        self.implementations[key] = function
        if _is_numba_there():
            self._kernels[key] = Kernel(function, "part", INLINED if inline else INNER)

    def _chosen(self, first: Any, others: Iterable[Any]) -> tuple[Any, Any]:
        """Return under which types the implementation for these types stands, if there is one."""
        if not self._is_special:
            return first, None
        special = (kind for kind in others if kind and (first, kind) in self.implementations)
        return first, next(special, None)

    @functools.cached_property
    def _numba_type_(self) -> Any:
        """What Numba takes it for where a kernel calls it."""
        from .kernel_compiler import KernelType, class_of

        def choose(types: tuple[Any, ...]) -> Kernel | None:
            kinds = [class_of(each) for each in types]
            return self._kernels.get(self._chosen(kinds[0], kinds[1:]))

        return KernelType(f"kernel {self.py_func.__qualname__} {id(self)}", choose)


def dispatched(function: Callable) -> Dispatched:
    """Declare a kernel with one implementation per type of its first argument.

    The decorated function states the signature and the contract. It is run where there is no
    implementation, and raises.
    """
    return Dispatched(function)


def implements(
    declared: Dispatched, record: type, *, beside: type | None = None, inline: bool = False
) -> Callable[[Callable], Callable]:
    """Register an implementation of a dispatched kernel for one NamedTuple type.

    Parameters
    ----------
    declared : dispatched kernel
    record : NamedTuple class
        The type of the first argument this implementation is for.
    beside : NamedTuple class, optional
        Only where one of the other arguments is of this type, too; for all others there is an
        implementation without.
    inline : bool
        Compile it into every caller, like :func:`inlined`.
    """

    def register(function: Callable) -> Callable:
        declared.add((record, beside), function, inline=inline)
        return function

    return register


def call(function: Callable, *arguments: Any) -> Any:
    """Call a compiled kernel from Python.

    Raises
    ------
    TypeError
        For an inner kernel: it has no Python side, and calling it would crash.
    """
    if not has_numba():
        # As with error_model="numpy": a division by zero is an infinity and no affair.
        with np.errstate(all="ignore"):
            return function(*arguments)
    if not _is_plain and getattr(function, "is_inner", False):
        raise TypeError(f"{function.__name__} is an inner kernel: only kernels call it")
    return function(*arguments)


@contextlib.contextmanager
def announcing(progress: Progress, what: str) -> Iterator[None]:
    """Announce the first compilation that begins while the block runs; otherwise say nothing.

    Where several things are done at once, `what` is a guess (:func:`at_first_compilation`).

    Parameters
    ----------
    what : str
        What the kernels are for (``"bvh"``).
    """
    if not has_numba():
        yield
        return
    fault_before = cache_fault()
    with at_first_compilation(lambda: progress.announce(f"compiling {what}, {how_often()}")):
        yield
    fault = cache_fault()
    if fault and not fault_before:
        progress.announce(f"what is compiled cannot be kept for the next start: {fault}")


@contextlib.contextmanager
def compiling_beside(work: Callable[..., None], *arguments: Any) -> Iterator[list[Task]]:
    """Have another process compile what is needed later, if anything is compiled in the block.

    What it compiles is found on disk afterwards. Nothing is left undone without it: what is not
    found is compiled here.

    Parameters
    ----------
    work : callable
        What the other process runs with these arguments, all of which can be pickled.

    Yields
    ------
    list of Task
        The other process, once there is one: to be waited for before what it compiles is used.
    """
    alone = os.environ.get(ALONE, "") not in ("", "0") or core_count() == 1
    if alone or _is_plain or not has_numba():
        yield []
        return
    tasks: list[Task] = []

    def begin() -> None:
        if is_kept():
            with contextlib.suppress(CannotHelp):
                tasks.append(Task(work, *arguments))

    with at_first_compilation(begin):
        try:
            yield tasks
        finally:
            for task in tasks:
                task.stop()


@contextlib.contextmanager
def at_first_compilation(act: Callable[[], object]) -> Iterator[None]:
    """Do something when Numba compiles the first kernel that it does not find on disk, if it does.

    It may be any thread's of this process, also one that has nothing to do with the block: Numba
    has one list of listeners. It tells at the moment it begins: what is on disk depends on types,
    so nothing that is written down beforehand would always be true.
    """
    from numba.core import event

    class First(event.Listener):
        """Acts once."""

        has_acted = False

        def on_start(self, event: Any) -> None:
            if not self.has_acted:
                self.has_acted = True
                act()

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:compile", First()):
        yield


def how_often() -> str:
    """Return how often kernels are compiled: once, if there is a place to keep them."""
    if is_kept():
        return "once after installation, some ten seconds"
    return "at every start, for there is no place to keep what is compiled"
