# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A graph that effects have changed, and what an edit of it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
import enum
import re
from types import MappingProxyType

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import EXPRESSIONS, Law, SIGNALS
from lg_husky_sim.linear_graph import Branch, Characteristic, Domain, Kind, LinearGraph, TwoPort
from lg_husky_sim.linear_graph.expressions import names_in

#: A coefficient of a law: a number, or an expression in the names of the parameters.
Coefficient = str | float


@dataclass(frozen=True)
class LawRow:
    """
    The law that one modulated source of the graph follows.

    Parameters
    ----------
    law : Law
    coefficients : tuple
        Numbers, or expressions in the names of the parameters, in the law's order.
    felt : bool
        Whether an accelerometer feels the effort; gravity it does not.
    motor : int
        Number of the motor that the source is in series with; 0 for any other law.

    """

    law: Law
    coefficients: tuple[Coefficient, ...]
    felt: bool = True
    motor: int = 0


@dataclass(frozen=True)
class EditedNetwork:
    """
    A graph with what the effects have changed in and around it.

    Parameters
    ----------
    graph : LinearGraph
    laws : mapping of str to LawRow
        By the name of the modulated source.
    command : mapping of str to expression
        Entries of the command stage (latency, slew_forward, ...).
    sensors : mapping of str to expression
        Entries of the sensor model (gyro_bias, ...).
    speed_loop : bool
        Whether the base closes a wheel-speed loop.
    command_lag : expression
        Time constant by which the base smooths its commands; empty where it does not.
    grip : expression
        Factor on the limit of a tyre's force.
    counted : mapping of str to str
        Inertia that the encoder of a side turns with, by the letter of the side, where that is
        not the axle of its motor.

    """

    graph: LinearGraph
    laws: Mapping[str, LawRow] = field(default_factory=dict)
    command: Mapping[str, str] = field(default_factory=dict)
    sensors: Mapping[str, str] = field(default_factory=dict)
    speed_loop: bool = False
    command_lag: str = ''
    grip: str = ''
    counted: Mapping[str, str] = field(default_factory=dict)

    def changing(self, command: Mapping[str, str] | None = None,
                 sensors: Mapping[str, str] | None = None) -> EditedNetwork:
        """Return this network with entries of the command stage or the sensors changed."""
        return replace(self, command={**self.command, **(command or {})},
                       sensors={**self.sensors, **(sensors or {})})

    def with_values(self, values: Mapping[str, str]) -> EditedNetwork:
        """Return this network with other value expressions on branches or two-ports."""
        graph = self.graph
        for name, value in values.items():
            graph = graph.replacing(replace(element_of(graph, name), value=value))
        return replace(self, graph=graph)

    def with_force(self, name: str, domain: Domain, node: str, ground: str, row: LawRow,
                   of: tuple[str, ...]) -> EditedNetwork:
        """Return this network with a modulated through-source pushing into a node."""
        source = Branch(name, Kind.THROUGH_SOURCE, domain, ground, node,
                        characteristic=_characteristic(row, of))
        return replace(self, graph=self.graph.with_branches(source),
                       laws={**self.laws, name: row})

    def with_effort_on(self, name: str, store: Branch, row: LawRow, *of: str) -> EditedNetwork:
        """Return this network with a modulated through-source pushing an inertia or mass."""
        return self.with_force(name, store.domain, store.tail, store.head, row, of)

    def with_voltage(self, effect: str, number: str, row: LawRow, of: tuple[str, ...],
                     meant: Mapping[str, str] = MappingProxyType({})) -> EditedNetwork:
        """
        Return this network with a modulated across-source in series with a motor's supply.

        ``meant`` are expressions in the arguments that take the place of arguments of the law.
        """
        winding = branch_of(self.graph, f'R_{number}')
        node = f"{branch_of(self.graph, f'V_S{number}').tail}_{effect}"
        name = f'E_{effect}_{number}'
        source = Branch(name, Kind.ACROSS_SOURCE, Domain.ELECTRICAL, node, winding.tail,
                        characteristic=_characteristic(row, of, meant))
        graph = self.graph.replacing(replace(winding, tail=node)).with_branches(source)
        return replace(self, graph=graph, laws={**self.laws, name: row})

    def with_rate_before(self, name: str, elements: tuple[str, ...], row: LawRow,
                         of: tuple[str, ...]) -> EditedNetwork:
        """Return this network with a modulated across-source in series with elements."""
        behind = [branch_of(self.graph, one) for one in elements]
        tail, node = behind[0].tail, f'{behind[0].tail}_{name}'
        source = Branch(name, Kind.ACROSS_SOURCE, behind[0].domain, tail, node,
                        characteristic=_characteristic(row, of))
        graph = self.graph
        for one in behind:
            graph = graph.replacing(replace(one, tail=node))
        return replace(self, graph=graph.with_branches(source), laws={**self.laws, name: row})

    def with_slip_torque(self, name: str, wheel: str, row: LawRow, *others: str
                         ) -> EditedNetwork:
        """Return this network with a modulated through-source beside a wheel's slip element."""
        slip = branch_of(self.graph, f'B_{wheel}')
        return self.with_torque_beside(name, slip, row, f'omega({slip.name})', *others)

    def with_torque_beside(self, name: str, element: Branch, row: LawRow, *of: str
                           ) -> EditedNetwork:
        """Return this network with a modulated through-source beside an element."""
        source = Branch(name, Kind.THROUGH_SOURCE, element.domain, element.tail, element.head,
                        characteristic=_characteristic(row, of))
        return replace(self, graph=self.graph.with_branches(source),
                       laws={**self.laws, name: row})


def _characteristic(row: LawRow, of: tuple[str, ...],
                    meant: Mapping[str, str] = MappingProxyType({})) -> Characteristic:
    texts = {f'p{i}': f'({c})' for i, c in enumerate(row.coefficients)}
    expression = re.sub(r'\bz\d+\b', lambda match: meant.get(match.group(), match.group()),
                        EXPRESSIONS[row.law])
    expression = re.sub(r'\bp\d+\b', lambda match: texts[match.group()], expression)
    arguments = {f'z{i + 1}' for i in range(len(of))}
    parameters = tuple(n for n in names_in(expression) if n not in arguments)
    return Characteristic(expression, of, parameters,
                          modulated=any(name in SIGNALS for name in parameters))


def branch_of(graph: LinearGraph, name: str) -> Branch:
    """Return the branch of that name."""
    return next(branch for branch in graph.branches if branch.name == name)


def element_of(graph: LinearGraph, name: str) -> Branch | TwoPort:
    elements: tuple[Branch | TwoPort, ...] = (*graph.branches, *graph.two_ports)
    return next(element for element in elements if element.name == name)


#: Number of a motor's branches, letter of its side, place of its side in the laws, number of the
#: other motor.
MOTORS = (('1', 'L', 0.0, '2'), ('2', 'R', 1.0, '1'))
#: Wheels of a side.
WHEELS = {'left': ('FL', 'RL'), 'right': ('FR', 'RR')}
_LETTER = {'left': ('L',), 'right': ('R',), 'both': ('L', 'R'), 'none': ('L', 'R')}


def axles(graph: LinearGraph, side: str) -> list[tuple[str, Branch]]:
    """Return side letter and inertia of the motors' axles on a side, or on both."""
    names = {branch.name for branch in graph.branches}
    return [(letter, branch_of(graph, name)) for letter in _LETTER[side]
            for name in (f'J_{letter}W', f'J_R{letter}') if name in names]


def shaft(graph: LinearGraph, letter: str) -> Branch:
    """Return the inertia that turns with the motor of a side."""
    motor = element_of(graph, f'T_M{letter}')
    assert isinstance(motor, TwoPort)
    return next(branch for branch in graph.branches if branch.kind is Kind.A_TYPE
                and (branch.domain, branch.tail, branch.head) == motor.port2)


def scrubbing(graph: LinearGraph) -> Branch:
    """Return the inertia that scrubs over the ground: the base, or what it is tied to there."""
    scrub = branch_of(graph, 'B_H')
    return next(branch for branch in graph.branches
                if branch.kind is Kind.A_TYPE and branch.tail == scrub.tail)


class Stage(enum.IntEnum):
    """
    When an edit is made: laws are written with the elements and values that they find.

    Those of motors and drivers come in the order in which a law hangs on others.
    """

    ELEMENTS = 0
    VALUES = 1
    WINDING = 2
    DEAD_BAND = 3
    DUTY = 4
    BATTERY = 5
    CABLES = 6
    CURRENT = 7
    LAWS = 8


@dataclass(frozen=True)
class Edit:
    """
    What an effect does to a network.

    Parameters
    ----------
    apply : callable
        Returns the network with the effect in it.
    stage : Stage

    """

    apply: Callable[[EditedNetwork, Effect], EditedNetwork]
    stage: Stage = Stage.LAWS
