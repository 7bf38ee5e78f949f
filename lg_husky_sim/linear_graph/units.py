# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Units of element values: read, and checked against the element's kind and domain.

Angles count as pure numbers, so N·m·s/rad and N·m·s are one unit; rad/(N·m·s) is its inverse.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
import math
import re

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.elements import (
    article,
    Branch,
    Domain,
    Form,
    Kind,
    SOURCES,
    TwoPort,
)
from lg_husky_sim.linear_graph.expressions import names_in, number_of, parse
from lg_husky_sim.linear_graph.graph import LinearGraph

Dimension = tuple[Fraction, ...]
PURE: Dimension = (Fraction(0),) * 5


def _dimension(*powers: int) -> Dimension:
    """Return powers of kg, m, s, A and K."""
    return tuple(Fraction(power) for power in powers)


_UNITS: Mapping[str, tuple[float, Dimension]] = {
    '1': (1.0, PURE), 'rad': (1.0, PURE),
    'g': (1e-3, _dimension(1, 0, 0, 0, 0)), 'm': (1.0, _dimension(0, 1, 0, 0, 0)),
    's': (1.0, _dimension(0, 0, 1, 0, 0)), 'A': (1.0, _dimension(0, 0, 0, 1, 0)),
    'K': (1.0, _dimension(0, 0, 0, 0, 1)), 'Hz': (1.0, _dimension(0, 0, -1, 0, 0)),
    'N': (1.0, _dimension(1, 1, -2, 0, 0)), 'Pa': (1.0, _dimension(1, -1, -2, 0, 0)),
    'J': (1.0, _dimension(1, 2, -2, 0, 0)), 'W': (1.0, _dimension(1, 2, -3, 0, 0)),
    'V': (1.0, _dimension(1, 2, -3, -1, 0)), 'C': (1.0, _dimension(0, 0, 1, 1, 0)),
    'ohm': (1.0, _dimension(1, 2, -3, -2, 0)), 'S': (1.0, _dimension(-1, -2, 3, 2, 0)),
    'H': (1.0, _dimension(1, 2, -2, -2, 0)), 'F': (1.0, _dimension(-1, -2, 4, 2, 0)),
    'Wb': (1.0, _dimension(1, 2, -2, -1, 0)), 'T': (1.0, _dimension(1, 0, -2, -1, 0)),
    'L': (1e-3, _dimension(0, 3, 0, 0, 0)), 'l': (1e-3, _dimension(0, 3, 0, 0, 0)),
    'bar': (1e5, _dimension(1, -1, -2, 0, 0))}
_NO_PREFIX: Mapping[str, tuple[float, Dimension]] = {
    'min': (60.0, _dimension(0, 0, 1, 0, 0)), 'h': (3600.0, _dimension(0, 0, 1, 0, 0)),
    'deg': (math.pi / 180.0, PURE), 'rpm': (math.pi / 30.0, _dimension(0, 0, -1, 0, 0)),
    'degC': (1.0, _dimension(0, 0, 0, 0, 1))}
_PREFIXES = {'f': 1e-15, 'p': 1e-12, 'n': 1e-9, 'u': 1e-6, 'm': 1e-3, 'c': 1e-2, 'd': 1e-1,
             'h': 1e2, 'k': 1e3, 'M': 1e6, 'G': 1e9, 'T': 1e12}
_ALIASES = {'\u03a9': 'ohm', '\u2126': 'ohm',
            'Ohm': 'ohm', '°C': 'degC', '°': 'deg', 'µ': 'u', 'μ': 'u', '·': '*', '⋅': '*',
            '∙': '*', '×': '*', '^': '**', '−': '-'}
_RAISED = str.maketrans('⁻⁰¹²³⁴⁵⁶⁷⁸⁹', '-0123456789')
_WORDS = {'cc': 'cm³', 'sec': 's', 'kgs': 'kg'}

_ACROSS_UNIT = {Domain.ELECTRICAL: 'V', Domain.TRANSLATIONAL: 'm/s', Domain.ROTATIONAL: 'rad/s',
                Domain.FLUID: 'Pa', Domain.THERMAL: 'K'}
_THROUGH_UNIT = {Domain.ELECTRICAL: 'A', Domain.TRANSLATIONAL: 'N', Domain.ROTATIONAL: 'N·m',
                 Domain.FLUID: 'm³/s', Domain.THERMAL: 'W'}
_USUAL = {
    Kind.A_TYPE: ('F', 'kg', 'kg·m²', 'm³/Pa', 'J/K'),
    Form.INERTANCE: ('H', 'm/N', 'rad/(N·m)', 'Pa·s²/m³', ''),
    Form.STIFFNESS: ('1/H', 'N/m', 'N·m/rad', 'm³/(Pa·s²)', ''),
    Form.RESISTANCE: ('ohm', 'm/(N·s)', 'rad/(N·m·s)', 'Pa·s/m³', 'K/W'),
    Form.DAMPING: ('S', 'N·s/m', 'N·m·s/rad', 'm³/(Pa·s)', 'W/K')}


@dataclass(frozen=True)
class Unit:
    """
    A unit of measurement.

    Parameters
    ----------
    text : str
        As it was written.
    scale : float
        Value of one such unit in SI.
    dimension : tuple of Fraction
        Powers of kg, m, s, A and K.

    """

    text: str
    scale: float
    dimension: Dimension


def parse_unit(text: str) -> Unit:
    """
    Read a unit such as ``'N·m·s/rad'``, ``'kg*m^2'`` or ``'mH'``.

    Raises
    ------
    GraphError
        If a part of it is no unit.

    """
    shown = repr(text)
    if not isinstance(text, str) or len(text) > 60:
        raise GraphError(f'unit {shown[:70]} must be a short text')
    plain = text.strip() or '1'
    for alias, replacement in _ALIASES.items():
        plain = plain.replace(alias, replacement)
    plain = re.sub('[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+', lambda power: f'**{power.group().translate(_RAISED)}', plain)
    plain = re.sub(r'([A-Za-z])(\d+)\b', r'\1**\2', plain)             # m2
    plain = re.sub(r'(?<=[\w)])(?:\s+|[-.])(?=[A-Za-z(])', '*', plain)  # kg m, kg.m, N-m
    if plain == 'degC':
        raise GraphError(f'unit {shown}: temperatures are given from absolute zero or as '
                         'differences; write K')
    try:
        tree = parse(plain)
    except GraphError as error:
        raise GraphError(f"unit {shown} cannot be read; write it like 'N·m·s/rad'") from error
    scale, dimension = _unit_of(tree, shown)
    return Unit(text, scale, dimension)


def _unit_of(node: ast.expr, shown: str) -> tuple[float, Dimension]:
    if isinstance(node, ast.Name):
        if (found := _named(node.id)) is not None:
            return found
        if node.id in _PREFIXES:
            raise GraphError(f'unit {shown}: {node.id!r} is a prefix without a unit')
        if meant := _meant(node.id):
            raise GraphError(f'unit {shown}: {node.id!r} is not a known unit; did you mean '
                             f'{meant!r}?')
        raise GraphError(f'unit {shown}: {node.id!r} is not a known unit; known are '
                         f'{", ".join(_UNITS)} with the prefixes {", ".join(_PREFIXES)}, and '
                         f'{", ".join(_NO_PREFIX)}')
    if number_of(node) == 1.0:
        return 1.0, PURE
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        left, right = _unit_of(node.left, shown), _unit_of(node.right, shown)
        sign = 1 if isinstance(node.op, ast.Mult) else -1
        return left[0] * right[0] ** sign, tuple(
            a + sign * b for a, b in zip(left[1], right[1], strict=True))
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
        scale, dimension = _unit_of(node.left, shown)
        power = Fraction(number_of(node.right) or 0.0).limit_denominator(12)
        return scale ** float(power), tuple(a * power for a in dimension)
    raise GraphError(f"unit {shown} cannot be read; write it like 'N·m·s/rad'")


def _named(name: str) -> tuple[float, Dimension] | None:
    if name in _UNITS or name in _NO_PREFIX:
        return _UNITS.get(name) or _NO_PREFIX[name]
    prefix, unit = name[:1], name[1:]
    if prefix in _PREFIXES and unit in _UNITS and unit != '1':
        scale, dimension = _UNITS[unit]
        return _PREFIXES[prefix] * scale, dimension
    return None


def _meant(name: str) -> str:
    """Return a unit that may be meant: a product without its dot, or other capitals."""
    if word := _WORDS.get(name) or (name[:-1] if name.endswith('s') and len(name) > 3 and _named(
            name[:-1]) else ''):
        return word
    capitals = [name[0].lower() + name[1:], name[0] + name[1:].upper(), name[0].upper() + name[1:]]
    products = [_product(name, plain=True), _product(name, plain=False)]
    if products[0].count('·') > 1 and products[0][0] in _PREFIXES:     # mN·m
        products[0] = products[0].replace('·', '', 1)
    order = [*capitals, *products] if name[0] == 'K' else [products[0], *capitals, products[1]]
    return next((text for text in order if '·' in text or (text and _named(text))), '')


def _product(name: str, plain: bool) -> str:
    if name in _UNITS or (not plain and _named(name) is not None):
        return name
    for at in range(len(name) - 1, 0, -1):
        head, tail = name[:at], _product(name[at:], plain)
        if tail and (head in _UNITS or (not plain and _named(head) is not None)):
            return f'{head}·{tail}'
    return ''


def unit_needed(element: Branch | TwoPort) -> str:
    """
    Return the SI unit that the value of an element has in its kind and domain.

    Parameters
    ----------
    element : Branch or TwoPort
        A source's value is what it sets.

    Returns
    -------
    str
        For example ``'N·m·s/rad'``.

    """
    if isinstance(element, TwoPort):
        (one, *_), (two, *_) = element.port1, element.port2
        other = _ACROSS_UNIT if element.kind is Kind.TRANSFORMER else _THROUGH_UNIT
        return quotient(_ACROSS_UNIT[one], other[two])
    if element.kind in SOURCES:
        across = element.kind is Kind.ACROSS_SOURCE
        return (_ACROSS_UNIT if across else _THROUGH_UNIT)[element.domain]
    if element.kind is Kind.D_TYPE and element.characteristic is not None:
        return (_THROUGH_UNIT if element.is_damping else _ACROSS_UNIT)[element.domain]
    usual = _USUAL[element.given_form or Kind.A_TYPE]
    return usual[list(Domain).index(element.domain)]


def quotient(above: str, below: str) -> str:
    """Return one unit over another, such as ``'(rad/s)/V'``."""
    return '/'.join(f'({unit})' if re.search(r'[·/]', unit) else unit for unit in (above, below))


def check_units(graph: LinearGraph, units: Mapping[str, str]) -> tuple[str, ...]:
    """
    Check the unit of every element's value against its kind and domain.

    Parameters
    ----------
    graph : LinearGraph
        Elements with a ``unit`` of their own are checked by it; the others by the units of the
        parameters in their expression. Laws are checked by their parameters' units.
    units : mapping of str to str
        Unit of each parameter; those left out leave their elements unchecked.

    Returns
    -------
    tuple of str
        Names of elements that could not be checked for lack of a unit.

    Raises
    ------
    GraphError
        For the first element with a wrong unit, saying what it has and what it needs.

    """
    unchecked = []
    elements: list[Branch | TwoPort] = [*graph.branches, *graph.two_ports]
    for element in elements:
        if element.unit:
            _compare(element, parse_unit(element.unit).dimension, element.unit, [element.unit])
        law = element.characteristic
        if law is None and isinstance(element, Branch) and element.kind in SOURCES:
            continue
        text = law.expression if law is not None else element.value
        own = dict(zip(law.arguments, law.of, strict=True)) if law is not None else {}
        names = [name for name in names_in(text) if name not in own]
        if any(name not in units for name in names):
            if not element.unit:
                unchecked.append(element.name)
            continue
        if law is None and not names:
            continue    # a bare number has the unit that is needed
        known = {name: parse_unit(units[name]).dimension for name in names}
        known.update({name: _variable(graph, of) for name, of in own.items()})
        shown = text if law is None else f'its law {law.law}'
        try:
            found = dimension_of(parse(text), known)
        except GraphError as error:
            raise GraphError(f'element {element.name!r}, {shown}: {error}') from error
        of_units = ', '.join(f'{name} [{units[name]}]' for name in names)
        _compare(element, found, f'{shown} with {of_units}' if names else shown,
                 [units[name] for name in names])
    return tuple(unchecked)


def unit_of(graph: LinearGraph, text: str) -> str:
    """Return the SI unit of a variable such as ``'omega(J_1)'``, or of an input."""
    for source in graph.of_kind(*SOURCES):
        if source.characteristic is None and source.input_name == text:
            return unit_needed(source)
    variable = graph.variable(text)
    domain = graph.edges[variable.edge].domain
    return (_ACROSS_UNIT if variable.is_across else _THROUGH_UNIT)[domain]


def _variable(graph: LinearGraph, text: str) -> Dimension:
    return parse_unit(unit_of(graph, text)).dimension


def _compare(element: Branch | TwoPort, found: Dimension, shown: str, given: Sequence[str]
             ) -> None:
    needed = unit_needed(element)
    expected = parse_unit(needed).dimension
    if found == expected:
        _refuse_hertz(element, given)
        return
    what = element.kind.value
    form = ''
    if isinstance(element, Branch):
        what = f'{element.domain.value} {what}'
        form = f' ({element.given_form.value})' if element.given_form else ''
    hint = ''
    if isinstance(element, Branch) and element.characteristic is not None and form:
        other = Form.RESISTANCE if element.is_damping else Form.DAMPING
        if parse_unit(unit_needed(replace(element, form=other))).dimension == found:
            hint = f'; it fits with form: {other.value}'
    elif found == tuple(-power for power in expected):
        hint = '; it is the inverse, so invert the value' + (
            ' or choose the other form' if form else '')
    elif len(given) == 1 and (parts := re.fullmatch('([^/()]+)/([^/()]+)/([^/()]+)', given[0])):
        meant = '{}/({}/{})'.format(*parts.groups())
        hint = f'; write {meant}' if parse_unit(meant).dimension == expected else ''
    raise GraphError(f'unit of {element.name!r}: {shown} does not fit {article(what)}{form}, '
                     f'which needs {needed}{hint}')


def _refuse_hertz(element: Branch | TwoPort, given: Sequence[str]) -> None:
    """Refuse Hz in rotation, where it may be a turn or a radian in a second."""
    domains = {element.domain} if isinstance(element, Branch) else {
        element.port1[0], element.port2[0]}
    for unit in given:
        if Domain.ROTATIONAL in domains and 'Hz' in unit:
            raise GraphError(f'unit of {element.name!r}: {unit} may mean turns or radians in a '
                             'second; write rad/s, or rpm for turns in a minute')


def dimension_of(node: ast.expr, known: Mapping[str, Dimension]) -> Dimension:
    """
    Return the dimension of an expression.

    Raises
    ------
    GraphError
        If unlike things are added, or a function gets more than a pure number.

    """
    match node:
        case ast.Constant():
            return PURE
        case ast.Name(id=name):
            return known.get(name, PURE)
        case ast.UnaryOp(operand=operand):
            return dimension_of(operand, known)
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            power = Fraction(number_of(right) or 0.0).limit_denominator(12)
            return tuple(a * power for a in dimension_of(left, known))
        case ast.BinOp(left=left, op=op, right=right):
            one, two = dimension_of(left, known), dimension_of(right, known)
            if isinstance(op, ast.Mult | ast.Div):
                sign = 1 if isinstance(op, ast.Mult) else -1
                return tuple(a + sign * b for a, b in zip(one, two, strict=True))
            if one != two and number_of(left) != 0.0 and number_of(right) != 0.0:
                raise GraphError(f'{ast.unparse(left)} and {ast.unparse(right)} have different '
                                 'units and cannot be added')
            return two if number_of(left) == 0.0 else one
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            inner = dimension_of(argument, known)
            if name == 'abs':
                return inner
            if name == 'sqrt':
                return tuple(a / 2 for a in inner)
            if inner != PURE:
                raise GraphError(f'{name} needs a pure number, but {ast.unparse(argument)} has '
                                 'a unit')
            return PURE
    raise GraphError(f'{ast.unparse(node)!r} is not an expression')
