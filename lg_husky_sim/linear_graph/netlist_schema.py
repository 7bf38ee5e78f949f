# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What may stand in a netlist: one table for the reader, and as JSON schema for editors."""

from __future__ import annotations

from collections.abc import Mapping
import keyword
from typing import Any

from lg_husky_sim.linear_graph.elements import Domain, Form, Kind, SOURCES, TWO_PORT_KINDS
from lg_husky_sim.linear_graph.expressions import CONSTANTS, FUNCTIONS
from lg_husky_sim.linear_graph.laws import LAWS

_EVERYDAY: Mapping[Domain, Mapping[str, Kind]] = {
    Domain.ELECTRICAL: {
        'voltage source': Kind.ACROSS_SOURCE, 'current source': Kind.THROUGH_SOURCE,
        'capacitor': Kind.A_TYPE, 'inductor': Kind.T_TYPE, 'resistor': Kind.D_TYPE},
    Domain.TRANSLATIONAL: {
        'velocity source': Kind.ACROSS_SOURCE, 'force source': Kind.THROUGH_SOURCE,
        'mass': Kind.A_TYPE, 'spring': Kind.T_TYPE, 'damper': Kind.D_TYPE},
    Domain.ROTATIONAL: {
        'speed source': Kind.ACROSS_SOURCE, 'torque source': Kind.THROUGH_SOURCE,
        'inertia': Kind.A_TYPE, 'torsion spring': Kind.T_TYPE, 'rotary damper': Kind.D_TYPE},
    Domain.FLUID: {
        'pressure source': Kind.ACROSS_SOURCE, 'flow source': Kind.THROUGH_SOURCE,
        'tank': Kind.A_TYPE, 'inertance': Kind.T_TYPE, 'valve': Kind.D_TYPE},
    Domain.THERMAL: {
        'temperature source': Kind.ACROSS_SOURCE, 'heat source': Kind.THROUGH_SOURCE,
        'heat capacity': Kind.A_TYPE, 'thermal resistance': Kind.D_TYPE}}
ELEMENTS: Mapping[str, tuple[Kind, Domain]] = {
    name: (kind, domain) for domain, names in _EVERYDAY.items() for name, kind in names.items()}
OTHER_WORDS: Mapping[str, str] = {
    'accumulator': 'tank', 'fluid capacitor': 'tank', 'fluid capacitance': 'tank',
    'hydraulic capacitor': 'tank', 'reservoir': 'tank', 'pipe': 'inertance, valve, or both',
    'fluid inertia': 'inertance', 'fluid inductor': 'inertance', 'fluid inertance': 'inertance',
    'orifice': 'valve', 'fluid resistor': 'valve', 'fluid resistance': 'valve',
    'pump': 'flow source, pressure source, or gyrator', 'cylinder': 'gyrator', 'ram': 'gyrator',
    'piston': 'gyrator', 'gear': 'transformer', 'gears': 'transformer', 'lever': 'transformer',
    'motor': 'transformer', 'flywheel': 'inertia', 'rotor': 'inertia',
    'rotational inertia': 'inertia', 'moment of inertia': 'inertia', 'shaft': 'torsion spring',
    'rotary spring': 'torsion spring', 'bearing': 'rotary damper', 'dashpot': 'damper',
    'friction': 'damper or rotary damper', 'battery': 'voltage source', 'conductor': 'resistor',
    'conductance': 'resistor', 'coil': 'inductor', 'resistance': 'resistor',
    'capacitance': 'capacitor', 'inductance': 'inductor', 'diode': 'resistor with a law',
    'thermal capacitance': 'heat capacity', 'thermal capacitor': 'heat capacity',
    'thermal mass': 'heat capacity', 'thermal resistor': 'thermal resistance',
    'thermal conductance': 'thermal resistance', 'heater': 'heat source'}
"""What to write for a word that is none of the elements."""
LONGEST_TEXT = 2000
#: A number with or without a unit.
QUANTITY = r'\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*'

_TEXT: dict[str, Any] = {'type': 'string', 'maxLength': LONGEST_TEXT}
_TEXTS = {'type': 'array', 'items': _TEXT}
_NODE = {'type': ['string', 'integer']}
_TAKEN = '|'.join((*keyword.kwlist, *CONSTANTS, *FUNCTIONS))
_NAMES = {'pattern': f'^(?!__)(?!({_TAKEN})$)[A-Za-z_][A-Za-z0-9_]*$'}
_LAW = {
    'law': {'anyOf': [{'enum': list(LAWS)}, _TEXT],
            'description': 'A named law, or an expression in z1, z2, ... and its parameters; in '
            'place of a value.'},
    'of': {**_TEXTS, 'description': 'Arguments of the law, such as v(M_H).'},
    'parameters': {**_TEXTS, 'description': "The law's parameters, in its order."}}
_VALUE = {'type': ['number', 'string'], 'maxLength': LONGEST_TEXT, 'description':
          'A number with a unit (0.5 ohm), or an expression in the parameters; for a source the '
          "name of its input. Default: a parameter of the element's name."}
PORT: dict[str, Any] = {
    'type': 'object', 'additionalProperties': False, 'required': ['domain', 'from'],
    'properties': {
        'domain': {'enum': [domain.value for domain in Domain]},
        'from': {**_NODE, 'description': 'Tail: the node that the port leaves.'},
        'to': {**_NODE, 'description': 'Head; by default the ground of the domain.'}}}
TWO_PORT: dict[str, Any] = {
    'type': 'object', 'additionalProperties': False, 'required': ['is', 'port 1', 'port 2'],
    'properties': {'is': {'enum': [kind.value for kind in TWO_PORT_KINDS]},
                   'port 1': PORT, 'port 2': PORT, 'value': _VALUE, **_LAW}}
ONE_PORT: dict[str, Any] = {
    'type': 'object', 'additionalProperties': False, 'required': ['is', 'from'],
    'properties': {
        'is': {'enum': list(ELEMENTS)},
        'from': {**_NODE, 'description': 'Tail: the node that the branch leaves.'},
        'to': {**_NODE, 'description': 'Head; by default the ground of the domain.'},
        'value': _VALUE,
        'form': {'enum': [form.value for form in Form],
                 'description': 'Which way the value of a dissipator, spring, inductor or '
                 'inertance is meant.'},
        **_LAW},
    # The input of a source is a name.
    'if': {'properties': {'is': {'enum': [
        name for name, (kind, _) in ELEMENTS.items() if kind in SOURCES]}}, 'required': ['is']},
    'then': {'properties': {'value': {'type': 'string'}}}}
TOP: dict[str, Any] = {
    'type': 'object', 'additionalProperties': False, 'required': ['elements'],
    'properties': {
        'name': {**_TEXT, 'description': 'Title.'},
        'about': {**_TEXT, 'description': 'Free text, such as the source of the system.'},
        'ground': {'description': 'Name of the ground node, or one for each domain.', 'anyOf': [
            _NODE, {'type': 'object', 'additionalProperties': False,
                    'properties': {domain.value: _NODE for domain in Domain}}]},
        'parameters': {
            'type': ['object', 'null'], 'propertyNames': _NAMES,
            'description': 'Numbers that expressions use, each with its unit.',
            'additionalProperties': {'anyOf': [
                {'type': ['number', 'null']}, {'type': 'string', 'pattern': f'^{QUANTITY}$'}]}},
        'elements': {
            'type': 'object', 'minProperties': 1, 'propertyNames': _NAMES,
            'description': 'Sources, storages, dissipators, transformers and gyrators by name.',
            'additionalProperties': {
                'allOf': [{'if': {'properties': {'is': TWO_PORT['properties']['is']},
                                  'required': ['is']},
                           'then': TWO_PORT, 'else': ONE_PORT},
                          {'dependencies': {'of': ['law'], 'parameters': ['law'],
                                            'law': {'not': {'required': ['value']}}}}]}},
        'outputs': {'type': ['array', 'null'], 'items': _TEXT, 'description':
                    'Variables to put out, such as omega(J) or i(L).'}}}


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of a netlist file."""
    return {'title': 'Linear graph of lg_husky', **TOP}
