# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects of battery, driver and motors: voltages in series with the motors' supplies.

They act one behind the other, whatever the order in which a model names them. A driver makes a
duty cycle of the voltage that it is asked for: nothing below the dead band, and no more than a
largest one. It chops the bus, whose voltage falls with time and with what both bridges draw. A
limit of the current then takes back what would drive more through the winding as warm as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.husky.edits.network import (
    Edit,
    EditedNetwork,
    LawRow,
    MOTORS,
    shaft,
    Stage,
)
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import Law, PLACES

_Series = tuple[LawRow, tuple[str, ...]]


def _in_series(stage: Stage, describe: Callable[[Effect, str, str, float, str], _Series],
               *shown: str) -> Edit:
    # The same law at both motors; ``shown`` are numbers that the pack's own voltage shows.
    def apply(network: EditedNetwork, effect: Effect) -> EditedNetwork:
        for number, letter, side, other in MOTORS:
            row, of = describe(effect, number, other, side, shaft(network.graph, letter).name)
            row = replace(row, motor=int(number))
            of, meant = _behind_others(network, row, of)
            network = network.with_voltage(effect.id, number, row, of, meant)
        return network.changing(sensors={name: name for name in shown})
    return Edit(apply, stage)


def _behind_others(network: EditedNetwork, row: LawRow, of: tuple[str, ...]
                   ) -> tuple[tuple[str, ...], dict[str, str]]:
    # Arguments of a driver's law, and what it takes for each: a supply's voltage with what the
    # laws before add to it; the rate whose back-EMF is that and the heat's, for a limit.
    names, meant = list(of), {}

    def with_sources(argument: int, motor: int, factor: str, before: Callable[[LawRow], bool]
                     ) -> None:
        text = f'z{argument + 1}'
        for name, other in network.laws.items():
            if other.motor == motor and before(other):
                names.append(f'V({name})')
                text += f'{factor.format(f"z{len(names)}")}'
        if text != f'z{argument + 1}':
            meant[f'z{argument + 1}'] = f'({text})'

    for argument, name in enumerate(of):
        if name.startswith('V(V_S'):
            with_sources(argument, int(name[-2]), '+{}',
                         lambda other: PLACES[other.law] < PLACES[row.law])
    if row.law in (Law.CURRENT_LIMIT, Law.SOFT_CURRENT_LIMIT):
        with_sources(1, row.motor, '-{}/p2', lambda other: other.law is Law.HEATING)
    return tuple(names), meant


def _sag(effect: Effect, number: str, other: str, side: float, rotor: str) -> _Series:
    return LawRow(Law.BUS_SAG, ('bus_resistance', 'supply_voltage')), (
        f'V(V_S{number})', f'V(V_S{other})', f'i(L_{number})', f'i(L_{other})')


def _droop(effect: Effect, number: str, other: str, side: float, rotor: str) -> _Series:
    return LawRow(Law.DROOP, ('droop_rate', 'droop_floor')), (f'V(V_S{number})',)


def _current_limit(effect: Effect, number: str, other: str, side: float, rotor: str) -> _Series:
    law = Law.CURRENT_LIMIT if effect.shape == 'hard' else Law.SOFT_CURRENT_LIMIT
    row = LawRow(law, ('current_limit', 'motor_resistance', 'torque_constant*gear_ratio'))
    return row, (f'V(V_S{number})', f'omega({rotor})')


def _clip(effect: Effect, number: str, other: str, side: float, rotor: str) -> _Series:
    law = Law.CLIP if effect.shape == 'hard' else Law.SOFT_CLIP
    return LawRow(law, ('clip_voltage',)), (f'V(V_S{number})',)


def _heating(effect: Effect, number: str, other: str, side: float, rotor: str) -> _Series:
    return LawRow(Law.HEATING, ('heating_rate', 'cooling_time', side)), (f'i(L_{number})',)


def _deadband(effect: Effect, number: str, other: str, side: float, rotor: str) -> _Series:
    row = {'zone': LawRow(Law.DEAD_ZONE, ('dead_voltage',)),
           'band': LawRow(Law.DEAD_BAND, ('dead_voltage', 'dead_edge')),
           'soft': LawRow(Law.SOFT_BAND, ('dead_voltage',))}[effect.shape]
    return row, (f'V(V_S{number})',)


EDITS = {
    'battery_sag': _in_series(Stage.CABLES, _sag, 'bus_resistance'),
    'battery_droop': _in_series(Stage.BATTERY, _droop, 'droop_rate', 'droop_floor'),
    'current_limit': _in_series(Stage.CURRENT, _current_limit),
    'voltage_saturation': _in_series(Stage.DUTY, _clip),
    'motor_heating': _in_series(Stage.WINDING, _heating),
    'driver_deadband': _in_series(Stage.DEAD_BAND, _deadband),
}
