# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
ROS message types as the IDL types that the DDS library wants to know.

The library checks every sample against a true IDL type, yet the bytes are made and read by
:mod:`lg_husky_sim.ros.embedded.messages`: a :class:`RawSample` hands CDR through unchanged.
"""

from __future__ import annotations

from functools import cache
from typing import Any, cast, Protocol

from cyclonedds.idl import IdlStruct, make_idl_struct, types
from lg_husky_sim.ros.embedded.definitions import register_service, store

_SCALARS: dict[str, Any] = {
    'bool': bool, 'byte': types.uint8, 'char': types.uint8, 'int8': types.int8,
    'uint8': types.uint8, 'int16': types.int16, 'uint16': types.uint16, 'int32': types.int32,
    'uint32': types.uint32, 'int64': types.int64, 'uint64': types.uint64,
    'float32': types.float32, 'float64': types.float64, 'string': str}
_NAME, _ARRAY = 2, 3


class RawSample(Protocol):
    """A sample that carries its CDR bytes, header included, and is never taken apart by DDS."""

    raw: bytes
    sample_info: Any

    def __init__(self, raw: bytes = b'') -> None:
        """Keep the bytes."""


def _keep(self: RawSample, raw: bytes = b'') -> None:
    self.raw = raw


def _give(self: RawSample, buffer: object = None, endianness: object = None,
          use_version_2: object = None) -> bytes:
    return self.raw


def _take(cls: type[RawSample], data: bytes, has_header: bool = True,
          use_version_2: object = None) -> RawSample:
    return cls(data)


def dds_type_name(name: str) -> str:
    """Return a ROS type's name in DDS: ``pkg/msg/T`` becomes ``pkg::msg::dds_::T_``."""
    package, middle, kind = name.split('/')
    return f'{package}::{middle}::dds_::{kind}_'


def _field_type(kind: int, rest: Any) -> Any:
    if kind == 1:
        bounded: Any = types.bounded_str
        return bounded[rest[1]] if rest[0] == 'string' and rest[1] else _SCALARS[rest[0]]
    if kind == _NAME:
        return struct_type(rest)
    (subkind, subrest), count = rest
    one = _field_type(int(subkind), subrest)
    generic: Any = types
    if kind == _ARRAY:
        return generic.array[one, count]
    return generic.sequence[one, count] if count else generic.sequence[one]


def _fields(name: str) -> dict[str, Any]:
    if '/srv/' in name:
        register_service(name.rsplit('_', 1)[0])
    return {field: _field_type(int(kind), rest)
            for field, (kind, rest) in store().fielddefs[name][1]}


@cache
def struct_type(name: str) -> type[IdlStruct]:
    """Return the plain IDL type of a message, which serialises by itself."""
    return make_idl_struct(f'{name.replace("/", "_")}_', dds_type_name(name), _fields(name))


@cache
def sample_type(name: str, *, header: bool = False) -> type[RawSample]:
    """
    Return the IDL type of a message whose samples are :class:`RawSample`.

    Parameters
    ----------
    name : str
        Full name of a message, or of a service's request or response.
    header : bool
        Whether the 16 bytes of rmw_cyclonedds' request identity precede the fields.

    """
    fields = _fields(name)
    if header:
        fields = {'guid': types.uint64, 'seq': types.int64} | fields
    made: Any = make_idl_struct(f'{name.replace("/", "_")}_raw_', dds_type_name(name), fields,
                                dataclassify=False)
    made.__init__, made.serialize, made.deserialize = _keep, _give, classmethod(_take)
    # What comes of a writer that has gone: no fields, and no key in ROS types.
    made.deserialize_key = classmethod(_take)
    return cast('type[RawSample]', made)
