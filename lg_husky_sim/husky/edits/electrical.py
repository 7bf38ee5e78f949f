# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects of battery, driver and motors: voltages in series with the motors' supplies."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.edits.network import (
    axles,
    Edit,
    EditedNetwork,
    LawRow,
    MOTORS,
)
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import Law

_Series = tuple[LawRow, tuple[str, ...]]


def _in_series(describe: Callable[[Effect, str, str, float, str], _Series], *shown: str) -> Edit:
    # The same law at both motors; ``shown`` are numbers that the pack's own voltage shows.
    def apply(network: EditedNetwork, effect: Effect) -> EditedNetwork:
        for number, letter, side, other in MOTORS:
            axle = dict(axles(network.graph, 'both'))[letter].name
            row, of = describe(effect, number, other, side, axle)
            network = network.with_voltage(effect.id, number, row, of)
        return network.changing(sensors={name: name for name in shown})
    return Edit(apply)


def _sag(effect: Effect, number: str, other: str, side: float, axle: str) -> _Series:
    return LawRow(Law.BUS_SAG, ('bus_resistance', 'supply_voltage')), (
        f'V(V_S{number})', f'V(V_S{other})', f'i(L_{number})', f'i(L_{other})')


def _droop(effect: Effect, number: str, other: str, side: float, axle: str) -> _Series:
    return LawRow(Law.DROOP, ('droop_rate', 'droop_floor')), (f'V(V_S{number})',)


def _current_limit(effect: Effect, number: str, other: str, side: float, axle: str) -> _Series:
    row = LawRow(Law.CURRENT_LIMIT,
                 ('current_limit', 'motor_resistance', 'torque_constant*gear_ratio'))
    return row, (f'V(V_S{number})', f'omega({axle})')


def _clip(effect: Effect, number: str, other: str, side: float, axle: str) -> _Series:
    return LawRow(Law.CLIP, ('clip_voltage',)), (f'V(V_S{number})',)


def _heating(effect: Effect, number: str, other: str, side: float, axle: str) -> _Series:
    return LawRow(Law.HEATING, ('heating_rate', 'cooling_time', side)), (f'i(L_{number})',)


def _deadband(effect: Effect, number: str, other: str, side: float, axle: str) -> _Series:
    row = {'zone': LawRow(Law.DEAD_ZONE, ('dead_voltage',)),
           'band': LawRow(Law.DEAD_BAND, ('dead_voltage', 'dead_edge')),
           'soft': LawRow(Law.SOFT_BAND, ('dead_voltage',))}[effect.shape]
    return row, (f'V(V_S{number})',)


EDITS = {
    'battery_sag': _in_series(_sag, 'bus_resistance'),
    'battery_droop': _in_series(_droop, 'droop_rate', 'droop_floor'),
    'current_limit': _in_series(_current_limit),
    'voltage_saturation': _in_series(_clip),
    'motor_heating': _in_series(_heating),
    'driver_deadband': _in_series(_deadband),
}
