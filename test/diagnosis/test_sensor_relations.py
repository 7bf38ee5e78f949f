# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Sensors against each other, without a model: which is at fault, and whose robot it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from lg_husky_sim.comparison import scatter
from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.error_tables import error_tables
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import (
    base_unknowns,
    effect_unknowns,
    loosened,
    model_unknown,
)
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of, hypotheses, with_effects
from lg_husky_sim.diagnosis.output import headline, summary_text
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.sensors.faults import Fault, faults
from lg_husky_sim.diagnosis.sensors.relations import by_names, relations
from lg_husky_sim.diagnosis.sensors.repair import begun_with, certain, fault_findings
from lg_husky_sim.diagnosis.sensors.robot import differences, impossible, misread
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

Make = Callable[..., Recording]


@pytest.fixture(scope='module')
def clean(drive: Make) -> Recording:
    return drive('clean', 'nothing', 3)


def changed(recording: Recording, **streams: TimeSeries | None) -> Recording:
    """Return a recording with streams exchanged, or left out where they are None."""
    merged = {**recording.streams, **streams}
    return replace(recording, streams={k: v for k, v in merged.items() if v is not None})


def late(series: TimeSeries, seconds: float) -> TimeSeries:
    return TimeSeries(series.times + seconds, series.values, series.names)


def scaled(series: TimeSeries, factors: FloatArray | float, offset: FloatArray | float = 0.0
           ) -> TimeSeries:
    return TimeSeries(series.times, series.values * factors + offset, series.names)


def found(recording: Recording) -> tuple[Fault, ...]:
    return faults(relations(segments(recording)))


def names(recording: Recording) -> list[str]:
    return [one.effect.id if one.effect else '' for one in found(recording)]


@pytest.mark.parametrize('part', ['nothing', 'command', 'drivetrain', 'translation', 'rotation'])
def test_sensors_in_order_are_not_accused_whatever_the_robot_lacks(part: str, drive: Make) -> None:
    assert found(drive('one', part, 5)) == ()


def test_a_reversed_gyro_is_found_by_the_pose_and_by_the_wheels_alone(clean: Recording) -> None:
    imu = scaled(clean.stream('imu'), np.array([-1.0, 1.0, 1.0]))
    for recording in (changed(clean, imu=imu), changed(clean, imu=imu, pose=None)):
        one = found(recording)[0]
        assert one.effect is not None
        assert one.effect.id == 'gyro_sign'
        assert one.number is not None
        assert one.number.value == pytest.approx(-1.0, abs=0.05)


@pytest.mark.parametrize('seconds', [0.3, -0.35])
@pytest.mark.parametrize('stream', ['imu', 'pose'])
def test_the_late_one_of_three_streams_is_named_with_its_lateness(
        stream: str, seconds: float, clean: Recording) -> None:
    one = found(changed(clean, **{stream: late(clean.stream(stream), seconds)}))[0]
    assert one.effect is not None
    assert (one.effect.id, one.effect.shape) == ('sensor_time_offset', stream)
    assert one.number is not None
    assert one.number.value == pytest.approx(seconds, abs=0.03)
    assert ('later' if seconds > 0.0 else 'earlier') in one.statement


def test_what_all_streams_are_late_does_not_go_into_the_one_at_fault(clean: Recording) -> None:
    """A base that answers late, and stamps whose jitter leaves room for it."""
    recording, model = changed(clean, imu=late(clean.stream('imu'), -0.3),
                               command=late(clean.stream('command'), -0.15)), load_model()
    drives = drives_of([recording])
    unknowns = loosened(base_unknowns(model.parameters, drives), dict.fromkeys(
        ('delay_wheels', 'delay_imu', 'delay_pose'), 0.05))
    start, (fault,) = begun_with(beginning(model.structure, unknowns, model.parameters, Reading()),
                                 certain(found(recording)))
    names = [u.name for u in start.unknowns]

    def cost(**lateness: float) -> float:
        places = np.array(start.places)
        for name, seconds in lateness.items():
            places[names.index(name)] = seconds
        point = start.at(places)
        return evidence.cost(evidence.residuals(evidence.predict(point)), point)
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['clean'], start, first_guess(drives), pool)
        others = {'delay_wheels': 0.15, 'delay_pose': 0.15}
        # The same readings: the gyro is early against the others, or late as the base is.
        assert cost(stamp_delay=-0.3, delay_imu=0.15, **others) < cost(
            stamp_delay=-0.15, delay_imu=0.0, **others) - 10.0
        fit = evidence.fit(start, rounds=20)
    (finding,) = fault_findings([fault], fit)
    assert finding.parameters[0].value == pytest.approx(-0.3, abs=0.05)


def test_a_certain_fault_keeps_its_number_where_effects_are_left_out(clean: Recording) -> None:
    recording, model = changed(clean, imu=late(clean.stream('imu'), -0.3)), load_model()
    drives = drives_of([recording])
    start, (fault,) = begun_with(beginning(
        model.structure, base_unknowns(model.parameters, drives), model.parameters, Reading()),
        certain(found(recording)))
    one = next(h for h in hypotheses(start.structure) if h.effect.id == 'command_latency')
    there = one.point(start, {'latency': 0.1})
    moved = there.at(there.places + 0.001)
    left = with_effects(start, moved, [])
    assert [u.name for u in left.unknowns] == [u.name for u in start.unknowns]
    assert left.values['stamp_delay'] == moved.values['stamp_delay'] != start.values['stamp_delay']
    kept = with_effects(start, moved, [one])
    assert [u.name for u in kept.unknowns] == [u.name for u in moved.unknowns]
    np.testing.assert_array_equal(kept.places, moved.places)
    with Threads(1) as pool:
        fit = evidence_of(drives, ['clean'], start, first_guess(drives), pool).fit(left, rounds=1)
    (finding,) = fault_findings([fault], fit)
    assert finding.parameters[0].value == pytest.approx(-0.3, abs=0.01)
    assert ' s early (' in finding.statement.split('which this answer takes')[1]


def test_late_wheels_are_told_from_a_body_that_follows_its_wheels(clean: Recording) -> None:
    one = found(changed(clean, wheels=late(clean.stream('wheels'), 0.4)))[0]
    assert one.stream == 'wheels'
    assert one.number is not None
    assert one.number.value == pytest.approx(0.3, abs=0.15)


def test_of_two_streams_no_one_is_accused_but_the_contradiction_is_said(clean: Recording) -> None:
    faulty = changed(clean, pose=None, imu=late(clean.stream('imu'), -0.5))
    one, = found(faulty)
    assert one.effect is None
    assert one.statement.startswith('The stamps of the wheels')
    assert 'third stream' in one.statement


def test_factor_and_offset_of_a_gyro_are_measured(clean: Recording) -> None:
    imu = scaled(clean.stream('imu'), np.array([1.1, 1.0, 1.0]), np.array([0.03, 0.0, 0.0]))
    by_name: Mapping[str, Fault] = {
        one.effect.id: one for one in found(changed(clean, imu=imu)) if one.effect}
    factor, bias = by_name['gyro_scale'].number, by_name['gyro_bias'].number
    assert factor is not None
    assert factor.low < 1.1 < factor.high
    assert bias is not None
    assert bias.value == pytest.approx(0.03, abs=0.004)


def test_interchanged_sides_and_reversed_wheels_are_told(clean: Recording) -> None:
    wheels = clean.stream('wheels')
    swapped = TimeSeries(wheels.times, wheels.values[:, ::-1], wheels.names)
    assert 'interchanged' in found(changed(clean, wheels=swapped))[0].statement
    assert 'backwards' in found(changed(clean, wheels=scaled(wheels, -1.0)))[0].statement


@pytest.mark.parametrize(('stream', 'factors', 'words'), [
    ('wheels', (-1.0, 1.0), 'The left wheels turn backwards'),
    ('wheels', (1.0, -1.0), 'The right wheels turn backwards'),
    ('wheels', (-1.0, -1.0), 'both wheel rates have the wrong sign'),
    ('imu', (0.0, 1.0, 1.0), 'The gyro does not turn'),
    ('imu', (57.3, 1.0, 1.0), 'degrees per second'),
    ('command', (1.0, 57.3), 'commanded yaw rates seem to be in degrees per second'),
    ('command', (1.0, -1.0), 'turns against its commands')])
def test_streams_that_no_model_can_follow_are_told_in_seconds_and_nothing_else_is(
        stream: str, factors: tuple[float, ...], words: str, clean: Recording) -> None:
    wrong = changed(clean, **{stream: scaled(clean.stream(stream), np.array(factors))})
    fault, = found(wrong)
    assert words in fault.statement
    assert fault.effect is None
    difference, = misread([fault])
    assert not difference.comparable
    assert differences(relations(segments(wrong)), load_model().parameters) == ()


@pytest.mark.parametrize(('factor', 'unit'), [
    (180.0 / np.pi, 'degrees per second'), (30.0 / np.pi, 'revolutions per minute'),
    (0.5 / np.pi, 'revolutions per second')])
def test_wheel_rates_in_another_unit_are_told(factor: float, unit: str, clean: Recording) -> None:
    wheels = scaled(clean.stream('wheels'), factor)
    related = relations(segments(changed(clean, wheels=wheels)))
    difference, = differences(related, load_model().parameters)
    assert f'their rates are in {unit}' in difference.statement
    assert not difference.comparable


def test_a_robot_whose_streams_no_model_can_follow_is_diagnosed_as_that(clean: Recording) -> None:
    wheels = scaled(clean.stream('wheels'), np.array([-1.0, 1.0]))
    diagnosis = diagnose([changed(clean, wheels=wheels)], load_model(), silent).diagnosis
    assert diagnosis.verdict is Verdict.UNKNOWN
    assert not diagnosis.fits
    assert [f.subsystem for f in diagnosis.findings] == ['sensor']
    assert 'The left wheels turn backwards' in diagnosis.findings[0].statement


def test_a_pose_that_jumps_accuses_nobody(clean: Recording) -> None:
    pose = clean.stream('pose')
    values = np.array(pose.values)
    values[200:, :2] += 1.5
    assert names(changed(clean, pose=TimeSeries(pose.times, values, pose.names))) == []


def test_a_shift_of_the_whole_bag_changes_no_relation(clean: Recording) -> None:
    moved = replace(clean, streams={k: late(s, 1000.0) for k, s in clean.streams.items()})
    for one, other in zip(relations(segments(clean)), relations(segments(moved)), strict=True):
        assert other.factor.value == pytest.approx(one.factor.value, rel=1e-6)
        assert other.late.value == pytest.approx(one.late.value, abs=1e-5)


def test_a_deflated_wheel_is_still_this_robot_and_one_twice_as_large_is_not(
        clean: Recording) -> None:
    """Wheels that roll half as far at every speed do not slip."""
    parameters = load_model().parameters

    def differs(factor: float) -> bool:
        wheels = scaled(clean.stream('wheels'), 1.0 / factor)
        return bool(differences(relations(segments(changed(clean, wheels=wheels))), parameters))
    assert not differs(0.9)
    assert not differs(1.1)
    assert differs(2.0)
    assert differs(0.5)
    assert differs(0.05)


def test_a_stretch_with_one_reading_of_the_wheels_says_nothing(clean: Recording) -> None:
    whole, = segments(clean)
    once = {name: TimeSeries(series.times[:1], series.values[:1], series.names)
            if name.startswith('wheel') else series for name, series in whole.streams.items()}
    one, both = ([found for found in relations(parts) if found.source == 'wheels'] for parts in (
        (whole,), (whole, replace(whole, streams=once))))
    assert one
    assert both == one


@pytest.mark.parametrize('damping', [1.3, 0.7])
def test_tyres_that_slip_by_a_resistance_are_no_smaller_wheels(
        record: Make, steps: Sequence[tuple[float, float, float]], damping: float) -> None:
    """However far the robot lags behind its wheels."""
    model, effect = load_model(), Effect('rolling_resistance')
    plant = compile_model(model.structure.with_effect(effect)).at(model.parameters.replacing({
        'wheel_damping': damping}).with_entries(*entries_of(effect, {'rolling_force': 60.0})))
    related = relations(segments(record('slips', plant, steps, 3)))
    speed = by_names(related)['speed', 'wheels', 'pose']
    assert speed.factor.value < 0.6 * model.parameters['wheel_radius']
    assert speed.explained < setting('proportional')
    assert differences(related, model.parameters) == ()


@pytest.mark.parametrize(('name', 'value', 'impossible_'), [
    ('payload_mass', 30.0, False), ('payload_mass', 300.0, True), ('mass', 60.0, False),
    ('mass', 200.0, True), ('wheel_radius', 0.15, False), ('wheel_radius', 0.09, True)])
def test_a_fit_with_numbers_that_no_such_robot_has_is_of_another_robot(
        name: str, value: float, impossible_: bool) -> None:
    model = load_model()
    payload = Effect('payload')
    numbers = model.parameters.with_entries(
        *(p.parameter() for p in payload.parameters())).replacing({name: value})
    entry = model.parameters.entry(name if name in model.parameters else 'mass')
    unknowns = (model_unknown(entry), *effect_unknowns(payload, {
        p.name: numbers[p.name] for p in payload.parameters()}))
    residuals = np.array([np.log(numbers[entry.name] / entry.value) / entry.tolerance]
                         + [0.0] * (len(unknowns) - 1))
    fit: Any = SimpleNamespace(point=SimpleNamespace(
        unknowns=unknowns, prior_residuals=residuals, numbers=numbers,
        structure=model.structure.with_effect(payload)))
    assert bool(impossible(fit, model.parameters)) is impossible_


def test_wheels_known_by_noisy_angles_alone_are_compared_by_these(clean: Recording) -> None:
    """Rates made of such angles are mostly noise, which would pass for smaller wheels."""
    wheels = clean.streams['wheels']
    rng = np.random.default_rng(5)
    step = np.diff(wheels.times)[:, None]
    turned = np.vstack([np.zeros((1, 2)), np.cumsum(
        0.5 * step * (wheels.values[1:] + wheels.values[:-1]), axis=0)])
    turned += 0.1 * rng.standard_normal(turned.shape)
    middles = 0.5 * (wheels.times[:-1] + wheels.times[1:])
    streams = {**clean.streams,
               'wheel_angles': TimeSeries(wheels.times, turned, wheels.names),
               'wheels': TimeSeries(middles, np.diff(turned, axis=0) / step, wheels.names)}
    counted = replace(clean, streams=streams)
    rolls = by_names(relations(segments(counted)))['speed', 'wheels', 'pose'].factor
    assert rolls.value == pytest.approx(load_model().parameters['wheel_radius'], rel=0.02)


def test_readings_that_are_no_numbers_are_left_out(clean: Recording) -> None:
    imu = clean.stream('imu')
    values = np.array(imu.values)
    values[5, 0] = np.nan
    left = relations(segments(changed(clean, imu=TimeSeries(imu.times, values, imu.names))))
    assert {(one.source, one.reference) for one in left} == {
        ('wheels', 'pose'), ('command', 'pose')}


def silent(text: str, share: float) -> None:
    del text, share


def test_wheels_off_the_ground_are_said_to_be_that_and_nothing_else(clean: Recording) -> None:
    pose = clean.stream('pose')
    values = 0.003 * np.random.default_rng(1).standard_normal(pose.values.shape)
    still = changed(clean, imu=None, pose=TimeSeries(pose.times, values, pose.names))
    diagnosis = diagnose([still], load_model(), silent).diagnosis
    assert diagnosis.verdict is Verdict.UNKNOWN
    assert not diagnosis.fits
    assert diagnosis.findings[0].subsystem == 'traction'
    assert 'no ground reaction' in diagnosis.findings[0].statement
    # A fit to what the model is not about is no improvement, and none is shown.
    assert 'recalibrated' not in summary_text(diagnosis)
    assert all(table.columns == ('nominal',) and table.compared is None
               for table in error_tables(diagnosis))


def test_the_scatter_of_a_pose_is_said_where_it_is_a_part_of_the_errors(
        clean: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    pose = clean.stream('pose')
    values = 0.003 * np.random.default_rng(1).standard_normal(pose.values.shape)
    still = changed(clean, imu=None, pose=TimeSeries(pose.times, values, pose.names))
    for share, said in ((0.3, False), (0.01, True)):
        monkeypatch.setattr(scatter, 'settings', lambda share=share: {
            'scatter_share': share, 'scatter_followed': 0.5})
        notes = diagnose([still], load_model(), silent).diagnosis.notes
        assert any('has a scatter of at least' in note for note in notes) is said


def test_another_robot_is_refused_and_its_reversed_gyro_found_all_the_same(
        clean: Recording) -> None:
    imu = scaled(clean.stream('imu'), np.array([-1.0, 1.0, 1.0]))
    large = changed(clean, imu=imu, wheels=scaled(clean.stream('wheels'), 0.5))
    diagnosis = diagnose([large], load_model(), silent).diagnosis
    assert not diagnosis.fits
    assert headline(diagnosis) == 'This model does not fit this robot.'
    assert diagnosis.findings[0].statement.startswith('Its wheels roll')
    assert summary_text(diagnosis).count('does not fit') == 1
    assert summary_text(diagnosis).count('The gyro turns against') == 1
    assert 'commercial base' in diagnosis.model.about or diagnosis.model == diagnosis.plain_model
    assert [f.effect for f in diagnosis.findings] == ['unknown', 'gyro_sign']
    assert any('wrong sign' in text for text in diagnosis.sensors)


def test_rates_in_degrees_are_a_stream_that_cannot_be_right(clean: Recording) -> None:
    """And not another robot."""
    wrong = changed(clean, imu=None, wheels=scaled(clean.stream('wheels'), np.degrees(1.0)))
    diagnosis = diagnose([wrong], load_model(), silent).diagnosis
    assert headline(diagnosis) == 'A stream of these recordings cannot be right.'
    assert 'degrees' in diagnosis.findings[0].statement
