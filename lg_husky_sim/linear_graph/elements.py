# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The elements of a linear graph: one-port branches and two-ports.

Sign convention (Rowell and Wormley, System Dynamics: An Introduction, ch. 3 to 6): a branch
points from its tail to its head. Its across variable is across(tail) - across(head), its through
variable flows from tail to head, and their product is the power that the element takes up.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.expressions import (
    linear_coefficients,
    names_in,
    parse,
    why_no_name,
)
from lg_husky_sim.linear_graph.laws import expression_of


class Domain(Enum):
    """
    Energy domain with the symbols of its across and its through variable.

    The product of the two is power in every domain but the thermal one, whose across variable is
    temperature and whose through variable is heat flow, itself a power.
    """

    ELECTRICAL = 'electrical'
    TRANSLATIONAL = 'translational'
    ROTATIONAL = 'rotational'
    FLUID = 'fluid'
    THERMAL = 'thermal'

    @property
    def across(self) -> str:
        """Symbol of the across variable: V, v, omega, P or T."""
        return _SYMBOLS[self][0]

    @property
    def through(self) -> str:
        """Symbol of the through variable: i, F, tau, Q or q."""
        return _SYMBOLS[self][1]


_SYMBOLS = {
    Domain.ELECTRICAL: ('V', 'i'), Domain.TRANSLATIONAL: ('v', 'F'),
    Domain.ROTATIONAL: ('omega', 'tau'), Domain.FLUID: ('P', 'Q'), Domain.THERMAL: ('T', 'q')}


class Kind(Enum):
    """What an element is in the theory's words."""

    ACROSS_SOURCE = 'across source'
    THROUGH_SOURCE = 'through source'
    A_TYPE = 'A-type'
    T_TYPE = 'T-type'
    D_TYPE = 'D-type'
    TRANSFORMER = 'transformer'
    GYRATOR = 'gyrator'


def article(words: str) -> str:
    """Return the words with their indefinite article."""
    return f'{"an" if words[0] in "AEIOaeio" else "a"} {words}'


SOURCES = (Kind.ACROSS_SOURCE, Kind.THROUGH_SOURCE)
TWO_PORT_KINDS = (Kind.TRANSFORMER, Kind.GYRATOR)


class Form(Enum):
    """Which way the value of a D-type or a T-type is meant."""

    RESISTANCE = 'resistance'   # D-type: across = value * through
    DAMPING = 'damping'         # D-type: through = value * across
    INERTANCE = 'inertance'     # T-type: across = value * d(through)/dt
    STIFFNESS = 'stiffness'     # T-type: d(through)/dt = value * across


_FORMS = {Kind.D_TYPE: (Form.RESISTANCE, Form.DAMPING),
          Kind.T_TYPE: (Form.INERTANCE, Form.STIFFNESS)}


def default_form(kind: Kind, domain: Domain) -> Form | None:
    """
    Return how an element's value is usually given in its domain.

    A D-type is a damping B in mechanics and a resistance R elsewhere; a T-type is a stiffness K
    in mechanics, an inductance L or a fluid inertance I elsewhere. Other kinds have no form.
    """
    if kind not in _FORMS:
        return None
    mechanical = domain in (Domain.TRANSLATIONAL, Domain.ROTATIONAL)
    return _FORMS[kind][mechanical]


@dataclass(frozen=True)
class Characteristic:
    """
    Value of a branch as a function of variables of the graph.

    Parameters
    ----------
    law : str
        Name of a law of :data:`~lg_husky_sim.linear_graph.laws.LAWS`, or an expression in the
        arguments ``z1``, ``z2``, ... (``z`` is ``z1``) and the named parameters.
    of : tuple of str
        The arguments: variables such as ``'v(M_H)'`` or ``'i(L_1)'``.
    parameters : tuple of str
        Names of parameters; a named law takes them in its own order.
    modulated : bool
        Whether a parameter is a signal that changes in time (a heading, a temperature): the law
        is then never taken for a linear one.

    Raises
    ------
    GraphError
        If the law cannot be read, or its arguments and parameters do not fit it.

    """

    law: str
    of: tuple[str, ...]
    parameters: tuple[str, ...] = ()
    modulated: bool = False

    def __post_init__(self) -> None:
        """Check the law against its arguments and parameters."""
        object.__setattr__(self, 'of', tuple(self.of))
        object.__setattr__(self, 'parameters', tuple(self.parameters))
        for name in self.parameters:
            if why := why_no_name(name):
                raise GraphError(f'law {self.law!r}: parameter name {name!r} {why}')
        unknown = set(names_in(self.expression)) - set(self.parameters) - set(self.arguments)
        if unknown:
            raise GraphError(
                f'law {self.law!r} uses {", ".join(sorted(unknown))}, which is neither one of its '
                f'arguments {", ".join(self.arguments) or "(none)"} nor one of its parameters '
                f'{", ".join(self.parameters) or "(none)"}')

    @property
    def arguments(self) -> tuple[str, ...]:
        """Names of the arguments inside :attr:`expression`: z1, z2, ..."""
        return tuple(f'z{index + 1}' for index in range(len(self.of)))

    @property
    def expression(self) -> str:
        """Return the law as an expression in z1, z2, ... and the parameters."""
        return expression_of(self.law, len(self.of), self.parameters)

    @property
    def linear(self) -> dict[str, str] | None:
        """Coefficient of each argument if the law is linear without a constant, else None."""
        return None if self.modulated else linear_coefficients(self.expression, self.arguments)


@dataclass(frozen=True)
class Branch:
    """
    One-port element: a source, a storage or a dissipator.

    Parameters
    ----------
    name : str
        Unique in the graph.
    kind : Kind
        Any kind but transformer and gyrator.
    domain : Domain
        Energy domain.
    tail, head : str
        Nodes; the branch points from tail to head.
    value : str
        Expression in named parameters, SI; for a source the name of its input (default: the
        name of the branch).
    form : Form, optional
        For a D-type, whether the value is a resistance (across = value * through) or a damping
        (through = value * across); for a T-type, whether it is an inertance
        (across = value * d(through)/dt) or a stiffness (d(through)/dt = value * across).
        Default: damping and stiffness in mechanics, resistance and inertance elsewhere.
    characteristic : Characteristic, optional
        On a source: its value is a named effort. On a D-type: its through variable (damping) or
        its across variable (resistance) is that function, usually of its own other variable.
    unit : str
        Unit of the value, for the unit check; '' for the SI unit of the element.

    Raises
    ------
    GraphError
        If a field cannot be right whatever the graph is.

    """

    name: str
    kind: Kind
    domain: Domain
    tail: str
    head: str
    value: str = ''
    form: Form | None = None
    characteristic: Characteristic | None = None
    unit: str = ''

    def __post_init__(self) -> None:
        """Check the branch by itself."""
        _check_name(self.name, 'branch')
        if self.kind in TWO_PORT_KINDS:
            raise GraphError(f'branch {self.name!r}: {article(self.kind.value)} has two ports; '
                             'make it with TwoPort')
        for node in (self.tail, self.head):
            _check_node(node, self.name)
        if self.tail == self.head:
            raise GraphError(f'branch {self.name!r} starts and ends at node {self.tail!r}; '
                             'a branch must join two nodes')
        allowed = _FORMS.get(self.kind, ())
        if self.form is not None and self.form not in allowed:
            names = ' or '.join(form.value for form in allowed) or 'no form'
            raise GraphError(f'branch {self.name!r}: {article(self.kind.value)} takes {names}, '
                             f'not {self.form.value}')
        if self.domain is Domain.THERMAL and self.kind is Kind.T_TYPE:
            raise GraphError(f'branch {self.name!r}: the thermal domain has no T-type; '
                             'use an A-type (heat capacity) or a D-type (thermal resistance)')
        self._check_value()

    def _check_value(self) -> None:
        if self.characteristic is not None:
            if self.kind not in (*SOURCES, Kind.D_TYPE):
                raise GraphError(f'branch {self.name!r}: {article(self.kind.value)} takes no '
                                 'characteristic; put it on a source or a D-type')
            if self.value:
                raise GraphError(f'branch {self.name!r} has a value {self.value!r} and a '
                                 'characteristic; give one of them')
            return
        if self.kind in SOURCES:
            if self.value and (why := why_no_name(self.value)):
                raise GraphError(
                    f'source {self.name!r}: input name {self.value!r} {why}; the value of a '
                    'source is the name of its input, so leave it out: numbers come when it is '
                    'simulated')
            return
        if not isinstance(self.value, str) or not self.value:
            raise GraphError(f'branch {self.name!r} has no value; {article(self.kind.value)} '
                             'needs one, such as R_1')
        try:
            parse(self.value)
        except GraphError as error:
            raise GraphError(f'branch {self.name!r}: {error}') from error

    @property
    def input_name(self) -> str:
        """Name of the input of a source without characteristic."""
        return self.value or self.name

    @property
    def given_form(self) -> Form | None:
        """Return the form, or its default; None for elements without one."""
        return self.form or default_form(self.kind, self.domain)

    @property
    def is_damping(self) -> bool:
        """Whether a D-type's value (or law) gives through from across."""
        return self.given_form is Form.DAMPING

    @property
    def is_stiffness(self) -> bool:
        """Whether a T-type's value is a stiffness."""
        return self.given_form is Form.STIFFNESS


Port = tuple[Domain, str, str]


@dataclass(frozen=True)
class TwoPort:
    """
    Ideal, power-conserving transformer or gyrator between two ports.

    With both ports absorbing power (Rowell and Wormley, ch. 6):

    - transformer: across_1 = value * across_2, through_2 = -value * through_1
    - gyrator: across_1 = value * through_2, across_2 = -value * through_1

    Parameters
    ----------
    name : str
        Unique in the graph; its ports are called ``name.1`` and ``name.2``.
    kind : Kind
        Kind.TRANSFORMER or Kind.GYRATOR.
    port1, port2 : tuple of (Domain, tail, head)
        The two branches.
    value : str
        Ratio as an expression in named parameters, SI.
    unit : str
        Unit of the ratio, for the unit check; '' for the SI unit.
    characteristic : Characteristic, optional
        In place of the value: the ratio as a function of variables (a modulated two-port, such
        as a crank, or a motor with a controlled field). Each port then becomes a named effort.

    Raises
    ------
    GraphError
        If a field cannot be right whatever the graph is.

    """

    name: str
    kind: Kind
    port1: Port
    port2: Port
    value: str = ''
    unit: str = ''
    characteristic: Characteristic | None = None

    def __post_init__(self) -> None:
        """Check the two-port by itself."""
        _check_name(self.name, 'two-port')
        if self.kind not in TWO_PORT_KINDS:
            raise GraphError(f'two-port {self.name!r}: {article(self.kind.value)} has one port; '
                             'make it with Branch')
        for number, (domain, tail, head) in enumerate((self.port1, self.port2), start=1):
            label = f'{self.name}.{number}'
            for node in (tail, head):
                _check_node(node, label)
            if tail == head:
                raise GraphError(f'port {label!r} starts and ends at node {tail!r}; '
                                 'a port must join two nodes')
            if domain is Domain.THERMAL:
                raise GraphError(f'port {label!r} is thermal: temperature times heat flow is no '
                                 'power, so no two-port can couple it; use a modulated source')
        if (self.characteristic is None) != bool(self.value):
            raise GraphError(f'two-port {self.name!r} needs either a value (its ratio) or a '
                             'characteristic')
        if self.characteristic is None:
            try:
                parse(self.value)
            except GraphError as error:
                raise GraphError(f'two-port {self.name!r}: {error}') from error


def _check_name(name: str, what: str) -> None:
    if why := why_no_name(name):
        raise GraphError(f'{what} name {name!r} {why}')


def _check_node(node: str, owner: str) -> None:
    if not isinstance(node, str) or not node or not node.isprintable() or len(node) > 60:
        raise GraphError(f'branch {owner!r}: node {node!r} must be a short printable text')
