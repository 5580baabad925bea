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
- Numba's cache does not notice a changed callee in another file, so the cache directory's name
  carries a hash of all of core's sources, but for lessons and evaluation, which have no kernels,
  and of Numba's version.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import os
import pickle
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .progress import Progress

OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
"""How kernels are compiled.

``_nrt=False`` leaves out Numba's reference counts: three quarters of the time of a short walk went
into counting up and down the arrays that all threads share. In return a kernel must not make
arrays; scratch memory comes from the caller. The wrapper for calls from C is never used.
"""

TOO_LONG = 5.0
"""Seconds; a kernel is saved within some milliseconds."""

INNER = OPTIONS | {"no_cpython_wrapper": True}
"""For kernels that only kernels call: without the code that takes their arguments from Python,
which for a ray's thirty numbers costs more compiling than the kernel itself."""

whole = np.int64
"""What makes a whole number one of the type that kernels have: for a plain constant, or an element
of an array of another type, Numba would compile whatever is called with it once more."""

unsigned = np.uint64
"""What makes an index unsigned: at a signed one Numba looks whether it counts from the end, which
takes up to a twentieth of a walk's time."""

WITHOUT_KERNELS = "lessons", "evaluation"
"""Folders of core whose files declare no kernel: an edit there compiles nothing anew."""

_is_plain = False
_cache_root: Path | None = None
_cache_prepared = False
_cannot_be_kept = ""
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


def set_cache_root(directory: str | os.PathLike[str]) -> None:
    """Choose where compiled kernels are kept; call it before any structure is imported."""
    global _cache_root
    _cache_root = Path(directory)


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
    global _cannot_be_kept
    import numba

    _listen_for_compiling()
    dispatcher = numba.njit(**options)(function)
    # What does not come from a file cannot be found again.
    if os.path.exists(function.__code__.co_filename) and _prepare_cache():
        try:
            # What cache=True does, with a type of our own.
            dispatcher._cache = _cache_type()(function)
        except RuntimeError:
            _cannot_be_kept = "no folder can be made there"
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


# ------------------------------------------------------------------------- where they are kept


@functools.cache
def _cache_type() -> type:
    """Return Numba's cache of one kernel, as one that is never the reason why a run fails."""
    from numba.core.caching import FunctionCache
    from numba.core.serialize import dumps

    class Sealed:
        """Numba's files of one kernel, each with a hash of what is in it.

        Numba runs what it finds; a disk on which one bit has changed would end the process.
        """

        def __init__(self, file: Any) -> None:
            self.file = file
            self.flush = file.flush

        def save(self, key: Any, data: Any) -> None:
            # With its key, since the index, which says where it is, may be damaged, too.
            content = dumps((key, data))
            self.file.save(key, (hashlib.sha256(content).digest(), content))

        def load(self, key: Any) -> Any:
            found = self.file.load(key)
            if found is None:
                return None
            seal, content = found
            if hashlib.sha256(content).digest() != seal:
                return None
            named, data = pickle.loads(content)
            return data if named == key else None

    class Cache(FunctionCache):
        """What is damaged is compiled anew; what there is no room for is not kept."""

        def __init__(self, function: Callable) -> None:
            super().__init__(function)
            self._cache_file: Any = Sealed(self._cache_file)

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            try:
                return super().load_overload(sig, target_context)
            except Exception:  # a file that is cut off, or names what is gone, may raise anything
                with contextlib.suppress(OSError):
                    self.flush()
                return None

        def save_overload(self, sig: Any, data: Any) -> None:
            global _cannot_be_kept
            try:
                with _alone_in(cache_directory()):
                    super().save_overload(sig, data)
            except OSError as error:
                _cannot_be_kept = error.strerror or str(error)

    return Cache


@contextlib.contextmanager
def _alone_in(directory: Path) -> Iterator[None]:
    """Keep other processes from saving while the block runs: what they write in between is lost.

    Numba reads the index of a kernel's types, adds one, and writes it.
    """
    lock = directory / "saving"
    while True:
        try:
            lock.mkdir()  # by one process only, on every system
            break
        except FileExistsError:
            time.sleep(0.001)
            with contextlib.suppress(OSError):
                if time.time() - lock.stat().st_mtime > TOO_LONG:  # that process was killed
                    lock.rmdir()
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            lock.rmdir()


def cache_directory() -> Path:
    """Return the directory of compiled kernels for this very version of the sources."""
    if _cache_root is not None:
        root = _cache_root
    else:
        import platformdirs

        root = Path(platformdirs.user_cache_dir("accelscope")) / "kernels"
    return root / _fingerprint()


@functools.cache
def _fingerprint() -> str:
    """Return a hash over Python's and Numba's version and the sources of what may have kernels.

    Numba is not imported for it.
    """
    import importlib.metadata  # it brings a mail reader along

    checked = os.environ.get("NUMBA_BOUNDSCHECK", "")  # other code comes out
    version = importlib.metadata.version("numba")
    digest = hashlib.sha256(f"{sys.version} {version} {checked}".encode())
    core = Path(__file__).parent
    for path in sorted(core.rglob("*.py")):
        if path.relative_to(core).parts[0] not in WITHOUT_KERNELS:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _prepare_cache() -> bool:
    """Point Numba at our cache directory; False where no writable place exists."""
    global _cache_prepared
    import numba

    directory = cache_directory()
    if not _cache_prepared:
        try:
            directory.mkdir(parents=True, exist_ok=True)
            # Reading does not make a directory younger: without this, another version would take
            # one that is used every day for forgotten.
            os.utime(directory)
            for old in directory.parent.iterdir():
                if old != directory and _unused_for_a_month(old):
                    shutil.rmtree(old, ignore_errors=True)
        except OSError:
            return False
        numba.config.CACHE_DIR = str(directory)
        _cache_prepared = True
    return os.access(directory, os.W_OK)


def _unused_for_a_month(directory: Path) -> bool:
    """Say whether no process has used a cache of another version for thirty days."""
    try:
        return time.time() - directory.stat().st_mtime > 30 * 86400.0
    except OSError:
        return False  # another process has been quicker, or a link leads nowhere


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

    kept_before = not _cannot_be_kept

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
    if kept_before and _cannot_be_kept:
        progress.announce(f"what is compiled cannot be kept for the next start: {_cannot_be_kept}")


def how_often() -> str:
    """Return how often kernels are compiled: once, if there is a place to keep them."""
    if _cache_prepared and not _cannot_be_kept and os.access(cache_directory(), os.W_OK):
        return "once after installation, some ten seconds"
    return "at every start, for there is no place to keep what is compiled"
