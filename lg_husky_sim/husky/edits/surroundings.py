# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects outside the graph: the command's way to the voltages, and the sensors."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.husky.edits.network import Edit, EditedNetwork
from lg_husky_sim.husky.effects import Effect


def _command(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    return network.changing(command={
        p.name: p.name for p in effect.parameters() if not p.fixed})


def _slew(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    if effect.shape == 'lag':
        return replace(network, command_lag='command_lag')
    return _command(network, effect)


def _speed_loop(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    return replace(network, speed_loop=True)


def _gyro(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    return network.changing(sensors={p.name: p.name for p in effect.parameters()})


def _encoder(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    return network.changing(sensors={f'encoder_{effect.side}': 'encoder_factor'})


def _stamps(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    return network.changing(sensors={f'delay_{effect.shape}': 'stamp_delay'})


EDITS = {
    'command_latency': Edit(_command),
    'command_slew': Edit(_slew),
    'command_limit': Edit(_command),
    'speed_loop': Edit(_speed_loop),
    'gyro_bias': Edit(_gyro),
    'gyro_scale': Edit(_gyro),
    'gyro_sign': Edit(_gyro),
    'encoder_scale': Edit(_encoder),
    'sensor_time_offset': Edit(_stamps),
}
