# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fits of one likelihood: they find the numbers, and their intervals cover."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.conclusion import estimates
from lg_husky_sim.diagnosis.evidence.bounded_step import step_inside
from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive, drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess, Noise, sensor_variance
from lg_husky_sim.diagnosis.evidence.observation import APART, observe, simulate
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of, hypotheses, Hypothesis
from lg_husky_sim.diagnosis.selection.rounds import attempt, calibrated, forward_step, with_jitter
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest
from scipy.optimize import lsq_linear

ROBOT = {'wheel_damping': 1.3, 'yaw_damping': 14.0}
COUNT = 12


def test_a_fit_finds_the_numbers_and_its_intervals_cover(drive: Callable[..., Recording]
                                                         ) -> None:
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence, fit = calibrated(
            evidence_of(drives, ['ahead'], start, first_guess(drives), pool), start, 1)
        found = {e.name: e for e in estimates(fit, list(ROBOT), model.parameters)}
        for name, value in ROBOT.items():
            assert found[name].value == pytest.approx(value, rel=0.1), name
            assert found[name].low < found[name].value < found[name].high
        # Drives of a robot whose numbers are known: those of the fit.
        truth = fit.point.values
        level = np.sqrt(sensor_variance(evidence.whiteners[0].frame, evidence.noise))
        rng = np.random.default_rng(7)
        hits = []
        for _ in range(COUNT):
            made = replace(drives[0], measured=fit.predicted[0]
                           + level * rng.standard_normal(level.size))
            again = Evidence([made], evidence.names, evidence.noise, evidence.whiteners,
                             pool).fit(fit.point, fit.slopes, rounds=3)
            hits += [e.low <= truth[e.name] <= e.high
                     for e in estimates(again, list(ROBOT), model.parameters)]
    assert np.mean(hits) >= 0.85


@pytest.mark.parametrize(('shape', 'sizes'), [
    ('firm', {'radius_change': -0.03}), ('soft', {'radius_change': -0.03, 'tyre_drag': 8.0}),
    ('firm_contact', {'radius_change': 0.05})])
def test_an_effect_gets_the_form_that_does_best(
        shape: str, sizes: dict[str, float], record: Callable[..., Recording],
        steps: Sequence[tuple[float, float, float]]) -> None:
    """A smaller wheel is one; a soft tyre, which rolls harder too, and a larger one are others."""
    model, effect = load_model(), Effect('wheel_radius_mismatch', 'left', shape)
    plant = compile_model(model.structure.with_effect(effect)).at(
        model.parameters.with_entries(*entries_of(effect, sizes)))
    drives = drives_of([record('ahead', plant, steps, 5)])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    pool = [h for h in hypotheses(model.structure)
            if h.effect.id in ('wheel_radius_mismatch', 'rolling_resistance', 'yaw_pull')]
    with Threads(1) as threads:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), threads)
        evidence, base = calibrated(evidence, start, 1)
        best = forward_step(evidence, base, pool, start).tried[0]
    assert best.hypothesis.effect == effect
    for name, value in sizes.items():
        assert best.fit.point.values[name] == pytest.approx(value, rel=0.25), name


def test_derivatives_are_those_of_one_number_after_the_other(
        drive: Callable[..., Recording]) -> None:
    """Numbers that move readings of different sensors share a simulation."""
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    assert {name for row in APART for name in row} - {'imu_window'} <= {
        u.name for u in start.unknowns}
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        predicted = evidence.predict(start)
        which = list(range(len(start.unknowns)))[::-1]
        found = evidence.derivatives(start, predicted, which)[0]
        for column, k in enumerate(which):
            moved = np.array(start.places)
            moved[k] += start.unknowns[k].step
            expected = (evidence.predict(start.at(moved))[0] - predicted[0]
                        ) / start.unknowns[k].step
            assert np.any(expected), start.unknowns[k].name
            if start.unknowns[k].name == 'command_delay':
                # To the error of a finite difference.
                assert np.corrcoef(found[:, column], expected)[0, 1] > 0.98
                continue
            np.testing.assert_array_equal(found[:, column], expected,
                                          start.unknowns[k].name)


@pytest.mark.parametrize('kind', [OnsetKind.PLACE_ABOVE, OnsetKind.TIME])
def test_the_delay_of_a_pose_that_tells_of_a_place_moves_the_readings_of_all_sensors(
        kind: OnsetKind, drive: Callable[..., Recording]) -> None:
    drives = drives_of([drive('ahead', 'nothing', 1)])
    (own,), model = drives, load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    x = own.measured[own.slice_of(Channel.X)]
    onset = Onset(OnsetKind.TIME, own.start + 6.3, 'ahead') if kind is OnsetKind.TIME else Onset(
        kind, float(x[0] + 0.6 * (np.max(x) - x[0])))
    sizes = {'pull_moment': 6.0}
    point = Hypothesis(Effect('yaw_pull'), (sizes,)).at(onset).point(start, sizes)
    which = [k for k, u in enumerate(point.unknowns) if u.name in (
        'delay_wheels', 'delay_imu', 'delay_pose')]
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        predicted = evidence.predict(point)
        found = evidence.derivatives(point, predicted, which)[0]
        for column, k in enumerate(which):
            moved = np.array(point.places)
            moved[k] += point.unknowns[k].step
            expected = (evidence.predict(point.at(moved))[0] - predicted[0]
                        ) / point.unknowns[k].step
            # To the error of a simulation of which other times are asked.
            np.testing.assert_allclose(found[:, column], expected, rtol=0.0, atol=1e-5,
                                       err_msg=point.unknowns[k].name)
            beside = expected[own.slice_of(Channel.YAW_RATE)]
            if point.unknowns[k].name == 'delay_pose':
                assert np.any(beside) == (kind is not OnsetKind.TIME)


@pytest.mark.parametrize(('effect', 'number', 'delay', 'stream'), [
    (Effect('command_latency'), 'latency', 'command_delay', 'command'),
    (Effect('sensor_time_offset', 'none', 'imu'), 'stamp_delay', 'delay_imu', 'imu'),
    (Effect('sensor_time_offset', 'none', 'pose'), 'stamp_delay', 'delay_pose', 'pose')])
def test_an_effect_that_is_a_delay_takes_all_of_it(
        effect: Effect, number: str, delay: str, stream: str, drive: Callable[..., Recording]
        ) -> None:
    """Whoever had it first, and though jitter leaves room for it in how the log was made."""
    recording, model = drive('ahead', 'nothing', 1), load_model()
    logged, later = recording.stream(stream), -0.03 if stream == 'command' else 0.03
    drives = drives_of([replace(recording, streams={
        **recording.streams, stream: replace(logged, times=logged.times + later)})])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        evidence, fit = calibrated(evidence, start, 1)
        evidence = Evidence(drives, evidence.names, Noise({
            **evidence.noise.values, f'{stream}_jitter': 0.006}), evidence.whiteners, pool)
        loose = with_jitter(fit.point, evidence)
        sizes = {number: 0.02}
        with_it = with_jitter(Hypothesis(effect, (sizes,)).point(loose, sizes), evidence)
        names = [u.name for u in with_it.unknowns]
        own, log = names.index(number), names.index(delay)
        assert with_it.unknowns[log].deviation < loose.unknowns[log].deviation
        column = evidence.derivatives(with_it, evidence.predict(with_it), [own, log])[0]
        slope = sizes[number] if with_it.unknowns[own].logarithmic else 1.0
        np.testing.assert_array_equal(column[:, 0], slope * column[:, 1])
        # The log has as much of it as it may.
        places = np.array(with_it.places)
        places[log] = with_it.unknowns[log].upper
        again = evidence.fit(with_it.at(places)).point
        # A first look takes only its own derivatives anew, and those that must go with them.
        distorted = np.array(loose.places)
        distorted[log] = loose.unknowns[log].upper
        base = evidence.fit(loose.at(distorted), rounds=1)
        tried = attempt(evidence, base, Hypothesis(effect, (sizes,)), [(base.point, sizes)],
                        whole=False)
    assert tried is not None
    assert tried.gain > 0.0
    assert tried.fit.point.values[number] == pytest.approx(0.03, abs=0.012)
    unknown = again.unknowns[log]
    assert again.places[log] == pytest.approx(unknown.centre, abs=0.5 * unknown.deviation)
    assert again.values[number] == pytest.approx(0.03, abs=0.006)


def test_only_the_sum_of_what_commands_and_readings_are_late_counts(
        drive: Callable[..., Recording]) -> None:
    """Also where derivatives are not exact: a fit that begins elsewhere ends at the priors."""
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    names = [u.name for u in start.unknowns]
    readings = [names.index(name) for name in APART[0]]
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        evidence, fit = calibrated(evidence, start, 1)
        column = evidence.derivatives(start, evidence.predict(start), [
            names.index('command_delay'), *readings])[0]
        np.testing.assert_array_equal(column[:, 0], np.sum(column[:, 1:], axis=1))
        off = np.array(fit.point.places)
        off[names.index('command_delay')] += 0.006
        off[readings] -= 0.006
        again = evidence.fit(fit.point.at(off), rounds=3)
    assert again.cost == pytest.approx(fit.cost, abs=0.5)
    np.testing.assert_allclose(again.point.places[readings], fit.point.places[readings],
                               atol=0.0005)


def test_a_window_before_the_drive_reads_the_rate_of_its_beginning(
        drive: Callable[..., Recording]) -> None:
    """And not that nothing turned in it."""
    recording = drive('ahead', 'nothing', 1)
    begun = recording.streams['command'].times[0] + 4.0
    moving = Recording('late', 'late', {name: series.slice(begun, np.inf) for name, series
                                        in recording.streams.items()},
                       0, frames=('odom', 'base_link'))
    (one,) = drives_of([moving])
    assert not one.still
    assert one.wheel_rates is not None
    plant = compile_model(load_model().structure).at(load_model().parameters)
    for reading in WheelReading:
        log = Reading(wheels=reading, values={'delay_wheels': 0.05, 'wheel_window': 0.002})
        seen = observe(simulate(plant, one, log), one, log)
        for channel, rate in zip((Channel.WHEEL_LEFT, Channel.WHEEL_RIGHT), one.wheel_rates,
                                 strict=True):
            assert seen[one.slice_of(channel)][0] == pytest.approx(rate, rel=0.1)


def test_a_motion_is_simulated_once_for_the_same_numbers(drive: Callable[..., Recording]) -> None:
    """Until it is forgotten: memory is bounded."""
    (one,) = drives_of([drive('ahead', 'nothing', 1)])
    plant = compile_model(load_model().structure).at(load_model().parameters)
    first = simulate(plant, one, Reading())
    again = compile_model(load_model().structure).at(load_model().parameters)
    assert again is not plant
    assert simulate(again, one, Reading(values={'gyro_offset': 0.1})).rows is first.rows
    other = plant.sets[0].b * 1.01
    pushed = replace(plant, sets=(replace(plant.sets[0], b=other),))
    assert np.any(simulate(pushed, one, Reading()).rows != first.rows)
    count = int(setting('motions_kept') * 1e6 / first.rows.nbytes)
    for turn in range(count + 1):
        simulate(plant, one, Reading(values={'delay_imu': 1e-4 * (turn + 1)}))
    assert simulate(plant, one, Reading()).rows is not first.rows


def test_a_step_stays_inside_the_bounds_and_makes_the_best_of_them() -> None:
    """As a bounded linear least squares problem of scipy's does."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        rows, target = rng.standard_normal((60, 8)), rng.standard_normal(60)
        free = lsq_linear(rows, target).x
        reach = np.full(8, 10.0)
        # One that is at its bound, one that the step would take beyond it.
        reach[2], reach[5] = 0.0, 0.4 * abs(free[5])
        move = step_inside(rows.T @ rows, rows.T @ target, -reach, reach)
        expected = lsq_linear(rows, target, (-reach - 1e-12, reach + 1e-12), tol=1e-12).x
        np.testing.assert_allclose(move, expected, atol=1e-5)
        assert np.all(np.abs(move) <= reach)


@pytest.mark.parametrize(('effect', 'sizes'), [
    (Effect('command_slew', shape='lag'), {'command_lag': 0.3}),
    (Effect('command_slew', shape='both'), {'slew_forward': 0.8, 'slew_yaw': 1.0}),
    (Effect('command_latency'), {'latency': 0.15})])
def test_a_drive_that_begins_in_motion_follows_the_commands_before_it(
        effect: Effect, sizes: dict[str, float], record: Callable[..., Recording],
        steps: Sequence[tuple[float, float, float]]) -> None:
    """A base that smooths commands still follows the step before the gap in a stream."""
    model = load_model()
    plant = compile_model(model.structure.with_effect(effect)).at(
        model.parameters.with_entries(*entries_of(effect, sizes)))
    recording = record('gap', plant, steps, 5)
    first = 5.12 + recording.streams['command'].times[0]
    late = Recording('late', 'late', {
        name: series if name == 'command' else series.slice(first, np.inf)
        for name, series in recording.streams.items()}, 0, frames=('odom', 'base_link'))
    (drive,) = drives_of([late])
    assert drive.earlier is not None
    assert drive.earlier.times[-1] < drive.start

    def off(one: Drive) -> float:
        seen = observe(simulate(plant, one, Reading()), one, Reading())
        begin = one.channels == int(Channel.WHEEL_LEFT)
        begin &= (one.times > one.start + 0.1) & (one.times < one.start + 0.6)
        return float(np.sqrt(np.mean((one.measured - seen)[begin] ** 2)))
    assert off(drive) < 0.06
    assert off(replace(drive, earlier=None)) > 3.0 * off(drive)


def test_commands_may_act_later_in_one_recording_than_in_another(
        drive: Callable[..., Recording]) -> None:
    """By the phases of the processes on their way; of one recording alone it is no question."""
    first, second = drive('first', 'nothing', 1), drive('second', 'nothing', 2, True)
    commands = second.streams['command']
    early = replace(second, streams={**second.streams, 'command': TimeSeries(
        commands.times - 0.001, commands.values, commands.names)})
    drives, model = drives_of([first, early]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['first', 'second'], start, first_guess(drives), pool)
        _, fit = calibrated(evidence, start, 1)
    lags = [fit.point.log.get(one.own_lag) for one in drives]
    assert lags[1] - lags[0] == pytest.approx(0.001, abs=0.0004)
    assert not {one.own_lag for one in drives[:1]} & {
        u.name for u in base_unknowns(model.parameters, drives[:1])}
