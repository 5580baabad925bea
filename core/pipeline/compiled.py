"""What Numba is told of records, addresses and calls: the compiled side of :mod:`.records`.

Imported when shaders are compiled, and by nobody before. A record is an address, a field is a load
or a store there, a vector is a tuple in registers. A shader is called by its address, by Numba's
own convention, so that an exception comes through all callers.
"""

from __future__ import annotations

import zlib
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils, errors
from numba.core.imputils import lower_builtin, lower_getattr_generic, lower_setattr_generic
from numba.core.registry import cpu_target
from numba.core.typing.templates import AttributeTemplate, infer_getattr, signature
from numba.extending import intrinsic, models, overload, register_model, typeof_impl

from ..kernels import INLINED, call, kernel
from . import records, stage
from .records import WORD, Field, Struct

ADDRESS = ir.IntType(64)
BYTES = ir.IntType(8).as_pointer()


def short(kind: str, name: str, *told: Any) -> str:
    """Return a name of a type: of long ones Numba makes names of functions, which takes seconds."""
    return f"{kind}_{name}_{zlib.crc32(repr(told).encode()):x}"


class StructType(types.Type):
    """A record: the address of its words."""

    def __init__(self, key: tuple[Any, ...]) -> None:
        """Take the key of its declaration."""
        name, fields, self.is_constant = key
        self.struct_key = key
        self.fields = {field: Field(*place) for field, *place in fields}
        self.size = sum(field.n_words for field in self.fields.values())
        super().__init__(name=short("const_struct" if self.is_constant else "struct", name, fields))

    @property
    def key(self) -> Any:
        """What is equal for equal types."""
        return self.struct_key


class StructClass(types.Callable, types.Opaque):
    """The declaration of a record: what is called to make one."""

    def __init__(self, key: tuple[Any, ...]) -> None:
        """Take the key of the declaration."""
        self.struct_key = key
        super().__init__(name=short("class", *key))

    @property
    def key(self) -> Any:
        """What is equal for equal types."""
        return self.struct_key

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """Take no arguments."""
        return None if args or kws else signature(StructType(self.struct_key))

    def get_call_signatures(self) -> Any:
        """Name what it may be called with."""
        return [signature(StructType(self.struct_key))], False

    def get_impl_key(self, sig: Any) -> Any:
        """Find the one implementation below."""
        return type(self)


@typeof_impl.register(Struct)
def _declaration(declared: Struct, context: Any) -> StructClass:
    return StructClass(declared.key)


class PointerType(types.Type):
    """The address of a value of any type of Numba's, such as a NamedTuple of arrays."""

    def __init__(self, pointee: Any) -> None:
        """Point to a type."""
        self.pointee = pointee
        super().__init__(name=short("pointer", "to", pointee.name))

    @property
    def key(self) -> Any:
        """What is equal for equal types."""
        return self.pointee


@register_model(StructType)
@register_model(PointerType)
class AddressModel(models.PrimitiveModel):
    """Both are addresses."""

    def __init__(self, manager: Any, kind: Any) -> None:
        """Say so."""
        super().__init__(manager, kind, BYTES)


register_model(StructClass)(models.OpaqueModel)

# ----------------------------------------------------------------------------------- fields


@infer_getattr
class PointerAttribute(AttributeTemplate):
    """The fields of a NamedTuple that is pointed to: only what is asked for is loaded."""

    key = PointerType

    def generic_resolve(self, pointer: PointerType, name: str) -> Any:
        """Return the type of a field; None if there is none."""
        kind = pointer.pointee
        return kind[kind.fields.index(name)] if name in kind.fields else None


@lower_getattr_generic(PointerType)
def load_pointed(context: Any, builder: Any, kind: PointerType, pointer: Any, name: str) -> Any:
    """Load a field."""
    place = builder.bitcast(pointer, context.get_value_type(kind.pointee).as_pointer())
    index = kind.pointee.fields.index(name)
    return builder.load(cgutils.gep_inbounds(builder, place, 0, index))


def type_of(field: Field) -> Any:
    """Return the type of a field."""
    scalar = types.int64 if field.is_whole else types.float64
    return scalar if field.n_words == 1 else types.UniTuple(scalar, field.n_words)


@infer_getattr
class StructAttribute(AttributeTemplate):
    """The fields of a record."""

    key = StructType

    def generic_resolve(self, struct: StructType, name: str) -> Any:
        """Return the type of a field; None if there is none."""
        return type_of(struct.fields[name]) if name in struct.fields else None


def places(context: Any, builder: Any, struct: StructType, record: Any, name: str) -> list[Any]:
    """Return where the words of a field lie."""
    field = struct.fields[name]
    scalar = ir.IntType(64) if field.is_whole else ir.DoubleType()
    words = builder.bitcast(record, scalar.as_pointer())
    return [
        builder.gep(words, [ir.Constant(ADDRESS, field.first + k)]) for k in range(field.n_words)
    ]


@lower_getattr_generic(StructType)
def load_field(context: Any, builder: Any, struct: StructType, record: Any, name: str) -> Any:
    """Load the words of a field."""
    values = [builder.load(each) for each in places(context, builder, struct, record, name)]
    if len(values) == 1:
        return values[0]
    return context.make_tuple(builder, type_of(struct.fields[name]), values)


@lower_setattr_generic(StructType)
def store_field(context: Any, builder: Any, sig: Any, args: Any, name: str) -> None:
    """Store the words of a field."""
    struct, _ = sig.args
    if struct.is_constant:
        raise errors.TypingError(f"{struct.struct_key[0]}.{name} can only be read")
    record, value = args
    where = places(context, builder, struct, record, name)
    if len(where) == 1:
        builder.store(value, where[0])
        return
    for k, place in enumerate(where):
        builder.store(builder.extract_value(value, k), place)


@lower_builtin(StructClass, types.VarArg(types.Any))
def make_record(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Make a record of zeros on the stack of the function."""
    words = ir.ArrayType(ir.IntType(64), sig.return_type.size)
    place = cgutils.alloca_once(builder, words)
    builder.store(ir.Constant(words, None), place)
    return builder.bitcast(place, BYTES)


# -------------------------------------------------------------------------------- addresses


@intrinsic
def record_from(typingctx: Any, declared: Any, address: Any) -> Any:
    """Take an address for that of a record."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.inttoptr(args[1], BYTES)

    return StructType(declared.struct_key)(declared, types.int64), codegen


@intrinsic
def copy_to(typingctx: Any, record: Any, address: Any) -> Any:
    """Copy the words of a record to an address."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        words = ir.IntType(64).as_pointer()
        source, target = builder.bitcast(args[0], words), builder.inttoptr(args[1], words)
        for k in range(sig.args[0].size):
            place = [ir.Constant(ADDRESS, k)]
            builder.store(builder.load(builder.gep(source, place)), builder.gep(target, place))
        return context.get_dummy_value()

    return types.none(record, types.int64), codegen


@intrinsic
def address_from(typingctx: Any, record: Any) -> Any:
    """Take a record for its address."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.ptrtoint(args[0], ADDRESS)

    return types.int64(record), codegen


@intrinsic
def data_of(typingctx: Any, array: Any) -> Any:
    """Return the address of the first element of an array."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        data = context.make_array(sig.args[0])(context, builder, args[0]).data
        return builder.ptrtoint(data, ADDRESS)

    return types.int64(array), codegen


def stage_type() -> Any:
    """Return the type of a stage, which is always the same."""
    tables = {
        name: np.zeros((1, 1), np.int64)
        for name in ("triangles", "procedurals", "misses", "payloads", "instances")
    }
    rows = {name: np.zeros((1, 12)) for name in ("to_world", "to_object", "materials")}
    numbers = {
        name: np.zeros(1, np.int32) for name in ("geometry_of", "index_of", "material_of", "places")
    }
    firsts = {
        name: np.zeros(1, np.int64)
        for name in ("geometry_first", "geometry_flags", "material_first", "states")
    }
    made = stage.Stage(
        **tables, **rows, **numbers, **firsts, **stage.make_frames(), scene=1,
        turned=np.zeros(1, np.uint8),
    )  # fmt: skip
    return numba.typeof(made)


STAGE = PointerType(stage_type())


@intrinsic
def stage_from(typingctx: Any, address: Any) -> Any:
    """Take an address for that of a stage."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], BYTES)

    return STAGE(types.int64), codegen


@intrinsic
def keep_in(typingctx: Any, value: Any, address: Any) -> Any:
    """Store a value at an address, and return its size."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = context.get_value_type(sig.args[0])
        if context.get_abi_sizeof(kind) == 0:
            return ir.Constant(ADDRESS, 0)
        builder.store(args[0], builder.inttoptr(args[1], kind.as_pointer()))
        return ir.Constant(ADDRESS, context.get_abi_sizeof(kind))

    return types.int64(value, types.int64), codegen


def caller(result: Any) -> Any:
    """Return what calls an address with a tuple of arguments, and what is called returns."""

    @intrinsic
    def call(typingctx: Any, address: Any, arguments: Any) -> Any:
        kinds = tuple(types.unliteral(kind) for kind in arguments.types)

        def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            values = [
                context.cast(builder, builder.extract_value(args[1], k), given, kind)
                for k, (given, kind) in enumerate(zip(sig.args[1].types, kinds, strict=True))
            ]
            convention = context.call_conv
            function = convention.get_function_type(result, kinds).as_pointer()
            status, value = convention.call_function(
                builder, builder.inttoptr(args[0], function), result, kinds, values
            )
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return value

        return result(types.int64, arguments), codegen

    return call


call_whole = caller(types.int64)
"""All that is called by address returns a whole number."""


@kernel
def keep(value, address):
    """Store a value at an address."""
    return keep_in(value, address)


def kept(value: Any) -> np.ndarray:
    """Return the bytes of a value as kernels have it; its arrays must be kept by others."""
    context = cpu_target.target_context
    size = context.get_abi_sizeof(context.get_value_type(numba.typeof(value)))
    memory = np.zeros(size // WORD + 2)
    call(keep, value, int(memory.ctypes.data))
    return memory


# ------------------------------------------------------- what stands for plain Python's functions


def stands_for(plain: Any) -> Any:
    """Declare what is compiled in the place of a function, as :func:`..kernels.inlined` is."""
    return overload(plain, strict=False, jit_options=INLINED)


@stands_for(records.record_at)
def _record_at(struct, words):
    return lambda struct, words: record_from(struct, words)


@stands_for(records.words_of)
def _words_of(record):
    return lambda record: address_from(record)


@stands_for(records.words_at)
def _words_at(rows, index):
    return lambda rows, index: data_of(rows) + index * (rows.shape[1] * WORD)


@stands_for(records.words_from)
def _words_from(address, index, size):
    return lambda address, index, size: address + index * (size * WORD)


@stands_for(records.copy_record)
def _copy_record(record, words):
    return lambda record, words: copy_to(record, words)


@stands_for(records.number_of)
def _number_of(record):
    name, fields, _ = record.struct_key
    number = Struct(name, {each: Field(*place) for each, *place in fields}).number
    return lambda record: number


@stands_for(records.call_at)
def _call_at(address, arguments):
    return lambda address, arguments: call_whole(address, arguments)


@stands_for(stage.stage_at)
def _stage_at(address):
    return lambda address: stage_from(address)


@stands_for(stage.tell)
def _tell(stage, state, depth, ray_type, instance, primitive, t):
    return lambda stage, state, depth, ray_type, instance, primitive, t: None
