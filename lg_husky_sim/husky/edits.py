# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Each effect of the catalogue as an edit of the graph, the command stage or the sensors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
import re

from lg_husky_sim.errors import ParameterError
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
    """

    law: Law
    coefficients: tuple[Coefficient, ...]


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
    grip : expression
        Factor on the limit of a tyre's force.
    """

    graph: LinearGraph
    laws: Mapping[str, LawRow] = field(default_factory=dict)
    command: Mapping[str, str] = field(default_factory=dict)
    sensors: Mapping[str, str] = field(default_factory=dict)
    speed_loop: bool = False
    grip: str = ''

    def changing(self, command: Mapping[str, str] | None = None,
                 sensors: Mapping[str, str] | None = None) -> EditedNetwork:
        """Return this network with entries of the command stage or the sensors changed."""
        return replace(self, command={**self.command, **(command or {})},
                       sensors={**self.sensors, **(sensors or {})})

    def with_values(self, values: Mapping[str, str]) -> EditedNetwork:
        """Return this network with other value expressions on branches or two-ports."""
        graph = self.graph
        for name, value in values.items():
            graph = graph.replacing(replace(_element_of(graph, name), value=value))
        return replace(self, graph=graph)

    def with_force(self, name: str, domain: Domain, node: str, ground: str, row: LawRow,
                   of: tuple[str, ...]) -> EditedNetwork:
        """Return this network with a modulated through-source pushing into a node."""
        source = Branch(name, Kind.THROUGH_SOURCE, domain, ground, node,
                        characteristic=_characteristic(row, of))
        return replace(self, graph=self.graph.with_branches(source),
                       laws={**self.laws, name: row})

    def with_voltage(self, effect: str, number: str, row: LawRow, of: tuple[str, ...]
                     ) -> EditedNetwork:
        """Return this network with a modulated across-source in series with a motor's supply."""
        winding = branch_of(self.graph, f'R_{number}')
        node = f'{winding.tail}_{effect}'
        name = f'E_{effect}_{number}'
        source = Branch(name, Kind.ACROSS_SOURCE, Domain.ELECTRICAL, node, winding.tail,
                        characteristic=_characteristic(row, of))
        graph = self.graph.replacing(replace(winding, tail=node)).with_branches(source)
        return replace(self, graph=graph, laws={**self.laws, name: row})

    def with_slip_torque(self, name: str, wheel: str, row: LawRow, *others: str
                         ) -> EditedNetwork:
        """Return this network with a modulated through-source beside a wheel's slip element."""
        slip = branch_of(self.graph, f'B_{wheel}')
        source = Branch(name, Kind.THROUGH_SOURCE, slip.domain, slip.tail, slip.head,
                        characteristic=_characteristic(row, (f'omega(B_{wheel})', *others)))
        return replace(self, graph=self.graph.with_branches(source),
                       laws={**self.laws, name: row})


def _characteristic(row: LawRow, of: tuple[str, ...]) -> Characteristic:
    texts = {f'p{i}': f'({c})' for i, c in enumerate(row.coefficients)}
    expression = re.sub(r'\bp\d+\b', lambda match: texts[match.group()],
                        EXPRESSIONS[row.law])
    arguments = {f'z{i + 1}' for i in range(len(of))}
    parameters = tuple(n for n in names_in(expression) if n not in arguments)
    return Characteristic(expression, of, parameters,
                          modulated=any(name in SIGNALS for name in parameters))


def branch_of(graph: LinearGraph, name: str) -> Branch:
    """Return the branch of that name."""
    return next(branch for branch in graph.branches if branch.name == name)


def _element_of(graph: LinearGraph, name: str) -> Branch | TwoPort:
    elements: tuple[Branch | TwoPort, ...] = (*graph.branches, *graph.two_ports)
    return next(element for element in elements if element.name == name)


#: Effects that give elements other values.
CHANGES_VALUES = frozenset({'payload', 'terrain_change', 'viscous_asymmetry',
                            'wheel_radius_mismatch'})
_MOTORS = (('1', 'L', '2'), ('2', 'R', '1'))
_WHEELS = {'left': ('FL', 'RL'), 'right': ('FR', 'RR')}
_LETTER = {'left': ('L',), 'right': ('R',), 'both': ('L', 'R'), 'none': ('L', 'R')}


def _axles(network: EditedNetwork, side: str) -> list[tuple[str, Branch]]:
    # Side letter and inertia on the motor's axle.
    names = {branch.name for branch in network.graph.branches}
    chosen = [(letter, f'J_{letter}W' if f'J_{letter}W' in names else f'J_R{letter}')
              for letter in _LETTER[side]]
    return [(letter, branch_of(network.graph, name)) for letter, name in chosen]


def _electrical(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    for number, letter, other in _MOTORS:
        axle = _axles(network, 'both')['LR'.index(letter)][1].name
        side = float('LR'.index(letter))
        voltage, current = f'V(V_S{number})', f'i(L_{number})'
        transmission = 'torque_constant*gear_ratio'
        rows: dict[str, tuple[Law, tuple[Coefficient, ...], tuple[str, ...]]] = {
            'battery_sag': (Law.BUS_SAG, ('bus_resistance', 'supply_voltage'),
                            (voltage, f'V(V_S{other})', current, f'i(L_{other})')),
            'battery_droop': (Law.DROOP, ('droop_rate', 'droop_floor'), (voltage,)),
            'current_limit': (Law.CURRENT_LIMIT,
                              ('current_limit', 'motor_resistance', transmission),
                              (voltage, f'omega({axle})')),
            'voltage_saturation': (Law.CLIP, ('clip_voltage',), (voltage,)),
            'motor_heating': (Law.HEATING, ('heating_rate', 'cooling_time', side), (current,)),
            'driver_deadband': (
                (Law.DEAD_ZONE, ('dead_voltage',), (voltage,)) if effect.shape == 'zone' else
                (Law.DEAD_BAND, ('dead_voltage', 'dead_edge'), (voltage,))),
        }
        law, coefficients, of = rows[effect.id]
        network = network.with_voltage(effect.id, number, LawRow(law, coefficients), of)
    # What the pack's own voltage shows.
    shown = {'battery_sag': ('bus_resistance',), 'battery_droop': ('droop_rate', 'droop_floor')}
    return network.changing(sensors={name: name for name in shown.get(effect.id, ())})


def _drivetrain(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    if effect.id == 'belt_compliance':
        names = {branch.name for branch in network.graph.branches}
        if 'K_BeltL' not in names:
            raise ParameterError(
                'effect belt_compliance needs the expanded drivetrain (structure.drivetrain)')
        return network
    if effect.id == 'viscous_asymmetry':
        if effect.shape == 'slip':
            # Whatever changed these tyres before, such as the ground, goes on.
            return network.with_values({
                f'B_{wheel}': f'({branch_of(network.graph, f"B_{wheel}").value})'
                              '*(1+damping_change)' for wheel in _WHEELS[effect.side]})
        letter, inertia = _axles(network, effect.side)[0]
        bearing = Branch(f'B_bearing_{letter}', Kind.D_TYPE, inertia.domain, inertia.tail,
                         inertia.head, 'extra_damping')
        return replace(network, graph=network.graph.with_branches(bearing))
    for letter, inertia in _axles(network, effect.side):
        number, side = ('1', 0.0) if letter == 'L' else ('2', 1.0)
        rate = f'omega({inertia.name})'
        rows: dict[str, tuple[Law, tuple[Coefficient, ...], tuple[str, ...]]] = {
            'coulomb_drivetrain': (Law.COULOMB, ('dry_torque', 'dry_speed', 'breakaway_share',
                                                 'breakaway_speed'), (rate,)),
            'torque_ripple': (Law.WHEEL_PHASE,
                              ('ripple_cos', 'ripple_sin', side, 'ripple_speed'), (rate,)),
            'gear_backlash': (Law.BACKLASH, ('play', 'torque_constant*gear_ratio', side),
                              (f'V(V_S{number})', rate, f'i(L_{number})')),
        }
        law, coefficients, of = rows[effect.id]
        network = network.with_force(f'T_{effect.id}_{letter}', inertia.domain, inertia.tail,
                                     inertia.head, LawRow(law, coefficients), of)
    return network


def _traction(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    if effect.id == 'traction_saturation':
        for wheel in (*_WHEELS['left'], *_WHEELS['right']):
            damping = branch_of(network.graph, f'B_{wheel}').value
            if effect.shape == 'circle':
                network = _with_circle(network, wheel, str(damping))
                continue
            row = LawRow(Law.SLIP_SATURATION,
                         (f'traction_torque{network.grip}', str(damping)))
            network = network.with_slip_torque(f'T_slip_{wheel}', wheel, row)
        return network
    numbers = range(1, 5) if effect.side == 'left' else range(5, 9)
    return network.with_values({
        f'TF_{n}': str(_element_of(network.graph, f'TF_{n}').value).replace(
            'wheel_radius', '(wheel_radius*(1+radius_change))') for n in numbers})


def _with_circle(network: EditedNetwork, wheel: str, damping: str) -> EditedNetwork:
    # Adhesion of a wheel, shared by its slip and by a quarter of the scrubbing, whose force acts
    # half a wheelbase from the middle.
    scrub, mass = f'({branch_of(network.graph, "B_H").value})/4', branch_of(network.graph, 'J_H')
    arm, limit = '(wheelbase/(2*wheel_radius))', f'traction_torque{network.grip}'
    row = LawRow(Law.FRICTION_CIRCLE, (limit, damping, f'{scrub}/{arm}'))
    network = network.with_slip_torque(f'T_slip_{wheel}', wheel, row, 'omega(J_H)')
    row = LawRow(Law.FRICTION_CIRCLE,
                 (f'{limit}*{arm}', f'-{scrub}', f'({damping})*{arm}'))
    return network.with_force(f'T_scrub_{wheel}', mass.domain, mass.tail, mass.head, row,
                              ('omega(J_H)', f'omega(B_{wheel})'))


def _ground(network: EditedNetwork, slip: str, yaw: str) -> dict[str, str]:
    # Values of what the ground does to wheels and chassis, times a factor each.
    changed = {f'B_{wheel}': f'({branch_of(network.graph, f"B_{wheel}").value})*{slip}'
               for side in _WHEELS for wheel in _WHEELS[side]}
    return changed | {'B_H': f'({branch_of(network.graph, "B_H").value})*{yaw}'}


def _chassis(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    if effect.id == 'payload':
        heavier = {'M_H': 'mass+payload_mass', 'J_H': 'yaw_inertia+payload_inertia'}
        if effect.shape == 'ground':
            weight = '(1+payload_mass/mass)'
            heavier |= _ground(network, weight, weight)
            network = replace(network, grip=f'{network.grip}*{weight}')
        return network.with_values(heavier)
    if (effect.id, effect.shape) == ('terrain_change', 'grip'):
        return replace(network, grip=f'{network.grip}*(1+grip_change)')
    if effect.id == 'terrain_change':
        slip, scrub = '(1+wheel_damping_change)', '(1+yaw_damping_change)'
        return replace(network.with_values(_ground(network, slip, scrub)),
                       grip=f'{network.grip}*{scrub}')
    forward, yaw = 'v(M_H)', 'omega(J_H)'
    rows: dict[str, tuple[Law, tuple[Coefficient, ...], tuple[str, ...]]] = {
        'slope': (Law.HEADING, ('slope_x', 'slope_y'), ()),
        'rolling_resistance': (Law.COULOMB, ('rolling_force', 'rolling_speed', 0.0, 1.0),
                               (forward,)),
        'quadratic_drag': (Law.QUADRATIC, ('drag',), (forward,)),
        'yaw_scrub_coulomb': (Law.COULOMB, ('yaw_coulomb_moment', 'yaw_coulomb_rate', 0.0, 1.0),
                              (yaw,)),
        'yaw_scrub_speed': (Law.MODULATED_DAMPING, ('scrub_slope',), (yaw, forward)),
        'yaw_pull': (Law.WHILE_MOVING, ('pull_moment', 'pull_speed'), (forward,)),
    }
    law, coefficients, of = rows[effect.id]
    name = 'M_H' if effect.kind.subsystem.value == 'translation' else 'J_H'
    mass = branch_of(network.graph, name)
    return network.with_force(f'F_{effect.id}', mass.domain, mass.tail, mass.head,
                              LawRow(law, coefficients), of)


def _command(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    if effect.id == 'speed_loop':
        return replace(network, speed_loop=True)
    return network.changing(command={
        p.name: p.name for p in effect.parameters() if not p.fixed})


def _sensor(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    if effect.id == 'encoder_scale':
        return network.changing(sensors={f'encoder_{effect.side}': 'encoder_factor'})
    if effect.id == 'sensor_time_offset':
        return network.changing(sensors={f'delay_{effect.shape}': 'stamp_delay'})
    return network.changing(sensors={p.name: p.name for p in effect.parameters()})


#: Argument of a smooth effort to the context entry that it reads; the others are variables.
_CONTEXT = {'time': 0.0, 'heading': 1.0, 'x': 2.0, 'y': 3.0, 'angle_left': 4.0,
            'angle_right': 5.0}
_KNOTS = tuple(f'knot_{i}' for i in range(1, 10))


def _table_row(argument: str) -> LawRow:
    count = float(len(_KNOTS))
    periodic = argument in ('heading', 'angle_left', 'angle_right')
    return LawRow(Law.TABLE, (_CONTEXT.get(argument, -1.0), 'range_low', 'range_high',
                              -count if periodic else count, *_KNOTS))


def _described(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    # A smooth effort of one argument, for physics without a name.
    argument = effect.shape
    variable = {'forward': ('v(M_H)',), 'yaw': ('omega(J_H)',)}
    if effect.id in ('smooth_force', 'smooth_moment'):
        mass = branch_of(network.graph, 'M_H' if effect.id == 'smooth_force' else 'J_H')
        return network.with_force(f'F_{effect.id}', mass.domain, mass.tail, mass.head,
                                  _table_row(argument), variable.get(argument, ()))
    for letter, inertia in _axles(network, effect.side):
        number, side = ('1', 'left') if letter == 'L' else ('2', 'right')
        if effect.id == 'smooth_torque':
            row = _table_row(f'angle_{side}' if argument == 'angle' else argument)
            of = (f'omega({inertia.name})',) if argument == 'wheel_rate' else ()
            network = network.with_force(f'T_{effect.id}_{letter}', inertia.domain,
                                         inertia.tail, inertia.head, row, of)
        else:
            of = (f'V(V_S{number})',) if argument == 'voltage' else ()
            network = network.with_voltage(effect.id, number, _table_row(argument), of)
    return network


_BY_SUBSYSTEM: Mapping[str, Callable[[EditedNetwork, Effect], EditedNetwork]] = {
    'electrical': _electrical, 'drivetrain': _drivetrain, 'traction': _traction,
    'translation': _chassis, 'rotation': _chassis, 'command': _command, 'sensor': _sensor,
}


def edit(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    """
    Put an effect into a network.

    Parameters
    ----------
    network : EditedNetwork
    effect : Effect

    Returns
    -------
    EditedNetwork
        With new elements, changed values, command stage or sensors.

    Raises
    ------
    ParameterError
        If the effect does not fit the network.
    """
    # The numbers of a changed effect have other names; the edit is the same.
    effect = replace(effect, again=False)
    if effect.id.startswith('smooth_'):
        return _described(network, effect)
    return _BY_SUBSYSTEM[effect.kind.subsystem.value](network, effect)
