# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Linear graphs as YAML files that a student can write.

One entry an element, by its everyday name::

    name: DC motor
    parameters:
      k_t: 0.05 N·m/A
    elements:
      V_s:   {is: voltage source, from: supply}
      R:     {is: resistor, from: supply, to: winding, value: 0.5 ohm}
      L:     {is: inductor, from: winding, to: motor, value: 2 mH}
      motor: {is: transformer, port 1: {domain: electrical, from: motor},
              port 2: {domain: rotational, from: shaft}, value: k_t}
      J:     {is: inertia, from: shaft, value: 1e-3 kg·m²}
    outputs: [omega(J), i(L)]

``to`` is the ground of its domain (``ground:``, or a node called ground) where it is left out.
A value is an expression in the parameters, or a number
with a unit, which then is a parameter of the element's name.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
import math
from pathlib import Path
import re
from typing import Any

from lg_husky_sim.errors import GraphError, ModelFileError
from lg_husky_sim.linear_graph.checks import check_complete, check_number, check_symbols
from lg_husky_sim.linear_graph.elements import (
    Branch,
    Characteristic,
    Domain,
    Form,
    Port,
    SOURCES,
    TWO_PORT_KINDS,
    TwoPort,
)
from lg_husky_sim.linear_graph.expressions import names_in, why_no_name
from lg_husky_sim.linear_graph.graph import close_name, GROUND, LinearGraph, suggestion
from lg_husky_sim.linear_graph.netlist_schema import (
    ELEMENTS,
    LONGEST_TEXT,
    ONE_PORT,
    OTHER_WORDS,
    PORT,
    QUANTITY,
    TOP,
    TWO_PORT,
)
from lg_husky_sim.linear_graph.units import check_units, parse_unit, unit_needed

Ground = str | dict[Domain, str]
_QUANTITY = re.compile(QUANTITY, re.ASCII)
CLOSE = 0.8
"""Likeness from which on an unknown element is taken for a slip of the pen."""


@dataclass(frozen=True)
class Netlist:
    """
    A graph with the numbers and outputs of its file.

    Parameters
    ----------
    name : str
        Title.
    graph : LinearGraph
        The graph.
    values : mapping of str to float
        Parameters that the file gives numbers for, SI.
    outputs : tuple of str
        Variables to put out.
    units : mapping of str to str
        Units of the parameters, as written.
    about : str
        Free text.

    """

    name: str
    graph: LinearGraph
    values: Mapping[str, float]
    outputs: tuple[str, ...]
    units: Mapping[str, str] = field(default_factory=dict)
    about: str = ''


def read_netlist(path: str | Path) -> Netlist:
    """
    Read a netlist file.

    Parameters
    ----------
    path : path-like
        YAML file.

    Returns
    -------
    Netlist

    Raises
    ------
    ModelFileError
        If the file is no netlist; the message says which file, which element and what is wrong.

    """
    from lg_husky_sim.yaml_files import brief, read_yaml

    try:
        data = read_yaml(path, ModelFileError)
    except ModelFileError as error:
        raise ModelFileError(f'{path}: {brief(error)}') from error
    return netlist_of(data, str(path))


def parse_netlist(text: str, source: str = 'netlist') -> Netlist:
    """
    Read a netlist from a text; see :func:`read_netlist`.

    Parameters
    ----------
    text : str
        YAML.
    source : str
        What to call it in messages.

    """
    from lg_husky_sim.yaml_files import brief, parse_yaml

    try:
        data = parse_yaml(text)
    except ValueError as error:
        raise ModelFileError(f'{source}: {brief(error)}') from error
    return netlist_of(data, source)


def netlist_of(data: Any, source: str = 'netlist') -> Netlist:
    """
    Read a netlist from what a file would hold; see :func:`read_netlist`.

    Parameters
    ----------
    data : dict
        As YAML gives it.
    source : str
        What to call it in messages.

    """
    from lg_husky_sim.yaml_files import brief

    try:
        return _netlist(data)
    except (GraphError, ModelFileError) as error:
        raise ModelFileError(f'{source}: {brief(error)}') from error


def _netlist(data: Any) -> Netlist:
    top = _mapping(data, 'the file', TOP['properties'])
    parameters = _mapping({} if top.get('parameters') is None else top['parameters'],
                          'parameters', None)
    values: dict[str, float] = {}
    units: dict[str, str] = {}
    for name, given in parameters.items():
        if why := why_no_name(name):
            raise ModelFileError(f'parameter name {name!r} {why}')
        if given is None:
            continue
        number, unit = _quantity(given, f'parameter {name}')
        values[name] = number
        if unit:
            units[name] = unit
    ground = _ground(top.get('ground', GROUND))
    elements = _mapping(top.get('elements'), 'elements', None)
    if not elements:
        raise ModelFileError('elements is empty; give at least one')
    branches: list[Branch] = []
    two_ports: list[TwoPort] = []
    for name, given in elements.items():
        try:
            element = _element(name, given, values, units, ground)
        except (GraphError, ModelFileError) as error:
            message = str(error)
            named = re.match(rf'(?!unit )([\w-]+ ){{0,2}}{re.escape(repr(name))}', message)
            raise ModelFileError(message if named else f'element {name!r}: {message}') from error
        if isinstance(element, Branch):
            branches.append(element)
        else:
            two_ports.append(element)
    graph = LinearGraph(tuple(branches), tuple(two_ports), ground)
    check_complete(graph)
    check_symbols(graph)
    check_units(graph, units)
    outputs = tuple(_texts([] if top.get('outputs') is None else top['outputs'], 'outputs'))
    for output in outputs:
        graph.variable(output)
    used = {name for branch in branches for name in _names(branch)}
    used |= {name for two_port in two_ports for name in _names(two_port)}
    for name in parameters:
        if name not in used:
            raise ModelFileError(f'parameter {name!r} is used by no element'
                                 f'{suggestion(name, sorted(used))}')
    return Netlist(_text(top.get('name', 'graph'), 'name'), graph, values, outputs, units,
                   _text(top.get('about', ''), 'about'))


def _names(element: Branch | TwoPort) -> tuple[str, ...]:
    if element.characteristic is not None:
        return element.characteristic.parameters
    source = isinstance(element, Branch) and element.kind in SOURCES
    return () if source else names_in(element.value)


def _element(name: str, given: Any, values: dict[str, float], units: dict[str, str],
             ground: Ground) -> Branch | TwoPort:
    if why := why_no_name(name):
        raise ModelFileError(f'element name {name!r} {why}')
    entry = _mapping(given, f'element {name!r}', None)
    what = _text(entry.get('is', ''), 'is')
    two_ports = {kind.value: kind for kind in TWO_PORT_KINDS}
    if what in two_ports:
        _known(entry, f'element {name!r}', TWO_PORT['properties'])
        ports = [_port(entry.get(f'port {number}'), f'port {number}', ground)
                 for number in (1, 2)]
        law = _law(entry)
        two_port = TwoPort(name, two_ports[what], ports[0], ports[1], '' if law else '1',
                           characteristic=law)
        return two_port if law else replace(
            two_port, value=_value(entry, two_port, values, units))
    if what not in ELEMENTS:
        raise ModelFileError(f'is: {what!r} is not an element{_meant(what)}')
    _known(entry, f'element {name!r}', ONE_PORT['properties'])
    kind, domain = ELEMENTS[what]
    if 'from' not in entry:
        pushes = f'write from: {_ground_of(ground, domain)} for a source that pushes from there'
        _node(entry, 'from', None, pushes if kind in SOURCES and 'to' in entry else '')
    form = None
    if 'form' in entry:
        forms = {form.value: form for form in Form}
        text = _text(entry['form'], 'form')
        if text not in forms:
            raise ModelFileError(f'form {text!r} must be one of {", ".join(forms)}')
        form = forms[text]
    law = _law(entry)
    tail, head = _node(entry, 'from', None), _node(entry, 'to', _ground_of(ground, domain))
    if law is not None:
        return Branch(name, kind, domain, tail, head, form=form, characteristic=law)
    if kind in SOURCES:
        given = entry.get('value', '')
        return Branch(name, kind, domain, tail, head,
                      _text(given if isinstance(given, str) else str(given), 'value'))
    branch = Branch(name, kind, domain, tail, head, '1', form)
    return replace(branch, value=_value(entry, branch, values, units))


def _meant(what: str) -> str:
    """Return the word for an element that is known by another one, or all words."""
    if word := OTHER_WORDS.get(what.lower()):
        return f'; write {word}'
    known = (*ELEMENTS, *(kind.value for kind in TWO_PORT_KINDS))
    return close_name(what, known, cutoff=CLOSE) or f'; there are {", ".join(known)}'


def _value(entry: Mapping[str, Any], draft: Branch | TwoPort, values: dict[str, float],
           units: dict[str, str]) -> str:
    """Return the value's expression; a number becomes a parameter of the element's name."""
    given = entry.get('value', draft.name)
    if isinstance(given, str) and not _QUANTITY.fullmatch(given):
        return given
    match = _QUANTITY.fullmatch(str(given))
    if match is not None and isinstance(given, str) and re.match(r'[*/+\-]', match.group(2)):
        return given    # an expression that begins with a number
    if draft.name in values:
        raise ModelFileError(f'{draft.name!r} is a parameter too; write value: {draft.name}, or '
                             'give the number in one place')
    number, unit = _quantity(given, 'value')
    check_number(draft, number, str(given))
    values[draft.name] = number
    units[draft.name] = unit or unit_needed(draft)
    return draft.name


def _quantity(given: Any, what: str) -> tuple[float, str]:
    """Return a number in SI and its unit; a number without a unit is SI."""
    if isinstance(given, bool) or not isinstance(given, int | float | str):
        raise ModelFileError(f"{what} must be a number with a unit, such as '0.5 ohm'")
    match = _QUANTITY.fullmatch(str(given))
    if isinstance(given, float) and not math.isfinite(given):
        raise ModelFileError(f'{what} is not finite, or beyond 1e308')
    if match is not None and re.match(r'[*/+\-]', match.group(2)):
        raise ModelFileError(f'{what} = {given!r} must be a number; expressions stand in the '
                             'values of elements')
    if match is None:
        raise ModelFileError(f'{what} = {given!r} must be a number with a unit, '
                             "such as '0.5 ohm'")
    number, unit = float(match.group(1)), match.group(2)
    if re.match(r',\d', unit):
        raise ModelFileError(f'{what} = {given!r} has a comma in its number; a decimal is written '
                             'with a point')
    try:
        scaled = number * parse_unit(unit).scale
    except GraphError as error:
        raise ModelFileError(f'{what}: {error}') from error
    if not abs(scaled) < 1e300:
        raise ModelFileError(f'{what} = {given!r} is too large')
    return scaled, unit


def _law(entry: Mapping[str, Any]) -> Characteristic | None:
    if 'law' not in entry:
        for key in ('of', 'parameters'):
            if key in entry:
                raise ModelFileError(f'{key} needs a law')
        return None
    if 'value' in entry:
        raise ModelFileError('give a value or a law, not both')
    return Characteristic(_text(entry['law'], 'law'), tuple(_texts(entry.get('of', []), 'of')),
                          tuple(_texts(entry.get('parameters', []), 'parameters')))


def _port(given: Any, what: str, ground: Ground) -> Port:
    entry = _mapping(given, what, PORT['properties'])
    domains = {domain.value: domain for domain in Domain}
    text = _text(entry.get('domain', ''), 'domain')
    if text not in domains:
        raise ModelFileError(f'{what}: domain {text!r} must be one of {", ".join(domains)}')
    domain = domains[text]
    return domain, _node(entry, 'from', None), _node(entry, 'to', _ground_of(ground, domain))


def _ground(given: Any) -> Ground:
    if isinstance(given, int | str) and not isinstance(given, bool):
        return str(given)
    domains = {domain.value: domain for domain in Domain}
    entry = _mapping(given, 'ground', domains)
    return {domains[key]: _node(entry, key, None) for key in entry}


def _ground_of(ground: Ground, domain: Domain) -> str:
    # a domain without ground is refused by the graph
    return ground if isinstance(ground, str) else ground.get(domain, GROUND)


def _node(entry: Mapping[str, Any], key: str, default: str | None, remedy: str = '') -> str:
    given = entry.get(key, default)
    if isinstance(given, int) and not isinstance(given, bool):
        return str(given)
    if key not in entry and given is None:
        usual = 'it names the node that the branch leaves'
        raise ModelFileError(f'{key} is missing; {remedy or usual}' + (
            ' (there is form: in place of from:)' if key == 'from' and 'form' in entry else ''))
    if not isinstance(given, str):
        raise ModelFileError(f'{key}: {given!r} is no text; put the name of the node in quotes')
    return given


def _mapping(given: Any, what: str, known: Collection[str] | None) -> Mapping[str, Any]:
    if not isinstance(given, dict):
        raise ModelFileError(f'{what} must be entries of the form key: value')
    for key in given:
        if not isinstance(key, str):
            raise ModelFileError(f'{what}: key {key!r} must be a text; put it in quotes (on, yes, '
                                 'off and no are read as true and false)')
    if known is not None:
        _known(given, what, known)
    return given


def _known(given: Mapping[str, Any], what: str, known: Collection[str]) -> None:
    for key in given:
        if key not in known and given[key] is None and key[:1].isdigit():
            raise ModelFileError(f'{what}: {key!r} stands after a comma, which ends an entry; a '
                                 'decimal is written with a point')
        if key not in known:
            raise ModelFileError(f'{what}: unknown key {key!r}{suggestion(key, sorted(known))}')


def _text(given: Any, what: str) -> str:
    if not isinstance(given, str) or len(given) > LONGEST_TEXT:
        raise ModelFileError(f'{what} must be a short text')
    return given


def _texts(given: Any, what: str) -> list[str]:
    if not isinstance(given, list):
        raise ModelFileError(f'{what} must be a list')
    return [_text(item, what) for item in given]
