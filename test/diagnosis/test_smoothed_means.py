# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Wheel rates that are means and low-passed, too: by an encoder's computer or by what sends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive, drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess, Noise
from lg_husky_sim.diagnosis.evidence.observation import observe, simulate
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading, wheel_lag, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.diagnosis.log_notes import reading_notes
from lg_husky_sim.diagnosis.selection.conventions import best_reading
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp

#: A robot within the tolerances, over the model.
OFF = {'mass': 1.05, 'yaw_inertia': 0.95, 'wheel_damping': 0.93, 'yaw_damping': 1.08,
       'command_gain': 0.97, 'motor_resistance': 1.02}


def angles_of(drive: Drive) -> tuple[FloatArray, FloatArray]:
    """Return times and what a left and a right wheel have turned by, finely, from the model."""
    model, fine = load_model(), np.arange(drive.start - 0.3, drive.end, 0.0005)
    plant = compile_model(model.structure).at(model.parameters)
    dense = replace(drive, wheel_times=fine, imu_times=fine[:0], pose_times=fine[:0],
                    measured=np.zeros(2 * fine.size), times=np.tile(fine, 2), counted=True,
                    channels=np.repeat([int(Channel.ANGLE_LEFT), int(Channel.ANGLE_RIGHT)],
                                       fine.size))
    seen = observe(simulate(plant, dense, Reading()), dense, Reading())
    return fine, seen.reshape(2, -1)


@pytest.fixture(scope='module')
def driven(drive: Callable[..., Recording]) -> Drive:
    """Return one drive of a robot that lacks nothing."""
    return drives_of([drive('ahead', 'nothing', 1)])[0]


@pytest.mark.parametrize(('lag', 'mean'), [(0.01, 0.03), (0.05, 0.08)])
def test_a_mean_behind_a_low_pass_is_that_of_an_integrator(driven: Drive, lag: float,
                                                           mean: float) -> None:
    """It agrees within a hundredth of what a Husky rounds to."""
    model, (fine, (left, _)) = load_model(), angles_of(driven)
    rate = (np.interp(fine, fine, left) - np.interp(fine - mean, fine, left)) / mean
    solved = solve_ivp(lambda t, y: (np.interp(t, fine, rate) - y) / lag,
                       (float(fine[0]), float(fine[-1])), [rate[0]], method='RK45',
                       max_step=0.002, rtol=1e-8, atol=1e-10, dense_output=True)
    reading = Reading(WheelReading.FILTERED, values={'wheel_window': lag, 'wheel_mean': mean})
    plant = compile_model(model.structure).at(model.parameters)
    seen = observe(simulate(plant, driven, reading), driven, reading)
    own = seen[driven.slice_of(Channel.WHEEL_LEFT)]
    inside = driven.wheel_times < fine[-1]
    assert np.ptp(own[inside]) > 1.0
    error = own[inside] - solved.sol(driven.wheel_times[inside])[0]
    assert np.max(np.abs(error)) < 0.01 * 0.01 / model.parameters['wheel_radius']


@pytest.mark.parametrize('reading', [
    Reading(WheelReading.FILTERED, values={'wheel_window': 0.02, 'wheel_mean': 0.06}),
    Reading(WheelReading.WINDOW_END, values={'wheel_window': 0.04, 'wheel_smoothing': 0.05})])
def test_the_lag_of_a_reading_is_that_of_the_mean_age_of_what_it_says(
        driven: Drive, reading: Reading) -> None:
    """The rates that it gives add up to an angle that is behind by it."""
    model, (fine, (left, _)) = load_model(), angles_of(driven)
    plant = compile_model(model.structure).at(model.parameters)
    even = np.arange(driven.start, driven.end, 0.02)
    slow = replace(driven, wheel_times=even, imu_times=even[:0], pose_times=even[:0],
                   measured=np.zeros(2 * even.size), times=np.tile(even, 2), channels=np.repeat(
                       [int(Channel.WHEEL_LEFT), int(Channel.WHEEL_RIGHT)], even.size))
    rates = observe(simulate(plant, slow, reading), slow, reading)[:even.size]
    turned = cumulative_trapezoid(rates, even, initial=0.0)
    lag = wheel_lag(reading, 0.02)
    behind = np.interp(even - lag, fine, left)
    assert np.ptp(turned) > 2.0
    offset = turned - behind - (turned[0] - behind[0])
    assert np.std(offset) < 0.1 * np.std(turned - np.interp(even, fine, left))


def test_a_filter_of_messages_is_found_behind_their_means(
        drive: Callable[..., Recording]) -> None:
    """As a driver that smooths what it sends; an elastic belt was named for it."""
    mean, share, whole, model = 0.034, 0.2, drive('ahead', 'nothing', 1), load_model()
    own, random = drives_of([whole])[0], np.random.default_rng(2)
    fine, angles = angles_of(own)
    times, rates = np.arange(own.start, own.end, mean), []
    for side in angles:
        sent = (np.interp(times, fine, side) - np.interp(times - mean, fine, side)) / mean
        sent += 0.002 * random.standard_normal(sent.size)
        for k in range(1, sent.size):
            sent[k] = share * sent[k - 1] + (1.0 - share) * sent[k]
        rates.append(sent)
    drives = drives_of([replace(whole, streams={
        **{name: whole.streams[name] for name in ('command', 'imu')},
        'wheels': TimeSeries(times, np.column_stack(rates), ('left', 'right'))})])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, [whole.name], start, first_guess(drives), pool)
        found = best_reading(evidence, evidence.fit(start)).point.log
    assert found.wheels in (WheelReading.WINDOW_END, WheelReading.WINDOW_MIDDLE)
    assert found.get('wheel_smoothing') == pytest.approx(-mean / np.log(share), rel=0.1)
    assert found.get('wheel_window') == pytest.approx(mean, rel=0.1)
    assert 'behind a first-order filter of the messages of 2' in reading_notes(drives, found)[0]


def test_exact_rates_behind_a_low_pass_are_found_as_well_as_from_there(driven: Drive) -> None:
    """Without noise, a model that lacks friction is off by many deviations."""
    lag, model, dry = 0.024, load_model(), Effect('coulomb_drivetrain', 'left')
    made = Reading(WheelReading.FILTERED, values={'wheel_window': lag})
    even = np.arange(driven.start, driven.end, 0.016)
    exact = replace(driven, wheel_times=even, imu_times=even[:0], pose_times=even[:0],
                    measured=np.zeros(2 * even.size), times=np.tile(even, 2), channels=np.repeat(
                        [int(Channel.WHEEL_LEFT), int(Channel.WHEEL_RIGHT)], even.size))
    plant = compile_model(model.structure.with_effect(dry)).at(
        model.parameters.with_entries(*entries_of(dry, {'dry_torque': 3.2})).replacing({
            name: share * model.parameters[name] for name, share in OFF.items()}))
    exact = replace(exact, measured=observe(simulate(plant, exact, made), exact, made))
    start = beginning(model.structure, base_unknowns(model.parameters, [exact]),
                      model.parameters, Reading())
    with Threads(1) as pool:
        first = evidence_of([exact], ['one'], start, Noise({
            **first_guess([exact]).values, 'wheel': 5e-6, 'wheel_jitter': 3e-5}), pool)
        found = best_reading(first, first.fit(start, rounds=1), afresh=True)
        there = first.fit(replace(start, reading=made), rounds=20)
    assert found.point.log.wheels is WheelReading.FILTERED
    assert found.point.log.get('wheel_window') == pytest.approx(lag, rel=0.1)
    # After a few steps, of costs beyond 100,000 nats where it began.
    assert found.cost < there.cost + 30.0
