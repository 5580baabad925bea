"""How Numba compiles kernels: each loop once, by the passes that scalar loops have a use for.

Half of what Numba does by itself is of no use to them, and whoever uses a structure for the first
time waits for it. It lets others say how functions go through its compiler; we say so:

- An inner kernel becomes machine code as part of the kernel that Python calls, and is optimised
  there. By itself, it is kept as LLVM's intermediate code, for whatever calls it next.
- Which implementation of a dispatched kernel is meant, a type of our own says; it is compiled once
  for each combination of types, and kept, like any kernel.
- What an operator makes of its arguments' types is looked up once, instead of wherever it occurs.
- Passes for what no kernel has are left out: closures, generators, `with`, inlining before types
  are known, loops over tuples, parallel loops, annotations.

Results and counters are the same, bit for bit. This file needs Numba; :mod:`.kernels` imports it
when something is compiled.
"""

from __future__ import annotations

import copy
import functools
from typing import Any

from numba import types
from numba.core import typed_passes, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import AnalysisPass, PassManager, register_pass
from numba.core.environment import lookup_environment
from numba.core.sigutils import normalize_signature
from numba.extending import models, register_model

ENVIRONMENT = "_ZN08NumbaEnv"
"""How the names of the variables begin that hold what a function needs of Python."""

# ------------------------------------------------------------------- the type of a kernel


class KernelType(types.Callable, types.Dummy):
    """What a kernel, dispatched or not, is to another one that calls it.

    Parameters
    ----------
    name : str
        Unique.
    choose : callable
        Returns the kernel for types of arguments; None if there is none.
    """

    def __init__(self, name: str, choose: Any) -> None:
        self.choose = choose
        super().__init__(name)

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """Have the kernel compiled for these arguments, and return its signature."""
        kernel = self.choose(args)
        if kernel is None:
            return None
        dispatcher = kernel.dispatcher
        pysig, args = dispatcher._compiler.fold_argument_types(args, kws)
        # A constant is no type of its own: nothing is compiled once more for it.
        args = tuple(types.unliteral(each) for each in args)
        dispatcher.compile(args)
        return dispatcher.overloads[args].signature.replace(pysig=pysig)

    def get_call_signatures(self) -> Any:
        """Name no signatures, but say that there are some."""
        return [], True

    def get_impl_key(self, sig: Any) -> Any:
        """Return what the compiled kernel is registered by."""
        args, _ = normalize_signature(sig.args)
        return self.choose(args).dispatcher.overloads[args].entry_point


register_model(KernelType)(models.OpaqueModel)


def class_of(kind: Any) -> type | None:
    """Return the NamedTuple class of a type of Numba's; None for anything else."""
    return kind.instance_class if isinstance(kind, types.BaseNamedTuple) else None


def in_words(kind: Any) -> str:
    """Return a text for a type of Numba's that no other type has."""
    if isinstance(kind, types.BaseTuple):
        of = class_of(kind)
        name = "" if of is None else f"{of.__module__}.{of.__qualname__}"
        return f"{name}({', '.join(map(in_words, kind.types))})"
    key = kind.key
    return f"{type(kind).__name__} {in_words(key) if isinstance(key, types.Type) else repr(key)}"


# ----------------------------------------------------------------------------- the passes


class Remembering:
    """Numba's typing context, but that it remembers what functions return for which types."""

    returned: dict[tuple[Any, tuple[Any, ...]], Any] = {}  # noqa: RUF012  one for all compilations

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a call."""
        if kws or not isinstance(func, types.Function):
            return self._context.resolve_function_type(func, args, kws)
        key = func, tuple(args)
        if key not in self.returned:
            self.returned[key] = self._context.resolve_function_type(func, args, kws)
        return self.returned[key]


@register_pass(mutates_CFG=False, analysis_only=True)
class TellParts(AnalysisPass):
    """Tells every part of a kernel that has become machine code where its environment is."""

    _name = "tell_parts"

    def __init__(self) -> None:
        """Do nothing: Numba wants every pass to have one of its own."""
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Do as Numba does when it reads from its cache what was compiled as a whole."""
        library = state.library
        for variable in library._final_module.global_variables:
            if variable.name.startswith(ENVIRONMENT):
                environment = lookup_environment(variable.name)
                if environment is not None:
                    library.codegen.set_env(variable.name, environment)
        return False


PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.RewriteSemanticConstants,
    untyped_passes.DeadBranchPrune,  # of what is None
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.NopythonRewrites,
    typed_passes.IRLegalization,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
)
"""What a kernel goes through, from Python's bytecode to LLVM."""


class WholeCompiler(CompilerBase):
    """Compiles a kernel that is called by itself, with all that is part of it."""

    after: tuple[type, ...] = (TellParts,)

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        state = self.state
        state.typingctx = Remembering(state.typingctx)
        state.targetctx = state.targetctx.subtarget(typing_context=state.typingctx)

    def define_pipelines(self) -> list[PassManager]:
        """Return the one pipeline there is."""
        manager = PassManager("kernel")
        for each in PASSES + self.after:
            manager.add_pass(each, each.__name__)
        manager.finalize()
        return [manager]


class PartCompiler(WholeCompiler):
    """Compiles a kernel that only kernels call."""

    after = ()

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.targetctx = for_parts(self.state.targetctx)


class ShaderCompiler(CompilerBase):
    """Compiles what others have written: all of Numba's passes, and what follows."""

    def define_pipelines(self) -> list[PassManager]:
        """Return Numba's pipeline with one pass more."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.add_pass_after(TellParts, typed_passes.NativeLowering)
        manager.finalize()
        return [manager]


COMPILERS = {"whole": WholeCompiler, "part": PartCompiler, "shader": ShaderCompiler}
"""By the role of a kernel."""

# ------------------------------------------------------------------- the code of a part


class PartLibrary(JITCodeLibrary):
    """The code of an inner kernel and of all it calls, before it is optimised."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return no address: there is no machine code."""
        self._ensure_finalized()
        return 0

    def serialize_using_object_code(self) -> Any:
        """Return what is kept on disk: there is no object code, either."""
        return self.serialize_using_bitcode()


def for_parts(target: Any) -> Any:
    """Return Numba's target, but that it makes no machine code."""
    return target.subtarget(_internal_codegen=_codegen_for_parts(target.codegen()))


@functools.cache
def _codegen_for_parts(codegen: Any) -> Any:
    """Return a generator of code that shares everything with another but the library's class."""

    class PartCodegen(type(codegen)):  # type: ignore[misc]
        _library_class = PartLibrary

        def set_env(self, env_name: str, env: Any) -> None:
            """Do nothing: the whole that it is part of does it."""

    made = copy.copy(codegen)
    made.__class__ = PartCodegen
    return made
