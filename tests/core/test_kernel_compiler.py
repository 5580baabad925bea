"""How kernels go through Numba's compiler: each once, and with all that Numba itself would do."""

import os
import subprocess
import sys

import pytest
from accelscope.core import kernels
from compiled_names import COMPILED

pytestmark = pytest.mark.skipif(not kernels.has_numba(), reason="nothing is compiled here")

TOY = """
from typing import NamedTuple
import numpy as np
from accelscope.core.kernels import dispatched, implements, inlined, inner, kernel

class Rows(NamedTuple):
    values: np.ndarray

class Twice(NamedTuple):
    values: np.ndarray

@dispatched
def value_at(rows, index):
    raise TypeError(f"no value_at for {type(rows).__name__}")

@implements(value_at, Rows)
def value_as_it_is(rows, index):
    return scaled(rows.values[index], 1)

@implements(value_at, Twice, inline=True)
def value_twice(rows, index):
    return scaled(rows.values[index], 2)

@inner
def scaled(value, factor):
    return value * factor

@inlined
def last_of(rows, factor):
    return scaled(value_at(rows, len(rows.values) - 1), factor)

@kernel
def total(rows, count):
    found = 0.0
    for i in range(count):
        found += scaled(value_at(rows, i), count)
    return found + last_of(rows, 3)

@kernel
def twice_total(rows, count):
    return 2.0 * total(rows, count)
"""

HEAD = """
import sys
sys.path.insert(0, FOLDER)
from accelscope.core import kernel_cache
kernel_cache.set_cache_root(FOLDER + "/kernels")
import numpy as np
import toy
from accelscope.core.kernels import call
values = np.arange(1.0, 4.0)
"""


def run(folder, code, **environment):
    (folder / "toy.py").write_text(TOY)
    done = subprocess.run(
        [sys.executable, "-c", HEAD.replace("FOLDER", repr(str(folder))) + COMPILED + code],
        capture_output=True, text=True, check=False, env={**os.environ, **environment},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()


BOTH = """
print(call(toy.total, toy.Rows(values), 3), call(toy.total, toy.Twice(values), 3))
print(*sorted(compiled))
"""


def test_constants_are_no_types_of_their_own_and_each_implementation_is_chosen(tmp_path):
    value, compiled = run(tmp_path, BOTH)
    assert value == "27.0 54.0"
    # What is scaled is a float64, by an int64, constant or not: that is one function.
    assert compiled == "last_of last_of scaled total total value_as_it_is value_twice"


def test_parts_are_found_on_disk_by_what_is_compiled_later(tmp_path):
    run(tmp_path, "print(call(toy.total, toy.Rows(values), 3))")
    value, compiled = run(
        tmp_path, "print(call(toy.twice_total, toy.Rows(values), 3))\nprint(*compiled)"
    )
    assert (value, compiled) == ("54.0", "twice_total")
    value, compiled = run(tmp_path, BOTH)
    # The parts of the other kind are new; what they share is not.
    assert (value, compiled) == ("27.0 54.0", "last_of total value_twice")
    assert run(tmp_path, BOTH) == ["27.0 54.0", ""]


FAR = """
try:
    call(toy.total, toy.Twice(values), 4)
except IndexError as error:
    print(error)
"""


def test_an_exception_comes_out_of_a_part(tmp_path):
    for _ in range(2):  # compiled, and read from disk
        assert run(tmp_path, FAR, NUMBA_BOUNDSCHECK="1") == ["index is out of bounds"]


def test_what_has_no_implementation_is_said(tmp_path):
    lines = run(tmp_path, """
try:
    call(toy.total, (values,), 3)
except Exception as error:
    print(type(error).__name__, "value_at" in str(error))
""")  # fmt: skip
    assert lines == ["TypingError True"]


def test_types_of_one_name_are_told_apart_by_their_modules():
    from typing import NamedTuple

    import numba
    import numpy as np
    from accelscope.core.kernel_compiler import in_words

    def made(module):
        return type("Rows", (NamedTuple("Rows", [("values", np.ndarray)]),), {"__module__": module})

    values = np.zeros(3)
    one, other = (numba.typeof(made(module)(values)) for module in ("one", "other"))
    assert in_words(one) == "one.Rows(Array (float64, 1, 'C', True, True))"
    assert in_words(other).startswith("other.Rows(")
    assert in_words(numba.typeof((1, None))) == "(Integer 'int64', NoneType 'none')"
