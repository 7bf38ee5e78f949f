# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of settings as ROS parameters: declared, checked before a change, applied after."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.ros.api import (
    message_type,
    Node,
    Parameter,
    parameter,
    parameter_overrides,
)
from lg_husky_sim.ros.settings import (
    BY_NAME,
    make_settings,
    Setting,
    Settings,
    TABLE,
    unknown,
)

#: Parameters that ROS itself gives to every node.
_OF_ROS = ('use_sim_time', 'start_type_description_service')


def _descriptor(setting: Setting) -> Any:
    text = setting.text + (f' [{setting.unit}]' if setting.unit else '')
    descriptor = message_type('rcl_interfaces/msg/ParameterDescriptor')(
        description=text, additional_constraints=setting.allowed(),
        read_only=not setting.live)
    if setting.kind is float:
        limits = message_type('rcl_interfaces/msg/FloatingPointRange')
        descriptor.floating_point_range = [
            limits(from_value=setting.low, to_value=setting.high)]
    elif setting.kind is int:
        limits = message_type('rcl_interfaces/msg/IntegerRange')
        descriptor.integer_range = [
            limits(from_value=int(setting.low), to_value=int(setting.high))]
    return descriptor


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value


def given_settings(node: Node) -> dict[str, object]:
    """Return what command line and files give of the settings; warn of what is none."""
    given = {name: override.value for name, override in parameter_overrides(node).items()
             if name not in _OF_ROS}
    for name in sorted(set(given) - set(BY_NAME)):
        node.get_logger().warning(
            'qos_overrides have no effect: the quality of service is fixed (docs/ros.md)'
            if name.startswith('qos_overrides.') else f'{unknown(name)}; it is ignored')
    return {name: value for name, value in given.items() if name in BY_NAME}


def declare_settings(node: Node) -> Settings:
    """
    Declare every setting on a node and return their values.

    Whole numbers are taken where decimals are meant (``-p rate:=50``). What is given and is no
    setting (parameters of a whole launch, or of another node of the process) is left alone, as
    every node does, with a warning.

    Parameters
    ----------
    node : Node
        Gets the parameters.

    Returns
    -------
    Settings

    Raises
    ------
    SettingsError
        If a value is not allowed.

    """
    settings = make_settings(given_settings(node))
    for setting in TABLE:
        value = _plain(getattr(settings, setting.name))
        node.declare_parameter(setting.name, value, _descriptor(setting), ignore_override=True)
    return settings


class LiveSettings:
    """
    Keeps settings and parameters in step while the node runs.

    Parameters
    ----------
    node : Node
    settings : Settings
    apply : callable
        Receives new settings; may refuse them with a SettingsError.

    """

    def __init__(self, node: Node, settings: Settings, apply: Callable[[Settings], None]) -> None:
        """Watch the node's parameters."""
        self._node = node
        self._settings = settings
        self._apply = apply
        self._result = message_type('rcl_interfaces/msg/SetParametersResult')
        node.add_on_set_parameters_callback(self._check)

    def _check(self, parameters: Sequence[Parameter]) -> Any:
        changes = {p.name: p.value for p in parameters if p.name in BY_NAME}
        if not changes:
            return self._result(successful=True)
        try:
            for name in changes:
                if not BY_NAME[name].live:
                    raise SettingsError(f'{name} cannot change while the node runs')
            settings = replace(self._settings, **changes)
            # Applied here and not after: a model file that cannot be loaded must be refused.
            self._apply(settings)
        except SettingsError as error:
            return self._result(successful=False, reason=str(error))
        self._settings = settings
        return self._result(successful=True)

    def changed(self, **values: object) -> Settings:
        """
        Change settings from inside, by a topic, and the parameters of the same names.

        Raises
        ------
        SettingsError
            If a value is not allowed.

        """
        # What is not allowed is said in our own words, not in those of the middleware.
        replace(self._settings, **values)  # type: ignore[arg-type]
        for result in self._node.set_parameters(
                [parameter(name, value) for name, value in values.items()]):
            if not result.successful:
                raise SettingsError(result.reason)
        return self._settings
