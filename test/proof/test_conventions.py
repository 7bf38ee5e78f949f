# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How logs are made is drawn over decades, and does what it says."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.proof import conventions, robots, sensors, world
from lg_husky_sim.proof.commands import CommandPath, demanded, received, send
from lg_husky_sim.proof.conventions import Conventions, draw
from lg_husky_sim.proof.integrate import Gate, integrate, smooth_floor
from lg_husky_sim.proof.manoeuvres import Manoeuvre, script
from lg_husky_sim.proof.settings import settings
import numpy as np
from numpy.typing import NDArray
import pytest

Vector = NDArray[np.float64]


def many(tuning: bool) -> list[Conventions]:
    rng = np.random.default_rng(4)
    return [draw(rng, tuning) for _ in range(400)]


def test_tuning_sees_no_family_that_is_left_out_and_reports_see_all() -> None:
    left_out = settings()['left_out_of_tuning']
    axes = {'floor': 'colour', 'wheels': 'wheels', 'stamps': 'stamps', 'jitter': 'jitter form',
            'base': 'base'}
    for tuning in (True, False):
        drawn = many(tuning)
        for axis, name in axes.items():
            families = {how.regime[name] for how in drawn}
            assert families.isdisjoint(left_out[axis]) is tuning


def test_conventions_span_decades() -> None:
    drawn = many(tuning=False)
    for values, decades in (
            ([how.jitter for how in drawn], 1.8), ([how.gyro.noise for how in drawn], 1.2),
            ([how.wheels.tick for how in drawn], 2.0), ([how.poses.noise for how in drawn], 1.2),
            ([how.floor.force for how in drawn if how.floor.force], 2.0),
            ([how.wheels.window for how in drawn if how.wheels.kind == 'difference'], 1.2)):
        assert np.log10(max(values) / min(values)) > decades
    assert {how.link.rate for how in drawn} >= {5.0, 100.0}
    assert {how.missing for how in drawn} == {(), ('imu',), ('pose',), ('wheels',)}
    assert any(how.link.base_rate == 0.0 for how in drawn)
    assert any(0.0 < how.link.base_rate < 15.0 for how in drawn)


def test_a_sensor_that_an_effect_needs_is_never_missing() -> None:
    rng = np.random.default_rng(4)
    assert not any('imu' in draw(rng, False, frozenset({'imu'})).missing for _ in range(200))


def how_of(**changes: object) -> Conventions:
    how = draw(np.random.default_rng(1), tuning=False, needed=frozenset(conventions.STREAMS))
    wheels = replace(how.wheels, kind='difference', window=0.05, stamp=0.0, tick=1e-6, rate=50.0)
    return replace(how, jitter=0.0, missing=(), wheels=wheels, poses=replace(how.poses, gaps=0),
                   **changes)  # type: ignore[arg-type]


def moving() -> tuple[Manoeuvre, Vector]:
    drive = script('chirp', np.random.default_rng(2), 50.0, seconds=20.0)
    fields = world.nominal()
    vector = world.vector(fields)
    return drive, integrate(vector, vector, Gate(), drive.times,
                            demanded(drive.commands, CommandPath(), fields), smooth_floor(),
                            drive.duration, step=5e-4)


@pytest.mark.parametrize(('kind', 'error'), [
    ('instant', 2e-3), ('difference', 1e-3), ('lowpass', 2e-3), ('rounded', 0.04)])
def test_each_kind_of_wheel_speed_is_what_it_says(kind: str, error: float) -> None:
    _, table = moving()
    how = replace(how_of().wheels, kind=kind, window=0.05, noise=1e-4,
                  step=0.01 if kind == 'rounded' else 0.0)
    times = np.arange(1.0, 18.0, 0.02)
    angle, rate = table[:, 9], np.gradient(table[:, 9], table[:, 0])
    counted, speed = sensors.wheel_speeds(table, angle, how, times, 0.165,
                                          np.random.default_rng(1))
    expected = np.interp(times, table[:, 0], rate)
    if kind == 'difference':
        expected = (np.interp(times, table[:, 0], angle)
                    - np.interp(times - 0.05, table[:, 0], angle)) / 0.05
    elif kind == 'lowpass':
        smooth = np.zeros(rate.size)
        for k in range(1, rate.size):
            smooth[k] = smooth[k - 1] + (rate[k] - smooth[k - 1]) * 0.001 / 0.0505
        expected = np.interp(times, table[:, 0], smooth)
    assert np.abs(speed - expected).max() < error
    assert counted == pytest.approx(np.interp(times, table[:, 0], angle), abs=2e-6)
    if kind == 'rounded':
        steps = speed * 0.165 / 0.01
        assert steps == pytest.approx(np.round(steps), abs=1e-9)


@pytest.mark.parametrize(('stamp', 'early'), [(0.0, 0.0), (0.5, 0.025), (1.0, 0.05)])
def test_a_stamp_may_be_the_window_s_start_middle_or_end(stamp: float, early: float) -> None:
    drive, table = moving()
    how = how_of()
    how = replace(how, wheels=replace(how.wheels, stamp=stamp))
    sent = send(drive, how.link, 0.0, None)
    bag = sensors.publish(table, sent, how, sensors.Faults(), 0.0, 0.165,
                          np.random.default_rng(1))
    when = bag.joints[:, 0] + early
    assert bag.joints[:, 1] == pytest.approx(np.interp(when, table[:, 0], table[:, 9]), abs=1e-5)


def test_a_base_with_its_own_clock_takes_the_newest_command_at_its_tick() -> None:
    drive = script('steps', np.random.default_rng(2), 50.0, seconds=20.0)
    link = replace(how_of().link, base_rate=10.0, base_phase=0.3, delay=0.002, lost_robot=0.0,
                   late=0.0)
    arrive, _ = received(send(drive, link, 0.0, None), CommandPath(), link, drive.duration)
    turns = arrive * 10.0 - 0.3
    assert turns == pytest.approx(np.round(turns), abs=1e-6)
    waited = arrive - (drive.times + 0.002)
    assert waited.min() >= -1e-9
    assert waited.max() <= 0.1 + 1e-9


def test_what_is_lost_to_one_is_not_lost_to_the_other() -> None:
    drive = script('mix', np.random.default_rng(2), 50.0, seconds=60.0)
    link = replace(how_of().link, lost_robot=0.05, lost_recorder=0.05)
    sent = send(drive, link, 0.001, np.random.default_rng(1))
    for kept in (sent.heard, sent.logged):
        assert 0.01 < 1.0 - kept.mean() < 0.12
    assert np.any(sent.heard & ~sent.logged)
    assert np.any(~sent.heard & sent.logged)


def test_a_recording_may_begin_in_motion() -> None:
    drive, table = moving()
    how = how_of()
    bag = sensors.publish(table, send(drive, how.link, 0.0, None), how, sensors.Faults(), 6.0,
                          0.165, np.random.default_rng(1))
    assert 0.0 <= bag.joints[0, 0] < 0.05
    assert bag.commands[0, 0] >= 0.0
    assert np.abs(bag.joints[:10, 5:]).max() > 0.2


def test_every_colour_of_roughness_has_its_size_and_memory() -> None:
    rng = np.random.default_rng(3)
    kind = replace(how_of().floor, force=2.0, colour='coloured', time=0.5)
    coloured = robots.floor(kind, 400.0, rng).rough[:, 2]
    assert coloured.std() == pytest.approx(2.0, rel=0.2)
    assert np.corrcoef(coloured[:-100], coloured[100:])[0, 1] == pytest.approx(
        np.exp(-1.0), abs=0.15)
    white = robots.floor(replace(kind, colour='white'), 400.0, rng).rough[:, 2]
    assert abs(np.corrcoef(white[:-1], white[1:])[0, 1]) < 0.02
    place = robots.floor(replace(kind, colour='place'), 400.0, rng)
    assert place.rough.shape == (1, 5)
    assert place.waves.shape[0] > 3
    assert robots.floor(replace(kind, force=0.0), 9.0, rng).waves.shape[0] == 0
