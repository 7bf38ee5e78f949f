# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Message classes with ROS defaults, and their CDR form."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
import struct
from typing import Any, cast, ClassVar, TYPE_CHECKING

from lg_husky_sim.ros.embedded.definitions import register_service, store
import numpy as np

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

#: Field defaults that are not zero (``rosidl`` reads them from the .msg files).
_DEFAULTS: dict[str, dict[str, float]] = {'geometry_msgs/msg/Quaternion': {'w': 1.0}}
_BASE, _NAME, _ARRAY = 1, 2, 3
_DTYPES = {
    'bool': np.bool_, 'byte': np.uint8, 'char': np.uint8, 'int8': np.int8, 'uint8': np.uint8,
    'int16': np.int16, 'uint16': np.uint16, 'int32': np.int32, 'uint32': np.uint32,
    'int64': np.int64, 'uint64': np.uint64, 'float32': np.float32, 'float64': np.float64}


class Message:
    """Base of every generated message class; fields are attributes, given by keyword or later."""

    __slots__ = ()
    __msgtype__: ClassVar[str] = ''
    _fields: ClassVar[tuple[str, ...]] = ()

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        """Set the given fields, and defaults for the others."""
        raise TypeError(f'{type(self).__name__} is no concrete message')

    def __eq__(self, other: object) -> bool:
        """Compare field by field."""
        if type(self) is not type(other):
            return NotImplemented
        return all(np.array_equal(getattr(self, f), getattr(other, f)) for f in self._fields)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        """Return the fields as rclpy prints them."""
        fields = ', '.join(f'{name}={getattr(self, name)!r}' for name in self._fields)
        return f'{self.__msgtype__.replace("/", ".")}({fields})'


def _array_property(slot: str, dtype: type[np.generic], length: int | None, label: str
                    ) -> property:
    def read(self: Message) -> Any:
        return getattr(self, slot)

    def write(self: Message, value: Any) -> None:
        array = np.asarray(value, dtype=dtype)
        if array.ndim != 1 or (length is not None and array.size != length):
            raise ValueError(f'{label} takes {length or "a row of"} numbers, not shape '
                             f'{array.shape}')
        setattr(self, slot, array)

    return property(read, write)


def _default(kind: int, rest: Any) -> Callable[[], Any]:
    if kind == _BASE:
        value: Any = '' if rest[0] == 'string' else False if rest[0] == 'bool' else (
            0.0 if rest[0].startswith('float') else 0)
        return lambda: value
    if kind == _NAME:
        return message_class(rest)
    (subkind, subrest), count = rest
    length = count if kind == _ARRAY else 0
    if subkind == _BASE and subrest[0] != 'string':
        dtype = _DTYPES[subrest[0]]
        return lambda: np.zeros(length, dtype=dtype)
    one = _default(subkind, subrest)
    return lambda: [one() for _ in range(length)]


@cache
def message_class(name: str) -> type[Message]:
    """
    Return the class of a message type.

    Parameters
    ----------
    name : str
        Full name, such as ``nav_msgs/msg/Odometry``.

    Raises
    ------
    KeyError
        If Jazzy's definitions do not hold the type.

    """
    types = store()
    if '/srv/' in name:
        register_service(name.rsplit('_', 1)[0])
    constants, fields = types.fielddefs[name]
    members: dict[str, Any] = {}
    slots: list[str] = []
    defaults: list[tuple[str, Callable[[], Any]]] = []
    for field, (kind, rest) in fields:
        special = _DEFAULTS.get(name, {}).get(field)
        make = _default(int(kind), rest) if special is None else partial(float, special)
        defaults.append((field, make))
        numeric = int(kind) > _NAME and rest[0][0] == _BASE and rest[0][1][0] != 'string'
        slots.append(f'_{field}' if numeric else field)
        if numeric:
            length = int(rest[1]) if int(kind) == _ARRAY else None
            members[field] = _array_property(
                f'_{field}', _DTYPES[rest[0][1][0]], length, f'{name}.{field}')
    # One argument a field, None for its default; so positional arguments work for the store's
    # deserialiser and keywords for everybody else.
    arguments = ''.join(f', {field}=None' for field, _ in defaults)
    body = [f' self.{field} = make_{field}() if {field} is None else {field}'
            for field, _ in defaults]
    scope: dict[str, Any] = {f'make_{field}': make for field, make in defaults}
    exec('\n'.join([f'def __init__(self{arguments}):', *(body or [' pass'])]),  # noqa: S102
         scope)
    members |= {
        '__init__': scope['__init__'], '__slots__': tuple(slots), '__msgtype__': name,
        '_fields': tuple(field for field, _ in defaults), '__module__': __name__,
        **{key: value for key, _, value in constants}}
    cls: type[Message] = type(name.rsplit('/', 1)[1], (Message,), members)
    types.types[name] = cls
    return cls


def serialise(message: Message) -> bytes:
    """Return a message as little-endian CDR with its encapsulation header."""
    try:
        return bytes(_store().serialize_cdr(message, message.__msgtype__, little_endian=True))
    except (AttributeError, struct.error, TypeError) as error:
        raise TypeError(f'{message.__msgtype__} holds a value of the wrong type: {error}'
                        ) from error


def deserialise(data: bytes, name: str) -> Message:
    """
    Return the message in CDR bytes.

    Parameters
    ----------
    data : bytes
        With encapsulation header; either byte order.
    name : str
        Full type name.

    Raises
    ------
    rosbags.serde.SerdeError
        If the bytes do not hold such a message.

    """
    message_class(name)
    result = _store().deserialize_cdr(data, name)
    return cast('Message', result)


_STORE: list[Typestore] = []


def _store() -> Typestore:
    if not _STORE:
        _STORE.append(store())
    return _STORE[0]
