# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What several channels see of one motion is taken off before they are weighed."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.identification.noise import metric
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.identification.relations import apart, averaging, coefficients, links
from lg_husky_sim.recording import Segment
import numpy as np
import pytest


@pytest.fixture(scope='module')
def data(circle: Segment) -> Observations:
    """Return one drive with all channels."""
    return observations([circle])


def motion_error(data: Observations, seed: int = 3) -> np.ndarray:
    """Return a slow error of the yaw rate in every channel that sees it, with small noise."""
    values = np.zeros(data.measured.size)
    draws = np.random.default_rng(seed)
    for one in data.slices:
        part = slice(one.first, one.last)
        size = {'yaw_rate': 0.2, 'turn': 0.2, 'wheel_left': -0.35, 'wheel_right': 0.35}.get(
            one.channel, 0.0)
        values[part] = size * np.sin(0.8 * data.times[part]) + draws.normal(
            0.0, 0.005, one.last - one.first)
    return values


def test_weights_average_the_samples_of_an_interval() -> None:
    times = np.arange(0.0, 1.0, 0.1)
    row, column, weight = averaging(times, np.array([0.15, 0.43]), np.array([0.55, 0.43]))
    table = np.zeros((2, times.size))
    np.add.at(table, (row.astype(int), column.astype(int)), weight)
    assert table.sum(axis=1) == pytest.approx([1.0, 1.0])
    assert table[0] == pytest.approx([0, 0, 0.25, 0.25, 0.25, 0.25, 0, 0, 0, 0])
    # Between two samples: linearly.
    assert table[1, 4:6] == pytest.approx([0.7, 0.3])


def test_an_error_of_the_motion_leaves_the_relation_between_its_sensors(
        data: Observations) -> None:
    error = motion_error(data)
    parts = coefficients(data, error, np.full(error.size, 100.0))
    left = apart(data, parts, error)
    turn, gyro = data.channel_mask('turn'), data.channel_mask('yaw_rate')
    assert np.std(left[turn]) < 0.15 * np.std(error[turn])
    assert np.std(left[gyro]) < 0.15 * np.std(error[gyro])
    wheels = data.channel_mask('wheel_left')
    assert np.array_equal(left[wheels], error[wheels])


def test_channels_without_a_common_error_are_left_alone(data: Observations) -> None:
    noise = np.random.default_rng(5).normal(0.0, 0.02, data.measured.size)
    parts = coefficients(data, noise, np.full(noise.size, 50.0))
    left = apart(data, parts, noise)
    assert np.std(left - noise) < 0.2 * np.std(noise)


def test_a_gyro_fault_stands_out_of_a_wrongly_predicted_motion(data: Observations) -> None:
    error = motion_error(data)
    scale = np.full(error.size, 100.0)
    fault = np.where(data.channel_mask('yaw_rate'), 0.02 * np.sin(0.8 * data.times), 0.0)
    plain, related = (metric(data, error, scale, related=r) for r in (False, True))
    seen = [float(np.sum(m.whiten(data, fault) ** 2)) for m in (plain, related)]
    assert seen[1] > 1.5 * seen[0]


def test_links_join_channels_of_one_segment_only(
        make_drive: Callable[..., Segment]) -> None:
    two = observations([make_drive(recording='a'), make_drive(seed=2, recording='b')])
    owner = np.zeros(two.measured.size, dtype=int)
    for one in two.slices:
        owner[one.first:one.last] = one.segment
    assert len(links(two)) == 4
    for link in links(two):
        row, column = link.operator.nonzero()
        assert np.array_equal(owner[row], owner[column])
