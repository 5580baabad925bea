"""Where compiled kernels are kept, from one run to the next.

Numba keeps what it compiles in files; which, and what becomes of damaged ones, of full disks and of
versions that nobody uses any more, is said here. Numba's cache does not notice a changed callee in
another file, so the directory's name carries a hash of all of core's sources, but for lessons and
evaluation, which have no kernels, and of Numba's version.

Compiled kernels are not part of the zips. To ship them would take, beside 59 MB for each version of
Python: a processor to compile for that all have (Numba's ``NUMBA_CPU_NAME`` and its features, which
are part of the key under which it looks), keys without the path of the installation and the time of
its files, the exact build of Python and Numba in the fingerprint, and a trial on every start that
what was shipped still does on this machine what was compiled there. Numba promises none of this
across machines, and code for another processor ends the process without a word; so each machine
compiles for itself, in the background (:mod:`accelscope.addon.command.prepare`).
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import pickle
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

TOO_LONG = 5.0
"""Seconds; a kernel is saved within some milliseconds."""

WITHOUT_KERNELS = "lessons", "evaluation"
"""Folders of core whose files declare no kernel: an edit there compiles nothing anew."""

_root: Path | None = None
_is_prepared = False
_fault = ""


def set_cache_root(directory: str | os.PathLike[str]) -> None:
    """Choose where compiled kernels are kept; call it before any structure is imported."""
    global _root
    _root = Path(directory)


def cache_directory() -> Path:
    """Return the directory of compiled kernels for this very version of the sources."""
    if _root is not None:
        root = _root
    else:
        import platformdirs

        root = Path(platformdirs.user_cache_dir("accelscope")) / "kernels"
    return root / _fingerprint()


def cache_fault() -> str:
    """Return why what is compiled cannot be kept; empty if nothing has spoken against it."""
    return _fault


def is_kept() -> bool:
    """Say whether what is compiled now will be there at the next start."""
    return _is_prepared and not _fault and os.access(cache_directory(), os.W_OK)


def keep(dispatcher: Any, function: Callable, *, is_part: bool) -> None:
    """Let Numba's dispatcher of a function read from the cache, and keep there what it compiles.

    Parameters
    ----------
    is_part : bool
        Whether it is compiled as part of what calls it.
    """
    global _fault
    # What does not come from a file cannot be found again.
    if os.path.exists(function.__code__.co_filename) and _prepare():
        try:
            # What cache=True does, with a type of our own.
            dispatcher._cache = _cache_type()(function, is_part)
        except RuntimeError:
            _fault = "no folder can be made there"


@functools.cache
def _cache_type() -> type:
    """Return Numba's cache of one kernel, as one that is never the reason why a run fails."""
    from numba.core.caching import FunctionCache
    from numba.core.serialize import dumps

    from .kernel_compiler import for_parts, in_words

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

        def __init__(self, function: Callable, is_part: bool) -> None:
            super().__init__(function)
            self._is_part = is_part
            self._cache_file: Any = Sealed(self._cache_file)

        def _index_key(self, sig: Any, codegen: Any) -> Any:
            # As text: whoever reads an index would import what the types of all its entries are
            # of, which for a driver of walks is every structure.
            _, machine, code = super()._index_key(sig, codegen)
            return ", ".join(map(in_words, sig)), machine, code

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            target = for_parts(target_context) if self._is_part else target_context
            try:
                return super().load_overload(sig, target)
            except Exception:  # a file that is cut off, or names what is gone, may raise anything
                with contextlib.suppress(OSError):
                    self.flush()
                return None

        def save_overload(self, sig: Any, data: Any) -> None:
            global _fault
            try:
                with _alone_in(cache_directory()):
                    super().save_overload(sig, data)
            except OSError as error:
                _fault = error.strerror or str(error)

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


def _prepare() -> bool:
    """Point Numba at our cache directory; False where no writable place exists."""
    global _is_prepared
    import numba

    directory = cache_directory()
    if not _is_prepared:
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
        _is_prepared = True
    return os.access(directory, os.W_OK)


def _unused_for_a_month(directory: Path) -> bool:
    """Say whether no process has used a cache of another version for thirty days."""
    try:
        return time.time() - directory.stat().st_mtime > 30 * 86400.0
    except OSError:
        return False  # another process has been quicker, or a link leads nowhere
