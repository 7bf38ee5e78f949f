# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed on a commercial base: the robot that both sets are fitted with, and the answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from lg_husky_sim.diagnosis.before_after import diagnose_change, prediction
from lg_husky_sim.diagnosis.before_after import settings as settings_module
from lg_husky_sim.diagnosis.before_after.base import Base, base_of
from lg_husky_sim.diagnosis.before_after.base_names import OUTPUTS, ROBOT
from lg_husky_sim.diagnosis.before_after.base_robot import simulate
from lg_husky_sim.diagnosis.before_after.commands import accepted
from lg_husky_sim.diagnosis.before_after.comparison import Block, Candidate
from lg_husky_sim.diagnosis.before_after.conclusion import findings
from lg_husky_sim.diagnosis.before_after.decision import Decision
from lg_husky_sim.diagnosis.before_after.diagnose_change import change_case, ChangeCase
from lg_husky_sim.diagnosis.before_after.drives import Drive, drives
from lg_husky_sim.diagnosis.before_after.fitting import fit_set, Prior
from lg_husky_sim.diagnosis.before_after.report import change_report
from lg_husky_sim.diagnosis.before_after.selection import select
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.before_after.whitening import first_noise
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.errors import DiagnosisError, RecordingError
from lg_husky_sim.husky.effects import catalogue
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.reporting.write import write_report
from lg_husky_sim.resources import config_path
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
import pytest

STEP = 0.001
#: A base as sold: a quick wheel loop, tyres on concrete.
ROBOT_BEFORE: Mapping[str, float] = {
    'slew_forward': 2.5, 'slew_yaw': 5.0, 'turn_width': 1.05, 'loop_feedforward': 3.5,
    'loop_gain': 3.0, 'loop_integral': 12.0, 'dry_left': 2.1, 'dry_right': 2.4,
    'grip_along': 0.75, 'grip_across': 0.6, 'creep_speed': 0.004, 'creep_share': 0.12,
    'deflection': 0.006, 'com_x': 0.01, 'mass': 50.0, 'yaw_inertia': 3.3}
#: Duration [s], forward [m/s], yaw [rad/s].
DRIVE = ((1.0, 0.0, 0.0), (2.0, 0.9, 0.0), (2.5, 0.5, 0.8), (1.0, 0.0, 0.0), (2.5, 0.0, 1.4),
         (2.0, -0.6, -0.5), (2.5, 0.0, -1.0), (2.0, 0.8, -0.6), (1.5, 0.0, 0.0),
         (2.0, -0.8, 0.3), (1.0, 0.0, 0.0))
OTHER = ((1.0, 0.0, 0.0), (2.5, 0.0, -1.3), (2.0, 0.7, 0.3), (2.0, -0.7, 0.6), (1.5, 0.0, 0.0),
         (2.0, 0.4, -0.9), (2.0, 0.9, 0.0), (2.5, 0.0, 0.9), (2.0, 0.6, 0.7), (1.5, 0.0, 0.0))


def driven(name: str, changes: Mapping[str, float], seed: int,
           steps: Sequence[tuple[float, float, float]] = DRIVE, /, *, rate: float = 50.0,
           low_pass: float = 0.0, late: float = 0.0, factor: float = 1.0,
           delay: float = 0.03, accelerometer: float = 1.0) -> Recording:
    """Return a recording of the base with other numbers, sampled as the arguments say."""
    base = base_of(settings(), load_model().parameters)
    values = dict(zip(base.names, base.values(base.start), strict=True))
    values |= {'current_limit': 60.0, **ROBOT_BEFORE, **changes}
    rng = np.random.default_rng(seed)
    edges = np.cumsum([0.0, *(duration for duration, _, _ in steps)])
    times = np.arange(0.0, edges[-1], 0.05) + rng.uniform(0.0, 0.004)
    index = np.clip(np.searchsorted(edges, times, side='right') - 1, 0, len(steps) - 1)
    commands = np.array([(v, w) for _, v, w in steps])[index]
    count = int(edges[-1] / STEP)
    grid = STEP * np.arange(count + 1)
    held = np.empty((2, count))
    for row, column, axis in zip(held, commands.T, ('forward', 'yaw'), strict=True):
        accepted(times, np.ascontiguousarray(column), delay, values[f'limit_{axis}'],
                 values[f'slew_{axis}'], 0.0, 0.0, STEP, row)
    held = np.ascontiguousarray(held.T[:, :, None])
    rows, heading = np.empty((count + 1, len(OUTPUTS), 1)), np.zeros(count + 1)
    out, robot = rows[:, :, 0], np.array([[values[n]] for n in ROBOT])
    # A slope needs the heading, which turns as without one.
    for _ in range(2):
        level = np.column_stack([np.cos(heading[:-1]), np.sin(heading[:-1])])
        simulate(robot, base.fixed, STEP, held, level, np.zeros((count + 1, 2, 1)), False,
                 np.zeros((5, 1)), (0,), rows)
        heading = np.concatenate([[0.0], np.cumsum(STEP * out[1:, 2])])
    x, y = (np.cumsum(STEP * one) for one in (
        np.cos(heading) * out[:, 0] - np.sin(heading) * out[:, 1],
        np.sin(heading) * out[:, 0] + np.cos(heading) * out[:, 1]))

    def sampled(hertz: float, columns: FloatArray, noise: Sequence[float], stamped: float = 0.0
                ) -> tuple[FloatArray, FloatArray]:
        at = np.arange(0.1, edges[-1] - 0.1, 1.0 / hertz)
        read = np.column_stack([np.interp(at, grid, c) for c in columns.T])
        return at + stamped, read + np.array(noise) * rng.standard_normal(read.shape)
    wheels = out[:, 3:5].copy()
    if low_pass:
        for k in range(1, count + 1):
            wheels[k] = wheels[k - 1] + (out[k, 3:5] - wheels[k - 1]) * STEP / low_pass
    imu = np.column_stack([factor * out[:, 2], out[:, 5], out[:, 6]])
    imu[:, 1:] *= accelerometer
    streams = {
        'command': TimeSeries(times, commands, ('forward', 'yaw')),
        'wheels': TimeSeries(*sampled(rate, wheels, (0.01, 0.01)), ('left', 'right')),
        'imu': TimeSeries(*sampled(rate, imu, (0.004, 0.05 * accelerometer,
                                               0.05 * accelerometer), late),
                          ('yaw_rate', 'accel_x', 'accel_y')),
        'pose': TimeSeries(*sampled(25.0, np.column_stack([x, y, heading]), (
            0.004, 0.004, 0.004)), ('x', 'y', 'heading'))}
    return Recording(name, name, streams, 0, frames=('odom', 'base_link'))


def silent(text: str, share: float) -> None:
    """Take progress and say nothing."""


def said_of(later: Sequence[Recording], before: Sequence[Recording]) -> ChangeCase:
    """Return what is said; the model that is written is fitted in one step, which says nothing."""
    known = settings()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(diagnose_change, 'settings',
                      lambda: replace(known, fit={**known.fit, 'evaluations': 1.0}))
        return change_case(later, before, load_model(), silent, jobs=2)


def changed(changes: Mapping[str, float], steps: int | None = None, **how: float) -> ChangeCase:
    """Return what is said of two drives before and two after a change, each of so many steps."""
    both = {name: value for name, value in how.items() if name in ('rate', 'low_pass',
                                                                   'accelerometer')}
    one, other = DRIVE[:steps], OTHER[:steps]
    before = [driven('base1', {}, 1, one, **both), driven('base2', {}, 2, other, **both)]
    later = [driven('rec1', changes, 3, other, **how), driven('rec2', changes, 4, one, **how)]
    return said_of(later, before)


WORN = {'dry_left': 6.5}


def before_and_worn() -> tuple[list[Recording], list[Recording]]:
    """Return drives of a robot, and of the same with a worn gear."""
    return ([driven('base1', {}, 1), driven('base2', {}, 2, OTHER)],
            [driven('rec1', WORN, 3, OTHER), driven('rec2', WORN, 4)])


@cache
def worn() -> ChangeCase:
    """Return all that is made of these, the model included."""
    before, later = before_and_worn()
    return change_case(later, before, load_model(), silent, jobs=2)


def test_nothing_changed_between_drives_of_one_robot() -> None:
    """Though the sets hold unlike manoeuvres."""
    case = said_of([driven('rec1', {}, 3, OTHER), driven('rec2', {}, 4, OTHER)],
                   [driven('base1', {}, 1), driven('base2', {}, 2)])
    assert case.diagnosis.verdict is Verdict.NOTHING_MISSING
    assert case.diagnosis.findings == ()


@pytest.mark.parametrize(('changes', 'effect', 'side', 'parameter'), [
    ({'grip_along': 0.45, 'grip_across': 0.36}, 'terrain_change', 'both', 'grip_across'),
    ({'radius_right': 0.1618}, 'wheel_radius_mismatch', 'right', 'radius_right'),
    (WORN, 'coulomb_drivetrain', 'left', 'dry_left'),
    ({'current_limit': 4.0}, 'current_limit', 'both', 'current_limit')])
def test_a_change_is_named_with_its_number(changes: Mapping[str, float], effect: str, side: str,
                                           parameter: str) -> None:
    said = (worn() if changes == WORN else changed(changes, 7)).diagnosis
    (finding,) = said.findings
    assert (finding.effect, finding.side, finding.onset) == (effect, side, None)
    number = next(one for one in finding.parameters if one.name == parameter)
    assert number.low < number.value < number.high
    assert number.value == pytest.approx(changes[parameter], rel=0.3, abs=0.01)
    assert finding.p_value < settings().decision['false_alarm_rate']


@pytest.mark.parametrize(('changes', 'effect', 'side'), [
    ({'drag': 60.0}, 'quadratic_drag', 'both'), ({'pull': -4.0}, 'yaw_pull', 'right'),
    ({'dead_voltage': 1.5}, 'driver_deadband', 'both'),
    ({'bus_resistance': 0.4}, 'battery_sag', 'both'),
    ({'encoder_right': 1.04}, 'encoder_scale', 'right')])
def test_so_is_one_of_what_the_robot_did_not_have_before(changes: Mapping[str, float], effect: str,
                                                         side: str) -> None:
    said = changed(changes, 7).diagnosis
    (finding,) = said.findings
    assert (finding.effect, finding.side) == (effect, side)
    (number,), (value,) = finding.parameters, changes.values()
    assert number.value == pytest.approx(value, rel=0.3)
    (_, own, _), = (one for name, one in settings().runs_as.items() if name == number.name)
    assert said.model.parameters[own] == pytest.approx(number.value)
    assert own not in said.plain_model.parameters


def test_two_changes_at_once_are_both_named() -> None:
    """Each with its own number, and none beside them."""
    said = changed(WORN, late=0.06).diagnosis
    assert {(one.effect, one.side) for one in said.findings} == {
        ('coulomb_drivetrain', 'left'), ('sensor_time_offset', 'both')}
    assert [one.held_out_gain for one in said.findings] == sorted(
        (one.held_out_gain for one in said.findings), reverse=True)
    assert sum(one.share for one in said.findings) == pytest.approx(1.0)
    numbers = {one.name: one.value for finding in said.findings for one in finding.parameters}
    assert numbers['dry_left'] == pytest.approx(6.5, rel=0.3)
    assert numbers['imu_late'] == pytest.approx(0.06, abs=0.02)
    assert 'dry friction of the left drivetrain' in said.model.about
    assert 'IMU' in said.model.about


VOLTAGES = {'slew_forward': 50.0, 'slew_yaw': 100.0, 'limit_forward': 20.0, 'limit_yaw': 20.0,
            'loop_feedforward': 3.5, 'loop_gain': 0.001, 'loop_integral': 0.001,
            'turn_width': 1.08, 'yaw_damping': 10.0, 'current_limit': 500.0}


def test_a_robot_without_a_speed_loop_is_compared_as_well() -> None:
    """It is driven by voltages, as the paper's; a change of its friction has its name."""
    one, other = DRIVE[:7], OTHER[:7]
    before = [driven('base1', VOLTAGES, 1, one), driven('base2', VOLTAGES, 2, other)]
    same = [driven('rec1', VOLTAGES, 3, other), driven('rec2', VOLTAGES, 4, one)]
    assert said_of(same, before).diagnosis.findings == ()
    changes = {**VOLTAGES, **WORN}
    case = said_of([driven('rec1', changes, 3, other), driven('rec2', changes, 4, one)], before)
    assert [(f.effect, f.side) for f in case.diagnosis.findings] == [
        ('coulomb_drivetrain', 'left')]
    assert 'speed_loop' not in {e.id for e in case.diagnosis.model.structure.effects}


def test_a_gyro_is_judged_by_the_pose_and_not_by_the_model() -> None:
    """Its factor is found to half a percent though nothing says how the robot turns."""
    case = changed({'grip_along': 0.45, 'grip_across': 0.36}, 7, factor=0.93)
    assert case.body is not None
    after = dict(zip(case.body.base.names, case.body.base.values(case.body.after), strict=True))
    assert after['gyro_factor'] == pytest.approx(0.93, abs=0.005)


@pytest.mark.parametrize(('how', 'effect'), [
    ({'delay': 0.12}, 'command_latency'), ({'factor': -1.0}, 'gyro_sign'),
    ({'late': 0.06}, 'sensor_time_offset'), ({'late': 0.3}, 'sensor_time_offset')])
def test_other_logs_show_the_same(how: Mapping[str, float], effect: str) -> None:
    """Wheel rates at 20 Hz through a low-pass, and no accelerometer."""
    case = changed({}, 7, rate=20.0, low_pass=0.08, accelerometer=0.0, **how)
    assert [one.effect for one in case.diagnosis.findings] == [effect]
    if 'factor' in how:
        (number,) = case.diagnosis.findings[0].parameters
        assert number.value == pytest.approx(how['factor'], abs=0.05)
    # A delay of all streams would be one of the commands.
    for z in (case.loop.before, case.loop.after):
        assert abs(dict(zip(case.loop.base.names, z, strict=True))['pose_late']) < 0.003


def test_a_change_without_a_name_is_unknown() -> None:
    """Much differs, and no name explains a fourth of it."""
    known = settings()
    base = base_of(known, load_model().parameters)
    z = base.start
    named = Candidate(known.changes[3], known.changes[3].parameters, 20.0, 20.0, z[:2], z[:2],
                      z[:2], 1e-4)
    block = Block(base, z, z, first_noise(known), (named,), 0.0, 200.0, 1e-6)

    def said(block: Block) -> tuple[Decision, ...]:
        return select(lambda adopted, _: (None, replace(
            block, explained=sum(named.gain for one in adopted if one is named.change),
            candidates=() if adopted else block.candidates)), known).decisions
    (decision,) = said(block)
    assert decision.named is None
    assert decision.unknown == 200.0
    (found,) = findings((decision,), known)
    assert found.p_value == 1e-6
    assert (found.effect, found.rivals[0].effect) == ('unknown', named.change.effect)
    assert said(replace(block, anything=50.0))[0].named is named
    assert said(replace(block, chance=0.5))[0].named is named
    (by_chance,) = said(replace(block, candidates=(replace(named, chance=0.1),), chance=0.5))
    assert by_chance.named is None
    assert findings((by_chance,), known) == ()


def test_an_imu_that_is_late_is_one_change_without_a_pose() -> None:
    """And not wheel stamps that are early beside commands that act later, which reads the same."""
    def no_pose(one: Recording) -> Recording:
        return replace(one, streams={k: s for k, s in one.streams.items() if k != 'pose'})
    before = [driven('base1', {}, 1), driven('base2', {}, 2, OTHER)]
    later = [driven('rec1', {}, 3, OTHER, late=0.12), driven('rec2', {}, 4, late=0.12)]
    said = said_of([*map(no_pose, later)], [*map(no_pose, before)]).diagnosis
    (finding,) = said.findings
    assert finding.effect == 'sensor_time_offset'
    (number,) = finding.parameters
    assert number.name == 'imu_late'
    assert number.value == pytest.approx(0.12, abs=0.01)


def test_the_order_of_recordings_does_not_matter() -> None:
    """With a shifted centre of mass, whose two names are nearly the same."""
    one, other, moved = DRIVE[:7], OTHER[:7], {'com_x': -0.05}
    before = [driven('base1', {}, 1, one), driven('base2', {}, 2, other)]
    later = [driven('rec1', moved, 3, other), driven('rec2', moved, 4, one)]
    (first,), (second,) = (said_of(a, b).decisions for a, b in (
        (later, before), (later[::-1], before[::-1])))
    assert first.named is not None
    assert second.named is not None
    assert first.named.change == second.named.change
    assert first.named.gain == pytest.approx(second.named.gain, rel=1e-3)
    assert first.confidence == pytest.approx(second.confidence, abs=1e-3)


def test_the_model_that_is_written_drives_like_the_robot_after() -> None:
    said = worn().diagnosis
    assert said.augmented['wheel_speed_rmse'] < said.plain['wheel_speed_rmse']
    assert {'speed_loop', 'command_latency'} <= {e.id for e in said.model.structure.effects}
    assert said.mismatch[0].subsystem == 'drivetrain'


def test_the_page_of_a_change_works_in_a_browser(
        visited: Callable[..., dict[str, Any]], tmp_path: Path) -> None:
    case = worn()
    write_report(change_report(case), tmp_path)
    seen = visited(tmp_path / 'report.html')
    assert seen['alive']
    assert seen['recordings'] == ['rec1', 'rec2']
    assert all(seen['drawn'])
    assert seen['jumps']
    for (name, low, high), one in zip(seen['jumps'], case.diagnosis.mismatch, strict=False):
        assert name == one.recording
        assert low < one.start <= one.end < high
    assert len(set(seen['coloured'])) == 3


def test_a_recording_that_is_too_short_is_refused_by_name() -> None:
    whole = driven('rec1', {}, 3)
    short = Recording('short', 'short', {
        name: series.slice(0.0, 0.5) for name, series in whole.streams.items()}, 0)
    with pytest.raises(RecordingError, match='recording short has no stretch of 3 s'):
        change_case([whole], [short], load_model(), silent)


def test_of_every_effect_a_change_is_told_or_it_is_said_why_not() -> None:
    """A gyro's factor also tells its sign; an alias is told as what it cannot be told from."""
    known = settings()
    told = {change.effect for change in known.changes} | {'gyro_sign'}
    told |= {other for effect, others in known.aliases.items() if effect in told
             for other in others}
    assert told & set(known.not_told) == set()
    assert set(catalogue()) == (told & set(catalogue())) | set(known.not_told)
    assert told - set(catalogue()) == {'com_shift', 'wheel_loop_retuned'} == set(known.names)
    assert all(len(why) > 20 for why in known.not_told.values())


@pytest.mark.parametrize(('there', 'instead', 'named'), [
    ('scale: log, start: 3.0', 'scale: cubic, start: 3.0', "scale = 'cubic' is neither"),
    ('effect: slope, side: both, subsystem: translation, block: body',
     'effect: slope, side: both, subsystem: translation, block: head', "block = 'head'"),
    ('parameters: [dead_time]', 'parameters: [dad_time]', "unknown parameter 'dad_time'"),
    ('sd: 1.0, lower: 0.05, upper: 50.0', 'sd: wide, lower: 0.05, upper: 50.0',
     "slew_forward.sd = 'wide' is not a number")])
def test_wrong_settings_are_refused_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                            there: str, instead: str, named: str) -> None:
    text = config_path('before_after.yaml').read_text(encoding='utf-8')
    assert there in text
    path = tmp_path / 'before_after.yaml'
    path.write_text(text.replace(there, instead, 1), encoding='utf-8')
    monkeypatch.setattr(settings_module, 'config_path', lambda name: path)
    settings.cache_clear()
    try:
        with pytest.raises(DiagnosisError, match=named):
            settings()
    finally:
        settings.cache_clear()


def test_a_simulation_that_breaks_down_is_no_place_to_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a start there is no derivative then, and at a start no fit."""
    known = settings()
    base = base_of(known, load_model().parameters)
    (drive,) = drives(driven('rec1', {}, 1, DRIVE[:3]), known.simulation['step'], known.bins,
                      0.5, 3.0)
    mass = base.names.index('mass')
    free = np.arange(base.start.size) == mass
    usual = prediction.predicted

    def broken(base: Base, drive: Drive, robots: FloatArray, motion: FloatArray
               ) -> dict[str, FloatArray]:
        whole = np.where(robots[:, mass] == middle, 1.0, np.inf)
        return {n: rows * whole for n, rows in usual(base, drive, robots, motion).items()}
    middle = base.values(base.start)[mass]
    monkeypatch.setattr(prediction, 'predicted', broken)
    _, columns = prediction.jacobian(base, drive, base.start, free)
    assert all(np.all(one == 0.0) for one in columns.values())
    prior = Prior(base.start, base.sd, free)
    middle = -1.0
    fit = fit_set(base, [drive], prior, first_noise(known), base.start, 3, 1.0, map)
    assert fit.cost == np.inf
    assert np.array_equal(fit.z, base.start)
