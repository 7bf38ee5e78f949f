# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameter files of the node as JSON schema for editors, from the table of settings."""

from __future__ import annotations

from typing import Any

from lg_husky_sim.ros.settings import DEFAULT_PRESET, preset_values, Setting, TABLE

_TYPES = {bool: 'boolean', int: 'integer', float: 'number', str: 'string'}
_LISTS: dict[str, dict[str, Any]] = {
    'joint_names': {'items': {'type': 'string', 'minLength': 1}, 'uniqueItems': True,
                    'minItems': 4, 'maxItems': 4},
    'odometry_covariance': {'items': {'type': 'number', 'exclusiveMinimum': 0.0},
                            'minItems': 6, 'maxItems': 6}}


def _setting(setting: Setting, default: object) -> dict[str, Any]:
    unit = f' [{setting.unit}]' if setting.unit else ''
    schema: dict[str, Any] = {
        'description': f'{setting.text}{unit}',
        'default': list(default) if isinstance(default, tuple) else default}
    if setting.choices:
        return {**schema, 'enum': list(setting.choices)}
    if setting.kind is tuple:
        return {**schema, 'type': 'array', **_LISTS[setting.name]}
    schema['type'] = _TYPES[setting.kind]
    if setting.kind in (int, float):
        schema |= {'minimum': setting.low, 'maximum': setting.high}
    return schema


def json_schema() -> dict[str, Any]:
    """
    Return the JSON schema of a parameter file with a section for the node.

    Sections of other nodes may hold anything. In the node's own, and in those for all nodes, a
    name that the node does not know is marked; the node itself warns of it.
    """
    defaults = preset_values(DEFAULT_PRESET)
    own = {setting.name: _setting(setting, defaults[setting.name]) for setting in TABLE}
    own['use_sim_time'] = {'type': 'boolean', 'description': 'Take the time from /clock.'}
    own['start_type_description_service'] = {'type': 'boolean'}
    below = {'patternProperties': {r'(^|/)(sim_node|\*+)$': {'$ref': '#/definitions/own'}},
             'additionalProperties': {'$ref': '#/definitions/other'}}
    section = {'type': 'object', 'additionalProperties': False, 'properties': own}
    return {
        'title': 'Parameters of sim_node', 'type': 'object', **below,
        'definitions': {
            'own': {'type': 'object', 'properties': {'ros__parameters': section}, **below},
            'other': {'type': 'object', 'properties': {'ros__parameters': {'type': 'object'}},
                      **below}}}
