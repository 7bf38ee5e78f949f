# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What repeats, a sensor that errs, a motor that drops out: found, described, and not in noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.conclusion import answer
from lg_husky_sim.diagnosis.evidence.adjoint import scores
from lg_husky_sim.diagnosis.evidence.drives import Channel, drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess, Whitener
from lg_husky_sim.diagnosis.evidence.observation import Motion, probe_times
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.evidence.whitener import respond
from lg_husky_sim.diagnosis.hypotheses.lines import chance_of_lines, DENSITY, lines, periodogram
from lg_husky_sim.diagnosis.hypotheses.swings import swings
from lg_husky_sim.diagnosis.hypotheses.wheel_bursts import wheel_bursts
from lg_husky_sim.diagnosis.localisation import missing_efforts
from lg_husky_sim.diagnosis.nameless import left_over, needed_evidence, unknown_finding
from lg_husky_sim.diagnosis.result import Finding, Verdict
from lg_husky_sim.diagnosis.selection.rounds import Round
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.diagnosis.wording import what_to_check
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

LEFT = 2
#: Length of a step of the commands [s]; the last part of each sees no change.
STEP = 1.2
STEPS = [(STEP, 0.2 + 0.7 * float(np.sin(1.7 * k)), 0.6 * float(np.sin(2.9 * k)))
         for k in range(24)]


def _fit_of(recordings: Sequence[Recording], pool: Threads) -> tuple[Evidence, Fit]:
    drives, model = drives_of(recordings), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    evidence = evidence_of(drives, [r.name for r in recordings], start, first_guess(drives), pool)
    return evidence, evidence.fit(start)


@pytest.fixture(scope='module')
def fitted(record: Callable[..., Recording]) -> Iterator[tuple[Evidence, Fit]]:
    """Return the evidence of two drives of a robot that lacks nothing, and their fit."""
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    backwards = [(duration, -forward, -yaw) for duration, forward, yaw in STEPS[::-1]]
    with Threads(1) as pool:
        yield _fit_of([record('ahead', plant, STEPS, 4), record('back', plant, backwards, 5)],
                      pool)


@pytest.fixture(scope='module')
def turned(record: Callable[..., Recording]) -> Iterator[tuple[Evidence, Fit]]:
    """Return the same of a drive round and round, one way and the other."""
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    turns = [(1.0, 0.5 + 0.3 * float(np.sin(2.1 * k)), 1.4 if k % 16 < 8 else -1.4)
             for k in range(48)]
    with Threads(1) as pool:
        yield _fit_of([record('round', plant, turns, 6)], pool)


def _each(evidence: Evidence, fit: Fit) -> Iterator[tuple[Whitener, Motion]]:
    return zip(evidence.whiteners, evidence.motions(fit.point, True), strict=True)


def _moved(whitener: Whitener, efforts: FloatArray) -> FloatArray:
    # Innovations of efforts at the probe times, shape (n_probe, 4).
    frame, drive = whitener.frame, whitener.frame.drive
    out = np.empty((frame.times.size, 1))
    respond(np.ascontiguousarray(efforts[:, :, None]), probe_times(drive), frame.times,
            drive.channels, frame.order, frame.cosine, frame.sine, whitener.model,
            setting('longest_step'), out)
    return whitener.apply(out)[:, 0]


def _noisy(evidence: Evidence, fit: Fit, innovations: FloatArray) -> Search:
    # A search that found nothing, where innovations are left beside white noise.
    noise = np.random.default_rng(5).standard_normal(evidence.count)
    apart = Projection(fit).apart(innovations[:, None])[:, 0]
    left = replace(fit, whitened=noise + apart)
    return Search(left, left, evidence, (Round(evidence, left, (), False, 1.0),), ())


def _said(search: Search) -> tuple[Verdict, Finding | None]:
    rest = left_over(search.evidence, search.final)
    free = missing_efforts(search.evidence, search.final)
    verdict = answer(search, rest, free).verdict
    return verdict, unknown_finding(search, rest, free) if verdict is Verdict.UNKNOWN else None


def _unknown(search: Search) -> Finding:
    verdict, said = _said(search)
    assert verdict is Verdict.UNKNOWN
    assert said is not None
    return said


def test_scores_of_efforts_are_products_with_their_innovations(
        fitted: tuple[Evidence, Fit]) -> None:
    evidence, _ = fitted
    rng = np.random.default_rng(3)
    for whitener in evidence.whiteners:
        efforts = rng.standard_normal((probe_times(whitener.frame.drive).size, 4))
        weights = rng.standard_normal(whitener.frame.times.size)
        expected = float(weights @ _moved(whitener, efforts))
        assert float(np.sum(scores(whitener, weights) * efforts)) == pytest.approx(
            expected, rel=1e-9)


def test_noise_of_any_spectrum_has_lines_no_more_often_than_stated() -> None:
    # Of first-order noise over an uneven quantity, a hundred pairs of drives: with a rate of
    # 5 %, more than twelve would have a chance of 1 in 500.
    rng = np.random.default_rng(11)
    seen = []
    for _ in range(100):
        spectra = []
        for _ in range(2):
            noise = np.zeros(1500)
            for k in range(1, noise.size):
                noise[k] = 0.9 * noise[k - 1] + rng.standard_normal()
            quantity = np.cumsum(0.5 + 0.4 * np.sin(np.arange(1500) / 90.0)) / 20.0
            spectra.append(periodogram(noise, quantity, 1.0 / (DENSITY * np.ptp(quantity)), 500))
        logs = chance_of_lines(spectra)
        edge = DENSITY * int(setting('line_least'))
        inside = logs[edge:-edge]
        seen.append(float(np.min(inside)) + np.log(inside.size / DENSITY))
    assert np.count_nonzero(np.array(seen) < np.log(0.05)) <= 12
    assert np.min(seen) > np.log(1e-5)


@pytest.mark.parametrize(('quantity', 'period', 'words'), [
    ('angle_left', 0.6, 'rad of the angle of these wheels'),
    ('voltage_left', 1.3, 'V of the voltage of this motor')])
def test_what_repeats_is_unknown_and_says_over_what(
        fitted: tuple[Evidence, Fit], quantity: str, period: float, words: str) -> None:
    evidence, fit = fitted
    parts = []
    for whitener, motion in _each(evidence, fit):
        efforts = np.zeros((probe_times(whitener.frame.drive).size, 4))
        efforts[:, LEFT] = 2.0 * np.cos(2.0 * np.pi / period * motion.column(quantity, 'probe'))
        parts.append(_moved(whitener, efforts))
    search = _noisy(evidence, fit, np.concatenate(parts))
    found = lines(evidence, search.final)
    assert (found[0].balance, found[0].argument) == ('torque_left', quantity.split('_')[0])
    assert found[0].period == pytest.approx(period, rel=0.03)
    # A period that is a little off goes out of phase.
    assert 1.0 < found[0].largest < 2.5
    said = _unknown(search)
    assert (said.subsystem, said.side) == ('drivetrain', 'left')
    assert words in said.statement


@pytest.mark.parametrize(('period', 'way'), [(4.7, 0.0), (9.3, 2.0)])
def test_a_deck_that_tilts_to_and_fro_is_unknown_and_says_how_fast(
        fitted: tuple[Evidence, Fit], period: float, way: float) -> None:
    """In whatever direction; the force counted as noise of the floor, and nothing was missing."""
    evidence, fit = fitted
    size, parts = 12.0, []
    for phase, (whitener, motion) in enumerate(_each(evidence, fit)):
        times, heading = probe_times(whitener.frame.drive), motion.column('heading', 'probe')
        efforts = np.zeros((times.size, 4))
        efforts[:, 0] = size * np.cos(heading - way) * np.sin(
            2.0 * np.pi / period * times + phase)
        parts.append(_moved(whitener, efforts))
    search = _noisy(evidence, fit, np.concatenate(parts))
    (found,) = swings(evidence, search.final)
    assert found.period == pytest.approx(period, rel=0.08)
    # Part of a slow one is taken for the noise that it is like.
    assert 0.3 * size < found.largest < 1.5 * size
    said = _unknown(search)
    assert said.subsystem == 'translation'
    assert 'a force on the chassis that swings every' in said.statement


def test_noise_swings_no_more_often_than_its_evidence_says(fitted: tuple[Evidence, Fit]) -> None:
    evidence, fit = fitted
    seen = []
    for seed in range(12):
        noise = np.random.default_rng(seed).standard_normal(evidence.count)
        seen += [one.evidence for one in swings(evidence, replace(fit, whitened=noise))]
    assert sum(one > np.log(1.0 / 0.05) for one in seen) <= 3


@pytest.mark.parametrize(('quantity', 'size'), [('acceleration', 0.012), ('lateral', 0.03)])
def test_a_gyro_that_feels_acceleration_errs(fitted: tuple[Evidence, Fit], quantity: str,
                                             size: float) -> None:
    """As the g-sensitivity of one; a damping and a radius had been named for it."""
    evidence, fit = fitted
    parts = []
    for whitener, motion in _each(evidence, fit):
        drive, times = whitener.frame.drive, probe_times(whitener.frame.drive)
        forward, yaw = (motion.column(name, 'probe') for name in ('forward', 'yaw_rate'))
        felt = np.gradient(forward, times) if quantity == 'acceleration' else forward * yaw
        out = np.zeros((drive.measured.size, 1))
        part = drive.slice_of(Channel.YAW_RATE)
        out[part, 0] = size * np.interp(drive.times[part], times, felt)
        parts.append(whitener.apply(out)[:, 0])
    said = _unknown(_noisy(evidence, fit, np.concatenate(parts)))
    assert said.subsystem == 'sensor'
    assert f'an error of the gyro, a smooth function of {quantity}' in said.statement


@pytest.mark.parametrize(('row', 'rate', 'where'), [
    (LEFT, 'wheel_left', 'a torque on the left wheels in proportion to wheel rate'),
    (1, 'yaw_rate', 'a yaw moment on the chassis in proportion to yaw')])
def test_a_loss_that_fades_from_each_start_is_unknown(
        fitted: tuple[Evidence, Fit], row: int, rate: str, where: str) -> None:
    """As of cold grease, in either direction; a payload had been named for it."""
    evidence, fit = fitted
    parts = []
    for whitener, motion in _each(evidence, fit):
        times = probe_times(whitener.frame.drive)
        efforts = np.zeros((times.size, 4))
        efforts[:, row] = -3.0 * np.exp(-(times - times[0]) / 6.0) * motion.column(rate, 'probe')
        parts.append(_moved(whitener, efforts))
    said = _unknown(_noisy(evidence, fit, np.concatenate(parts)))
    assert f'{where}, by a smooth function of the time since the start' in said.statement


@pytest.mark.parametrize(('row', 'rate', 'where'), [
    (LEFT, 'wheel_left', 'a torque on the left wheels'),
    (0, 'forward', 'a force on the chassis'), (1, 'yaw_rate', 'a yaw moment on the chassis')])
def test_what_holds_for_a_while_after_a_standstill_is_unknown(
        fitted: tuple[Evidence, Fit], row: int, rate: str, where: str) -> None:
    """As a brake that comes off late, or ground that a robot has sunk into."""
    evidence, fit = fitted
    parts = []
    for whitener, motion in _each(evidence, fit):
        times, moved = probe_times(whitener.frame.drive), motion.column(rate, 'probe')
        since, efforts = np.zeros(times.size), np.zeros((times.size, 4))
        for k in range(1, times.size):
            still = abs(moved[k]) < 0.03 or moved[k] * moved[k - 1] < 0.0
            since[k] = 0.0 if still else since[k - 1] + times[k] - times[k - 1]
        efforts[:, row] = -6.0 * np.sign(moved) * np.exp(-since / 0.4)
        parts.append(_moved(whitener, efforts))
    said = _unknown(_noisy(evidence, fit, np.concatenate(parts)))
    assert (f'{where} in proportion to the sense of motion, by a smooth function of the time '
            'since a standstill') in said.statement


@pytest.mark.parametrize(('channel', 'column', 'of', 'size', 'words'), [
    (Channel.YAW_RATE, 'yaw_rate', 'heading', 0.13, 'gyro in proportion to yaw, by a smooth '
     'function of heading'),
    (Channel.WHEEL_LEFT, 'wheel_left', 'angle_left', 0.03, 'left encoder in proportion to wheel '
     'rate, by a smooth function of the angle of the wheel')])
def test_a_sensor_whose_factor_depends_on_where_it_looks_is_unknown(
        turned: tuple[Evidence, Fit], channel: Channel, column: str, of: str, size: float,
        words: str) -> None:
    """A compass that a gyro is mixed with, or a disc that is not centred."""
    evidence, fit = turned
    parts = []
    for whitener, motion in _each(evidence, fit):
        drive = whitener.frame.drive
        times, where = probe_times(drive), motion.column(of, 'probe')
        wrong = size * np.cos(where - 1.1) * motion.column(column, 'probe')
        error = np.zeros((drive.measured.size, 1))
        part = drive.slice_of(channel)
        error[part, 0] = np.interp(whitener.frame.times[part], times, wrong)
        parts.append(whitener.apply(error)[:, 0])
    said = _unknown(_noisy(evidence, fit, np.concatenate(parts)))
    assert said.subsystem == 'sensor'
    assert f'an error of the {words}' in said.statement


@pytest.mark.parametrize(('row', 'rate', 'where'), [
    (0, 'forward', 'a force on the chassis in proportion to forward'),
    (1, 'yaw_rate', 'a yaw moment on the chassis in proportion to yaw')])
def test_patches_of_the_floor_are_unknown(
        turned: tuple[Evidence, Fit], row: int, rate: str, where: str) -> None:
    """Fields of a chessboard, which are in neither coordinate alone."""
    evidence, fit = turned
    motion, = evidence.motions(fit.point, True)
    x, y = (motion.column(name, 'probe') for name in ('x', 'y'))
    efforts = np.zeros((x.size, 4))
    here = (x - np.median(x)) * (y - np.median(y)) > 0.0
    efforts[:, row] = np.where(here, -6.0, 6.0) * motion.column(rate, 'probe')
    said = _unknown(_noisy(evidence, fit, _moved(evidence.whiteners[0], efforts)))
    assert f'{where}, by a smooth function of the place' in said.statement


def test_a_gyro_that_ends_at_some_rate_errs_and_no_effort_is_blamed(
        fitted: tuple[Evidence, Fit]) -> None:
    evidence, fit = fitted
    parts = []
    for whitener, motion in _each(evidence, fit):
        drive = whitener.frame.drive
        yaw = np.interp(whitener.frame.times, probe_times(drive),
                        motion.column('yaw_rate', 'probe'))
        error = np.zeros((drive.measured.size, 1))
        part = drive.slice_of(Channel.YAW_RATE)
        error[part, 0] = (np.clip(yaw, -0.3, 0.3) - yaw)[part]
        parts.append(whitener.apply(error)[:, 0])
    said = _unknown(_noisy(evidence, fit, np.concatenate(parts)))
    assert said.subsystem == 'sensor'
    assert 'error of the gyro, a smooth function of yaw' in said.statement


def test_a_motor_that_brakes_less_than_it_drives_is_unknown_and_says_so(
        fitted: tuple[Evidence, Fit]) -> None:
    evidence, fit = fitted
    parts = []
    for whitener, motion in _each(evidence, fit):
        rate, current = (motion.column(f'{name}_left', 'probe') for name in ('wheel', 'current'))
        efforts = np.zeros((probe_times(whitener.frame.drive).size, 4))
        efforts[:, LEFT] = np.where(rate * current < 0.0, -1.0 * current, 0.0)
        parts.append(_moved(whitener, efforts))
    said = _unknown(_noisy(evidence, fit, np.concatenate(parts)))
    assert said.regime == 'driving current'
    assert (said.subsystem, said.side) == ('drivetrain', 'left')


def _with_pulses(evidence: Evidence, fit: Fit, moments: tuple[float, ...], length: float,
                 torque: float = 30.0) -> Search:
    parts = []
    for whitener in evidence.whiteners:
        times = probe_times(whitener.frame.drive)
        efforts = np.zeros((times.size, 4))
        for moment in moments:
            since = times - whitener.frame.drive.start - moment
            efforts[:, LEFT] -= np.where((since >= 0.0) & (since < length), torque, 0.0)
        parts.append(_moved(whitener, efforts))
    return _noisy(evidence, fit, np.concatenate(parts))


def test_a_motor_that_drops_out_while_no_command_changes_is_unknown(
        fitted: tuple[Evidence, Fit]) -> None:
    evidence, fit = fitted
    search = _with_pulses(evidence, fit, tuple(k * STEP + 0.85 for k in (3, 8, 14, 20)), 0.15)
    assert wheel_bursts(evidence, search.final, 'right') == 0.0
    said = _unknown(search)
    assert (said.subsystem, said.side) == ('drivetrain', 'left')
    assert 'a torque on the left wheels at scattered times' in said.statement


def test_what_a_late_command_can_do_and_what_happens_once_is_no_burst(
        fitted: tuple[Evidence, Fit]) -> None:
    evidence, fit = fitted
    after_steps = _with_pulses(evidence, fit, tuple(k * STEP + 0.1 for k in (4, 9, 15)), 0.06)
    e = after_steps.final.whitened
    assert np.count_nonzero(np.abs(e) > setting('far')) > 10
    assert wheel_bursts(evidence, after_steps.final, 'left') == 0.0
    one = evidence.whiteners[0]
    efforts = np.zeros((probe_times(one.frame.drive).size, 4))
    efforts[int((10.0 * STEP + 0.85) / setting('probe_spacing')):, LEFT] = 30.0
    efforts[int((10.0 * STEP + 1.0) / setting('probe_spacing')):, LEFT] = 0.0
    rest = np.zeros(evidence.count - one.frame.times.size)
    once = _noisy(evidence, fit, np.concatenate([_moved(one, efforts), rest]))
    assert wheel_bursts(evidence, once.final, 'left') == 0.0


def test_bumps_of_a_floor_are_no_bursts(fitted: tuple[Evidence, Fit]) -> None:
    """However far beyond the noise of the wheels: they move these by next to nothing."""
    evidence, fit = fitted
    sharp = evidence.with_whiteners([replace(one, scale=0.05 * one.scale)
                                     for one in evidence.whiteners])
    bumpy = _with_pulses(sharp, fit, tuple(k * STEP + 0.85 for k in (3, 8, 14, 20)), 0.03, 3.0)
    assert np.count_nonzero(np.abs(bumpy.final.whitened) > setting('far')) > 10
    assert wheel_bursts(sharp, bumpy.final, 'left') == 0.0


@pytest.mark.parametrize(('subsystem', 'side', 'regime', 'words'), [
    ('drivetrain', 'left', 'angle', 'turn the wheels of that side by hand'),
    ('drivetrain', 'left', 'scattered times', 'connectors and cables'),
    ('translation', 'none', 'scattered times', 'the part of the robot that the report names'),
    ('sensor', 'none', 'yaw', 'against another one'),
    ('rotation', 'none', 'past yaw', 'the part of the robot that the report names')])
def test_what_to_check_depends_on_what_the_effort_follows(
        subsystem: str, side: str, regime: str, words: str) -> None:
    said = Finding('unknown', side, subsystem, (), regime, None, (), 9.0, 0.0, 1.0, (), '')
    assert words in what_to_check(said)


def test_white_noise_has_nothing_without_a_name(fitted: tuple[Evidence, Fit]) -> None:
    evidence, fit = fitted
    search = _noisy(evidence, fit, np.zeros(evidence.count))
    rest = left_over(evidence, search.final)
    free = missing_efforts(evidence, search.final)
    assert max(one.evidence for one in rest) < needed_evidence(rest, free)
    assert _said(search)[0] is Verdict.NOTHING_MISSING
