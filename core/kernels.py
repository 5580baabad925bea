"""Kernels: scalar loops compiled by Numba, or run as plain Python where there is no Numba.

Every loop of the subject is written once, as pseudo-code a student can read, and decorated with
:func:`kernel`. A *dispatched* kernel has one implementation per type of its first argument, so one
driver serves every structure (:func:`dispatched`, :func:`implements`).

Rules, with their reasons:

- float64, no fastmath and no contraction: they change counters and hit ids.
- No ``parallel=True``: threads are ours (:mod:`.parallel`), Numba's would meet Blender's.
- No slices, no sorts, and min() and max() of two: each other number of arguments is a function of
  its own to compile, and a large kernel takes seconds more for a few of those.
- Constants and elements are made :data:`whole`, indices in innermost loops :data:`unsigned`.

What is compiled is kept for the next start (:mod:`.kernel_cache`).
"""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import os
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .kernel_cache import cache_fault, is_kept, keep
from .progress import Progress

OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
"""How kernels are compiled.

``_nrt=False`` leaves out Numba's reference counts: three quarters of the time of a short walk went
into counting up and down the arrays that all threads share. In return a kernel must not make
arrays; scratch memory comes from the caller. The wrapper for calls from C is never used.
"""

INNER = OPTIONS | {"no_cpython_wrapper": True}
"""For kernels that only kernels call: without the code that takes their arguments from Python,
which for a ray's thirty numbers costs more compiling than the kernel itself."""

whole = np.int64
"""What makes a whole number one of the type that kernels have: for a plain constant, or an element
of an array of another type, Numba would compile whatever is called with it once more."""

unsigned = np.uint64
"""What makes an index unsigned: at a signed one Numba looks whether it counts from the end, which
takes up to a twentieth of a walk's time."""

_is_plain = False
_one_at_a_time = threading.RLock()
_untold: list[Callable[[], None]] = []
"""What tells Numba of implementations of dispatched kernels; done when it compiles something."""


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
    return _declared(function, OPTIONS)


def inner(function: Callable) -> Callable:
    """Like :func:`kernel`, for what only kernels call; called from Python it is plain Python."""
    return _declared(function, INNER)


def inlined(function: Callable) -> Callable:
    """Like :func:`inner`, for innermost loops: compiled into every caller instead of called.

    A call passes every number of a ray and every field of every array on its own.
    """
    return _declared(function, INNER | {"forceinline": True})


def _declared(function: Callable, options: dict[str, Any]) -> Callable:
    return Kernel(function, options) if _is_numba_there() else function


class Kernel:
    """A scalar loop that Numba compiles at its first call, or when another that calls it is.

    Only then is Numba asked for, and imported: of several hundred kernels a run needs a few, and
    one that only lists what there is needs none.

    Attributes
    ----------
    py_func : callable
        The loop as it is written.
    is_inner : bool
        Whether only kernels call it. One that Python calls nevertheless is called by a kernel that
        runs plain, and does, too, even if that is not asked for any more: compiled, it has no side
        for Python, and would crash.
    """

    def __init__(self, function: Callable, options: dict[str, Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.is_inner = bool(options.get("no_cpython_wrapper"))
        self._options = options
        self._dispatcher: Any = None

    def __call__(self, *arguments: Any) -> Any:
        """Run it compiled, or as it is written where that is asked for or nothing compiles."""
        if _is_plain or self.is_inner or not has_numba():
            with np.errstate(all="ignore"):  # as call() does where there is no Numba
                return self.py_func(*arguments)
        return self.dispatcher(*arguments)

    @property
    def dispatcher(self) -> Any:
        """What Numba makes of it: compiled for the types it is called with, or read from disk."""
        if self._dispatcher is None:
            with _one_at_a_time:
                if self._dispatcher is None:
                    self._dispatcher = _make_dispatcher(self.py_func, self._options)
        return self._dispatcher

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

    @property
    def _numba_type_(self) -> Any:
        """What Numba takes it for where another kernel calls it."""
        return self.dispatcher._numba_type_


def _make_dispatcher(function: Callable, options: dict[str, Any]) -> Any:
    """Let Numba compile a function at its first call, and keep what it has compiled."""
    import numba

    _listen_for_compiling()
    dispatcher = numba.njit(**options)(function)
    keep(dispatcher, function)
    return dispatcher


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


def dispatched(function: Callable) -> Callable:
    """Declare a kernel with one implementation per type of its first argument.

    The decorated function states the signature and the contract; it is never run.
    """
    return functools.singledispatch(function)


def implements(
    declared: Any, record: type, *, beside: type | None = None, inline: bool = False
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
        Compile it into every caller, like :func:`inlined`. What is inlined is compiled by itself
        as well: of several layers of it, the innermost as often as there are layers.
    """
    options = INNER | {"forceinline": True} if inline else INNER
    table = declared.__dict__.setdefault("implementations", {})

    def register(function: Callable) -> Callable:
        table[record, beside] = function

        def by_type(first: Any, *others: Any) -> Any:
            kinds = [type(other) for other in others]
            special = next((kind for kind in kinds if (record, kind) in table), None)
            return table[record, special](first, *others)

        declared.register(record)(by_type if any(kind for _, kind in table) else function)
        if _is_numba_there():
            _untold.append(
                functools.partial(_overload, declared, record, beside, function, options)
            )
        return function

    return register


@functools.cache
def _listen_for_compiling() -> None:
    """Tell Numba of the implementations it does not know of, from now on, before it compiles.

    What it finds on disk needs none, and telling takes as long as finding.
    """
    from numba.core import event

    class Telling(event.Listener):
        def on_start(self, event: Any) -> None:
            while _untold:
                _untold.pop(0)()

        def on_end(self, event: Any) -> None:
            pass

    event.register("numba:compile", Telling())


def _overload(
    declared: Any, record: type, beside: type | None, function: Callable, options: dict[str, Any]
) -> None:
    """Make Numba choose an implementation of a dispatched kernel by the types of its arguments."""
    from numba import types
    from numba.extending import overload

    table = declared.implementations

    def class_of(argument: Any) -> type | None:
        is_record = isinstance(argument, types.BaseNamedTuple)
        return argument.instance_class if is_record else None

    def choose(first: Any, *others: Any) -> Callable | None:
        if class_of(first) is not record:
            return None
        kinds = [class_of(other) for other in others]
        special = next((kind for kind in kinds if kind and (record, kind) in table), None)
        return function if special is beside else None

    overload(declared, strict=False, jit_options=options)(choose)


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

    It may be any thread's of this process, also one that has nothing to do with the block: Numba
    has one list of listeners. So `what` is a guess where several things are done at once.

    Numba itself tells, at the moment it begins: whether a kernel is in the cache depends on the
    types it is called with, so nothing that is written down beforehand would always be true.

    Parameters
    ----------
    what : str
        What the kernels are for (``"bvh"``).
    """
    if not has_numba():
        yield
        return
    from numba.core import event

    fault_before = cache_fault()

    class Announcement(event.Listener):
        """Hears of every kernel that is not in the cache; speaks once."""

        is_made = False

        def on_start(self, event: Any) -> None:
            if not self.is_made:
                self.is_made = True
                progress.announce(f"compiling {what}, {how_often()}")

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:compile", Announcement()):
        yield
    fault = cache_fault()
    if fault and not fault_before:
        progress.announce(f"what is compiled cannot be kept for the next start: {fault}")


def how_often() -> str:
    """Return how often kernels are compiled: once, if there is a place to keep them."""
    if is_kept():
        return "once after installation, some ten seconds"
    return "at every start, for there is no place to keep what is compiled"
