# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What sensors read of a motion, and when a stamp is off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math

from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive, drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.observation import observe, simulate
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns, loosened, Unknown
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.log_notes import reading_notes
from lg_husky_sim.diagnosis.selection import conventions
from lg_husky_sim.diagnosis.selection.conventions import best_reading
from lg_husky_sim.diagnosis.selection.nominal import is_distorted, nominal_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.recording.wheels import rates_from_angles
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
from numpy.typing import NDArray
import pytest
from scipy.integrate import solve_ivp


@pytest.fixture(scope='module')
def driven(drive: Callable[..., Recording]) -> Drive:
    """Return one drive of a robot that lacks nothing."""
    return drives_of([drive('ahead', 'nothing', 1)])[0]


def places_read(drive: Drive, **values: float) -> NDArray[np.complex128]:
    """Return what a pose would have read of a model, as complex numbers x + iy [m]."""
    model = load_model()
    reading = Reading(values=values)
    seen = observe(simulate(compile_model(model.structure).at(model.parameters), drive, reading),
                   drive, reading)
    return np.asarray(seen[drive.slice_of(Channel.X)] + 1j * seen[drive.slice_of(Channel.Y)])


def test_a_turned_frame_turns_the_way_and_a_lever_swings_with_the_heading(driven: Drive) -> None:
    plain = places_read(driven)
    start = driven.pose.x + 1j * driven.pose.y
    assert np.ptp(np.abs(plain)) > 1.0
    np.testing.assert_allclose(places_read(driven, pose_turn=0.3) - start,
                               (plain - start) * np.exp(-0.3j), atol=1e-12)
    swung = np.exp(1j * driven.heading) - np.exp(1j * driven.heading[0])
    assert np.max(np.abs(swung)) > 0.5
    np.testing.assert_allclose(places_read(driven, pose_lever=0.2) - plain, 0.2 * swung,
                               atol=1e-12)


@pytest.mark.parametrize('lag', [0.008, 0.025, 0.075])
def test_a_low_pass_follows_the_rate_of_a_wheel(driven: Drive, lag: float) -> None:
    """An integrator of high order agrees within a hundredth of what a Husky rounds to."""
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    at_once = Reading(values={'wheel_window': setting('shortest_window')})
    fine = 0.0005
    times = np.arange(driven.start, driven.start + 6.0, fine)
    dense = replace(driven, wheel_times=times, measured=np.zeros(2 * times.size),
                    times=np.tile(times, 2), channels=np.repeat(
                        [int(Channel.WHEEL_LEFT), int(Channel.WHEEL_RIGHT)], times.size),
                    imu_times=times[:0], pose_times=times[:0], end=float(times[-1]))
    rates = observe(simulate(plant, dense, at_once), dense, at_once)[:times.size]
    # A mean over a millisecond that ends at the stamp is the rate half of it earlier.
    middles = times - 0.5 * setting('shortest_window')
    solved = solve_ivp(lambda t, y: (np.interp(t, middles, rates) - y) / lag,
                       (float(times[0]), float(times[-1])), [rates[0]], method='RK45',
                       max_step=0.002, rtol=1e-8, atol=1e-10, dense_output=True)
    filtered = Reading(WheelReading.FILTERED, values={'wheel_window': lag})
    seen = observe(simulate(plant, driven, filtered), driven, filtered)
    left = seen[driven.slice_of(Channel.WHEEL_LEFT)]
    early = driven.wheel_times < times[-1]
    moving = np.ptp(left[early])
    assert moving > 1.0
    error = left[early] - solved.sol(driven.wheel_times[early])[0]
    assert np.max(np.abs(error)) < 0.01 * 0.01 / model.parameters['wheel_radius']


def test_a_low_pass_follows_the_yaw_rate_and_is_found(drive: Callable[..., Recording]) -> None:
    """As the low pass of a gyro does: an integrator of high order, with little noise."""
    lag = 0.027
    clean, model = drive('ahead', 'nothing', 1), load_model()
    own, plant = drives_of([clean])[0], compile_model(model.structure).at(model.parameters)
    fine = np.arange(own.start, own.end, 0.0005)
    dense = replace(own, imu_times=fine, wheel_times=fine[:0], pose_times=fine[:0],
                    measured=np.zeros(fine.size), times=fine,
                    channels=np.full(fine.size, int(Channel.YAW_RATE)))
    rate = observe(simulate(plant, dense, Reading()), dense, Reading())
    solved = solve_ivp(lambda t, y: (np.interp(t, fine, rate) - y) / lag,
                       (float(fine[0]), float(fine[-1])), [rate[0]], method='RK45',
                       max_step=0.002, rtol=1e-8, atol=1e-10, dense_output=True)
    behind = solved.sol(own.imu_times)[0]
    filtered = Reading(imu=math.inf, values={'imu_window': lag})
    seen = observe(simulate(plant, own, filtered), own, filtered)[own.slice_of(Channel.YAW_RATE)]
    assert np.max(np.abs(seen - rate.mean())) > 0.3
    assert np.max(np.abs(seen - behind)[own.imu_times < fine[-1]]) < 1e-3
    imu = clean.streams['imu']
    values = np.array(imu.values)
    values[:, imu.names.index('yaw_rate')] = solved.sol(imu.times)[0] + (
        0.001 * np.random.default_rng(6).standard_normal(imu.times.size))
    drives = drives_of([replace(clean, streams={
        **clean.streams, 'imu': TimeSeries(imu.times, values, imu.names)})])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, [clean.name], start, first_guess(drives), pool)
        # A choice is followed by a fit of the base.
        read = evidence.fit(best_reading(evidence, evidence.fit(start)).point, rounds=20).point.log
    assert read.imu == math.inf
    assert read.get('imu_window') == pytest.approx(lag, rel=0.1)
    assert reading_notes(drives, read)[-1].startswith(
        'yaw rates of the IMU seem to be behind a first-order low pass of 2')


def test_a_low_pass_is_found_where_a_wheel_has_taken_its_place(
        drive: Callable[..., Recording], monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit that has heavy wheels already leads to no low pass; the robot as it should be does."""
    lag, whole, model = 0.05, drive('ahead', 'nothing', 1), load_model()
    own, plant = drives_of([whole])[0], compile_model(model.structure).at(model.parameters)
    filtered = Reading(WheelReading.FILTERED, values={'wheel_window': lag})
    seen = observe(simulate(plant, own, filtered), own, filtered)
    rates = np.column_stack([seen[own.slice_of(side)] for side in (
        Channel.WHEEL_LEFT, Channel.WHEEL_RIGHT)])
    rates += 0.003 * np.random.default_rng(0).standard_normal(rates.shape)
    drives = drives_of([replace(whole, streams={
        **{name: whole.streams[name] for name in ('command', 'imu')},
        'wheels': TimeSeries(own.wheel_times, rates, ('left', 'right'))})])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    heavy = start.at(np.array([u.place(0.8) if u.name == 'wheel_inertia' else place for u, place in
                               zip(start.unknowns, start.places, strict=True)]))
    with Threads(1) as pool:
        evidence = evidence_of(drives, [whole.name], start, first_guess(drives), pool)
        taken = evidence.fit(heavy, rounds=1)
        found = best_reading(evidence, taken)
        monkeypatch.setattr(conventions, 'is_distorted', lambda fit: False)
        alone, asked = best_reading(evidence, taken), best_reading(evidence, taken, afresh=True)
    assert found.cost == asked.cost < alone.cost - 100.0
    assert found.point.log.wheels is WheelReading.FILTERED
    assert found.point.log.get('wheel_window') == pytest.approx(lag, rel=0.05)


def test_a_fit_is_distorted_by_unlikely_numbers_and_by_a_delay_at_its_bound(
        drive: Callable[..., Recording]) -> None:
    """Where a gyro was late beyond what a log may be, all other streams were early for it."""
    recording, model = drive('ahead', 'nothing', 1), load_model()
    drives = drives_of([recording])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())

    def fitted(name: str, share: float) -> Fit:
        places = np.array([
            u.centre + share * (u.upper - u.centre) if u.name == name else place
            for u, place in zip(start.unknowns, start.places, strict=True)])
        return evidence.fit(start.at(places), rounds=0)
    with Threads(1) as pool:
        evidence = evidence_of(drives, [recording.name], start, first_guess(drives), pool)
        assert [is_distorted(fitted(name, share)) for name, share in (
            ('delay_imu', 0.0), ('delay_imu', 0.99), ('delay_imu', 1.0), ('wheel_window', 1.0),
            ('mass', 0.99))] == [False, False, True, False, True]


@pytest.mark.parametrize('later', [False, True])
def test_wheels_tell_how_a_drive_begins_in_motion_and_no_more(
        drive: Callable[..., Recording], later: bool) -> None:
    """What was commanded until then is not known, so that they are not held against it."""
    whole, model = drive('ahead', 'nothing', 1), load_model()
    moved = whole.streams['wheels'].column('left')
    start = float(whole.streams['wheels'].times[np.argmax(np.abs(moved) > 1.0)]) if later else (
        -math.inf)
    drives = drives_of([replace(whole, streams={
        name: stream.slice(start, math.inf) for name, stream in whole.streams.items()})])
    assert drives[0].still is not later
    point = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, [whole.name], point, first_guess(drives), pool)
    whitener, window = evidence.whiteners[0], setting('start_window')
    order, since = whitener.frame.order, whitener.frame.times - drives[0].start
    wheel = drives[0].channels[order] == int(Channel.WHEEL_LEFT)
    early = whitener.scale[wheel & (since[order] < window)]
    assert early.size > 3
    assert (np.min(early) > 0.9 * setting('start_wheels')) == later
    assert np.max(whitener.scale[wheel & (since[order] > 2.0 * window)]) < 0.5


@pytest.mark.parametrize(('wheels', 'window', 'imu', 'said'), [
    (WheelReading.WINDOW_MIDDLE, 0.05, None,
     ('wheel rates seem to be means over 50 ms around their stamps',)),
    (WheelReading.FILTERED, 0.08, 0.0, (
        'wheel rates seem to be behind a first-order low pass of 80 ms',
        'yaw rates of the IMU seem to be means over 10 ms')),
    (WheelReading.WINDOW_END, 0.0005, None, ())])
def test_what_a_rate_means_is_said(driven: Drive, wheels: WheelReading, window: float,
                                   imu: float | None, said: tuple[str, ...]) -> None:
    reading = Reading(wheels, imu, {'wheel_window': window, 'imu_window': 0.01})
    assert reading_notes([driven], reading) == said
    # Counts are no rates.
    counted = replace(driven, counted=True, imu_times=driven.imu_times[:0])
    assert reading_notes([counted], reading) == ()


def _delay(driven: Drive, name: str) -> Unknown:
    return next(u for u in base_unknowns(load_model().parameters, [driven]) if u.name == name)


@pytest.mark.parametrize(('name', 'stream'), [
    ('delay_wheels', 'wheel_times'), ('delay_imu', 'imu_times'), ('delay_pose', 'pose_times')])
def test_a_stamp_stands_for_any_moment_of_its_period(
        driven: Drive, name: str, stream: str) -> None:
    own = setting('stamp_offset')
    for every in (1, 4):
        slower = replace(driven, **{stream: getattr(driven, stream)[::every]})
        period = float(np.median(np.diff(getattr(slower, stream))))
        one = _delay(slower, name)
        assert one.deviation == pytest.approx(math.hypot(own, period / math.sqrt(12.0)))
        assert one.upper == -one.lower
        assert 0.5 * period < one.upper < 0.5 * period + 10.0 * own


def test_jitter_loosens_a_delay_and_does_so_once(driven: Drive) -> None:
    one = _delay(driven, 'delay_pose')
    (loose,) = loosened([one], {'delay_pose': 0.02})
    # Uniform from 0 to 0.02 s sqrt(12), or about the stamp, or anything between.
    assert loose.centre == pytest.approx(0.25 * 0.02 * math.sqrt(12.0), rel=0.01)
    assert loose.deviation == pytest.approx(math.hypot(one.deviation, 0.01), rel=0.01)
    assert loose.upper > one.upper
    assert loosened([loose], {'delay_pose': 0.02}) == (loose,)
    assert loosened([loose], {'delay_pose': 0.0}) == (one,)
    assert loosened([one], {'delay_imu': 0.02}) == (one,)


@pytest.mark.parametrize('derived', [False, True])
def test_positions_alone_are_predicted_as_counts(
        derived: bool, drive: Callable[..., Recording]) -> None:
    """6 ms of jitter move a count by a hundredth of a turn, and a difference by a whole rate."""
    clean = drive('ahead', 'nothing', 1)
    counts = clean.streams['wheel_angles']
    logged = counts.times + np.random.default_rng(4).uniform(0.0, 0.006, len(counts))
    streams = {name: series for name, series in clean.streams.items() if name != 'wheels'}
    streams['wheel_angles'] = TimeSeries(logged, counts.values, counts.names)
    middles, rates = rates_from_angles(logged, counts.values)
    if derived:
        streams['wheels'] = TimeSeries(middles, rates, counts.names)
    own = drives_of([replace(clean, streams=streams)])[0]
    assert own.counted
    assert set(own.channels.tolist()).isdisjoint({Channel.WHEEL_LEFT, Channel.WHEEL_RIGHT})
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters.replacing(
        {'wheel_damping': 1.3, 'yaw_damping': 14.0}))
    error = own.measured - observe(simulate(plant, own, Reading()), own, Reading())
    fastest = np.max(np.abs(clean.streams['wheels'].values))
    assert np.ptp(np.diff(rates, axis=0)) > 0.5 * fastest
    for channel in (Channel.ANGLE_LEFT, Channel.ANGLE_RIGHT):
        assert np.ptp(own.measured[own.slice_of(channel)]) > 5.0
        assert np.max(np.abs(error[own.slice_of(channel)])) < 0.006 * fastest


def test_a_reading_is_chosen_though_the_model_would_run_away_at_nominal_numbers(
        driven: Drive) -> None:
    model = load_model()
    hypothesis = next(h for h in hypotheses(model.structure) if h.effect.id == 'yaw_scrub_speed')
    start = beginning(model.structure, base_unknowns(model.parameters, [driven]),
                      model.parameters, Reading())
    places = np.array(start.places)
    place = [u.name for u in start.unknowns].index('yaw_damping')
    places[place] = start.unknowns[place].place(200.0)
    point = hypothesis.point(start.at(places), {'scrub_slope': -59.0})
    with Threads(1) as pool:
        evidence = evidence_of([driven], ['one'], start, first_guess([driven]), pool)
        fit = replace(evidence.fit(point, rounds=1), point=point)
        with pytest.raises(ParameterError, match='unstable'):
            evidence.predict(nominal_of(fit.point))
        chosen = best_reading(evidence, fit, afresh=True)
    assert chosen.cost <= fit.cost
