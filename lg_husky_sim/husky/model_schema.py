# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What may stand in a model file: keys for the reader, and as JSON schema for editors."""

from __future__ import annotations

from typing import Any

from lg_husky_sim.husky.effects import (
    catalogue,
    descriptions,
    EffectKind,
    EffectParameter,
    LATER,
    OnsetKind,
)
from lg_husky_sim.husky.model import Drivetrain
from lg_husky_sim.husky.robot_size import RobotSize

SCHEMA = 'lg_husky_sim/model/1'

#: Parameters that are the packaged robot's where a file has none: its sides are alike.
IMPLIED = ('side_gain_ratio',)

#: A robot of other units: what it has in proportion has no limits that all robots share.
LARGE = RobotSize(2.0, 3.0, 5.0)

_NUMBER = {'type': 'number'}
_FLAG = {'type': 'boolean'}
# A key without a value is an empty text.
_TEXT = {'type': ['string', 'number', 'boolean', 'null']}
PARAMETER: dict[str, Any] = {
    'type': 'object', 'additionalProperties': False,
    'required': ['value'],
    'properties': {
        'value': {**_NUMBER, 'description': 'In the unit, within the bounds.'},
        'unit': {**_TEXT, 'description': "SI, that of the packaged model; '1' if none."},
        'lower': {**_NUMBER, 'description':
                  'Lower bound, in the unit; by default in proportion to the robot.'},
        'upper': {**_NUMBER, 'description':
                  'Upper bound, in the unit; by default in proportion to the robot.'},
        'tolerance': {**_NUMBER, 'minimum': 0, 'description':
                      'Relative uncertainty of a nominal value; 0 for an exact one.'},
        'free': {**_FLAG, 'description': 'Whether identify varies it unless told otherwise.'},
        'source': {**_TEXT, 'description': 'Where the value comes from.'},
        'low': {'type': ['number', 'null'], 'description': '95 % interval of an estimate.'},
        'high': {'type': ['number', 'null'], 'description': '95 % interval of an estimate.'}}}
_REF = {'$ref': '#/definitions/parameter'}
# In full, or the value alone.
_SHORT = {'if': {'type': 'object'}, 'then': _REF, 'else': _NUMBER}
EFFECT: dict[str, Any] = {
    'type': 'object', 'required': ['effect'], 'additionalProperties': False,
    'properties': {
        'effect': {'description': 'Id in the catalogue (lg_husky effects).'},
        'side': {**_TEXT, 'description': 'Where it acts; by default the first of its sides.'},
        'shape': {**_TEXT, 'description': 'Its form; by default the first of its forms.'},
        'late': {**_FLAG, 'description': 'Begins at structure.onset.'},
        'again': {**_FLAG, 'description':
                  'Takes the place of the same effect of the same side, with other numbers, from '
                  'structure.onset on.'},
        'parameters': {'type': 'object', 'description':
                       'Numbers of the effect; those left out take a typical size.'}}}
ONSET: dict[str, Any] = {
    'type': ['object', 'null'], 'additionalProperties': False, 'required': ['kind', 'value'],
    'description': 'When or where effects with late: true begin.',
    'properties': {
        'kind': {'enum': [kind.value for kind in OnsetKind]},
        'value': {**_NUMBER, 'description': 'Time in a recording [s], or x in the world [m].'},
        'recording': {**_TEXT, 'description': 'The recording it lies in; empty for each.'},
        'earlier': {'type': ['array', 'null'], 'items': {'type': 'string'},
                    'description': 'Recordings that are known to be earlier.'}}}
STRUCTURE: dict[str, Any] = {
    'type': 'object', 'additionalProperties': False,
    'properties': {'drivetrain': {'enum': [drivetrain.value for drivetrain in Drivetrain]},
                   'onset': ONSET}}
TOP: dict[str, Any] = {
    'type': 'object', 'additionalProperties': False, 'required': ['schema', 'parameters'],
    'properties': {
        'schema': {'const': SCHEMA},
        'about': {**_TEXT, 'description': 'Where the model comes from, in a line.'},
        'structure': STRUCTURE,
        'parameters': {'type': 'object', 'additionalProperties': _REF, 'description':
                       'By name, in full or as a number; what is left out is that of the '
                       'packaged model.'},
        'effects': {'type': ['array', 'null'], 'items': EFFECT}}}


def _limits(parameter: EffectParameter) -> dict[str, float]:
    # Of a large robot they are larger; what no size changes is a limit for all.
    if LARGE.factor(parameter.unit) == 1.0:
        return {'minimum': parameter.lower, 'maximum': parameter.upper}
    return {'minimum': 0.0} if parameter.lower >= 0.0 else {}


def _effect(kind: EffectKind) -> dict[str, Any]:
    """Return what an entry of this effect may hold, given that it is one."""
    own = {f'{p.name}{again}': {
        'description': f'[{p.unit}] {p.source}',
        'anyOf': [{'type': 'number', **_limits(p)}, _REF]}
        for p in kind.parameters for again in ('', LATER)}
    return {
        'if': {'properties': {'effect': {'const': kind.id}}, 'required': ['effect']},
        'then': {'properties': {
            'effect': {'description': kind.title},
            'side': {'enum': [*kind.sides, '', None]},
            'shape': {'enum': [*dict.fromkeys((*kind.shapes, '')), None]},
            'parameters': {'properties': own, 'additionalProperties': False}}}}


def json_schema(nominal: dict[str, str]) -> dict[str, Any]:
    """
    Return the JSON schema of a model file.

    Parameters
    ----------
    nominal : dict of str to str
        Name of each parameter that a model holds, and what to say of it.

    """
    kinds = {**catalogue(), **descriptions()}
    effect = {**EFFECT, 'allOf': [_effect(kind) for kind in kinds.values()], 'properties': {
        **EFFECT['properties'],
        'effect': {**EFFECT['properties']['effect'], 'enum': list(kinds)}}}
    needed = [name for name in nominal if name not in IMPLIED]
    parameters = {**TOP['properties']['parameters'], 'required': needed, 'properties': {
        name: {'description': text, 'allOf': [_SHORT]} for name, text in nominal.items()}}
    return {'title': 'Model of lg_husky', **TOP, 'definitions': {'parameter': PARAMETER},
            'properties': {**TOP['properties'], 'parameters': parameters,
                           'effects': {'type': ['array', 'null'], 'items': effect}}}
