# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters with rclpy's names: typed, ranged, described, watched by callbacks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import enum
from typing import Any

from lg_husky_sim.ros.embedded.messages import message_class


class ParameterException(Exception):
    """A parameter that cannot be declared or read."""


class ParameterType(enum.IntEnum):
    """Types of rcl_interfaces/msg/ParameterType."""

    NOT_SET = 0
    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    BYTE_ARRAY = 5
    BOOL_ARRAY = 6
    INTEGER_ARRAY = 7
    DOUBLE_ARRAY = 8
    STRING_ARRAY = 9


_SCALARS: tuple[tuple[type, ParameterType], ...] = (
    (bool, ParameterType.BOOL), (int, ParameterType.INTEGER), (float, ParameterType.DOUBLE),
    (str, ParameterType.STRING))
_FIELDS = ('', 'bool_value', 'integer_value', 'double_value', 'string_value', 'byte_array_value',
           'bool_array_value', 'integer_array_value', 'double_array_value', 'string_array_value')


def parameter_type(value: object) -> ParameterType:
    """
    Return the type that a value has as a parameter.

    Raises
    ------
    TypeError
        If no parameter can hold it.

    """
    if value is None:
        return ParameterType.NOT_SET
    for kind, name in _SCALARS:
        if type(value) is kind:
            return name
    if isinstance(value, bytes):
        return ParameterType.BYTE_ARRAY
    if isinstance(value, (list, tuple)):
        kinds = {type(item) for item in value}
        if not kinds:
            return ParameterType.STRING_ARRAY
        for kind, name in _SCALARS:
            if kinds == {kind}:
                return ParameterType(name + 5)
    raise TypeError(f'{value!r} is no parameter value: bool, int, float, str or a list of one '
                    'of these')


def _agree(type_: ParameterType, value: object) -> bool:
    # Of an empty list nothing tells of what it could be one.
    if isinstance(value, (list, tuple, bytes)) and not value:
        return type_ >= ParameterType.BYTE_ARRAY
    return parameter_type(value) == type_


@dataclass(frozen=True, init=False)
class Parameter:
    """
    A name with a value.

    Parameters
    ----------
    name : str
    type_ : ParameterType, optional
        That of the value if not given.
    value : object, optional
        None: not set.

    Raises
    ------
    TypeError
        If no parameter can hold the value, or the type is none.
    ValueError
        If the value is of another type.

    """

    name: str
    type_: ParameterType
    value: Any

    Type = ParameterType

    def __init__(self, name: str, type_: ParameterType | None = None, value: Any = None) -> None:
        """Check the value."""
        kind = parameter_type(value) if type_ is None else type_
        if not isinstance(kind, ParameterType):
            raise TypeError(f'type {kind!r} of parameter {name!r} is no ParameterType')
        if not _agree(kind, value):
            raise ValueError(f'parameter {name!r} = {value!r} is not {kind.name}')
        for field, content in (('name', name), ('type_', kind), ('value', value)):
            object.__setattr__(self, field, content)

    @classmethod
    def of(cls, name: str, value: object) -> Parameter:
        """Return a parameter of the type that the value has."""
        return cls(name, parameter_type(value), value)

    @classmethod
    def from_parameter_msg(cls, msg: Any) -> Parameter:
        """
        Read a rcl_interfaces/msg/Parameter.

        Raises
        ------
        ParameterException
            If its type is none that there is.

        """
        if msg.value.type not in list(ParameterType):
            raise ParameterException(f'parameter {msg.name!r} has a type {msg.value.type} that '
                                     'is unknown')
        kind = ParameterType(msg.value.type)
        value: Any = getattr(msg.value, _FIELDS[kind]) if kind else None
        if kind in (ParameterType.BOOL_ARRAY, ParameterType.INTEGER_ARRAY,
                    ParameterType.DOUBLE_ARRAY):
            value = value.tolist()
        elif kind == ParameterType.BYTE_ARRAY:
            value = bytes(value)
        return cls(msg.name, kind, value)

    def get_parameter_value(self) -> Any:
        """Return a rcl_interfaces/msg/ParameterValue."""
        message = message_class('rcl_interfaces/msg/ParameterValue')(type=int(self.type_))
        if self.type_ == ParameterType.BYTE_ARRAY:
            setattr(message, _FIELDS[self.type_], list(self.value))
        elif self.type_:
            setattr(message, _FIELDS[self.type_], self.value)
        return message

    def to_parameter_msg(self) -> Any:
        """Return a rcl_interfaces/msg/Parameter."""
        return message_class('rcl_interfaces/msg/Parameter')(
            name=self.name, value=self.get_parameter_value())


def _range_error(name: str, value: object, descriptor: Any) -> str:
    limits = [*descriptor.floating_point_range, *descriptor.integer_range]
    if not limits or not isinstance(value, (int, float)):
        return ''
    low, high = limits[0].from_value, limits[0].to_value
    if low <= value <= high:
        return ''
    return f'Parameter {name} = {value} is out of its range [{low}, {high}]'


class ParameterStore:
    """The declared parameters of a node and the rules under which they change."""

    def __init__(self, overrides: Mapping[str, Any]) -> None:
        """Keep what the command line gives."""
        self.overrides = {name: Parameter.of(name, value) for name, value in overrides.items()}
        self.values: dict[str, Parameter] = {}
        self.descriptors: dict[str, Any] = {}
        self.on_set: list[Callable[[list[Parameter]], Any]] = []
        self.post_set: list[Callable[[list[Parameter]], None]] = []
        self.publish: Callable[[Sequence[Parameter], Sequence[Parameter]], None] | None = None

    def declare(self, name: str, value: object, descriptor: Any, ignore_override: bool
                ) -> Parameter:
        """
        Add a parameter.

        Raises
        ------
        ParameterException
            If it is declared already, or its value has the wrong type or is out of range.

        """
        if name in self.values:
            raise ParameterException(f'parameter {name!r} is declared already')
        if descriptor is None:
            descriptor = message_class('rcl_interfaces/msg/ParameterDescriptor')()
        parameter = Parameter.of(name, value)
        override = None if ignore_override else self.overrides.get(name)
        if override is not None:
            if parameter.type_ not in (ParameterType.NOT_SET, override.type_) and not (
                    descriptor.dynamic_typing):
                raise ParameterException(
                    f'parameter {name!r} = {override.value!r} is {override.type_.name}, not '
                    f'{parameter.type_.name}')
            parameter = override
        descriptor.name, descriptor.type = name, int(parameter.type_)
        message = _range_error(name, parameter.value, descriptor) or self._ask([parameter])
        if message:
            raise ParameterException(message)
        self.values[name], self.descriptors[name] = parameter, descriptor
        if self.publish:
            self.publish([parameter], [])
        return parameter

    def get(self, name: str) -> Parameter:
        """
        Return a parameter.

        Raises
        ------
        ParameterException
            If it is not declared.

        """
        if name not in self.values:
            raise ParameterException(f'parameter {name!r} is not declared')
        return self.values[name]

    def _ask(self, parameters: list[Parameter]) -> str:
        for callback in self.on_set:
            result = callback(parameters)
            if not result.successful:
                return str(result.reason) or 'refused by a callback'
        return ''

    def _refusal(self, parameter: Parameter) -> str:
        if parameter.name not in self.values:
            return f'Parameter {parameter.name} is not declared'
        descriptor = self.descriptors[parameter.name]
        if descriptor.read_only:
            return f'Parameter {parameter.name} is read-only'
        if parameter.type_ != descriptor.type and not descriptor.dynamic_typing:
            return (f'Parameter {parameter.name} = {parameter.value!r} is '
                    f'{parameter.type_.name}, not {ParameterType(descriptor.type).name}')
        return _range_error(parameter.name, parameter.value, descriptor)

    def set_messages(self, messages: Sequence[Any]) -> Any:
        """Set all or none of some rcl_interfaces/msg/Parameter, as :meth:`set_atomically`."""
        try:
            return self.set_atomically([Parameter.from_parameter_msg(one) for one in messages])
        except ParameterException as error:
            result = message_class('rcl_interfaces/msg/SetParametersResult')
            return result(successful=False, reason=str(error))

    def set_atomically(self, parameters: list[Parameter]) -> Any:
        """Set all or none; return a rcl_interfaces/msg/SetParametersResult."""
        result = message_class('rcl_interfaces/msg/SetParametersResult')
        for parameter in parameters:
            if reason := self._refusal(parameter):
                return result(successful=False, reason=reason)
        if reason := self._ask(parameters):
            return result(successful=False, reason=reason)
        self.values |= {parameter.name: parameter for parameter in parameters}
        for callback in self.post_set:
            callback(parameters)
        if self.publish:
            self.publish([], parameters)
        return result(successful=True)
