# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What differs between recordings and a prediction, and what to change for it."""

from __future__ import annotations

from dataclasses import replace
import json
from pathlib import Path
import re

from click.testing import CliRunner
import lg_husky_sim as lg
from lg_husky_sim.cli.main import cli
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.diagnosis.prediction_errors import _pace, assess, Assessment, PredictionError
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.resources import config_path
from lg_husky_sim.signals import TimeSeries
import pytest
import yaml

NOMINAL = lg.Husky()
DRIVES = ('circle', 's_bend', 'stop_and_go', 'spin')


def drives(robot: lg.Husky) -> list[Recording]:
    return [robot.simulate(name) for name in DRIVES]


def assessed(recordings: list[Recording], model: lg.Husky = NOMINAL) -> Assessment:
    return assess([(part, replay(model.plant, part)) for recording in recordings
                   for part in segments(recording)], 'paper', model.parameters)


def only(found: Assessment) -> PredictionError:
    one, = found.errors
    return one


def late(recording: Recording, stream: str, seconds: float) -> Recording:
    series = recording.stream(stream)
    return replace(recording, streams={**recording.streams, stream: TimeSeries(
        series.times + seconds, series.values, series.names)})


@pytest.fixture(scope='module')
def nominal_drives() -> list[Recording]:
    return drives(NOMINAL)


def test_a_robot_like_the_model_needs_no_change(nominal_drives: list[Recording]) -> None:
    found = assessed(nominal_drives)
    assert found.errors == ()
    advice, = found.advice()
    assert advice.where == 'Gains and delays agree'
    assert 'within 2\N{NO-BREAK SPACE}% of 1' in advice.sentences[0]


@pytest.mark.parametrize(('name', 'kind'), [
    ('command_gain', 'speed_gain'), ('turn_ratio', 'turn_gain'), ('wheel_radius', 'rolling')])
@pytest.mark.parametrize('factor', [0.9, 1.08])
def test_a_wrong_parameter_is_named_with_the_value_that_it_should_have(
        name: str, kind: str, factor: float) -> None:
    true = factor * NOMINAL.parameters[name]
    found = assessed(drives(lg.Husky(None, **{name: true})))
    one = only(found)
    assert one.kind == kind
    assert one.value.value == pytest.approx(factor, rel=0.02)
    said = next(line for line in one.simulator if f'--set {name}=' in line)
    assert float(said.split(f'--set {name}=')[1].split('`')[0]) == pytest.approx(true, rel=0.02)
    assert one.robot


def test_another_floor_is_told_from_another_conversion_of_yaw_commands() -> None:
    one = only(assessed(drives(lg.Husky(yaw_damping=20.0))))
    # Wheel rates per yaw rate are 1 + B_H r²/(4 B c²) times those without slip.
    times = [1.0 + damping * 0.1651 ** 2 / (1.3016 * 0.5708 ** 2) for damping in (12.865, 20.0)]
    assert one.kind == 'slip'
    assert one.value.value == pytest.approx(times[0] / times[1], rel=0.01)
    assert 'wheel_separation_multiplier' in one.robot[0]


@pytest.mark.parametrize(('model_has', 'robot_has', 'kind'), [
    (0.0, 0.2, 'late'), (0.25, 0.05, 'early')])
def test_a_dead_time_is_measured_whoever_has_it(model_has: float, robot_has: float, kind: str
                                                ) -> None:
    def husky(latency: float) -> lg.Husky:
        return NOMINAL.with_effect('command_latency', latency=latency) if latency else NOMINAL
    one = only(assessed(drives(husky(robot_has)), husky(model_has)))
    assert one.kind == kind
    assert one.value.value == pytest.approx(0.2, abs=0.02)
    assert (one.unit, one.quantity) == ('s', '')


def test_a_payload_is_among_what_may_delay_a_speed() -> None:
    found = assessed([NOMINAL.with_effect('payload', payload_mass=20.0).simulate('s_bend')])
    one = only(found)
    assert (one.kind, one.quantity) == ('channel_delay', 'forward')
    assert one.statement.endswith(', unlike the other channels.')
    first = one.robot[0]
    for cause in ('mass', 'payload', 'limit of the acceleration', 'friction'):
        assert cause in first
    assert 'stamps' in one.robot[1]     # and only then the sensor


def test_two_late_channels_are_not_unlike_the_others() -> None:
    robot = NOMINAL.with_effect('command_slew', shape='forward', slew_forward=0.5)
    found = assessed([robot.simulate('s_bend'), robot.simulate('stop_and_go')])
    assert [(one.kind, one.quantity) for one in found.errors] == [
        ('channel_delay', 'forward'), ('channel_delay', 'wheel_speed')]
    assert not any('unlike' in one.statement for one in found.errors)


def test_what_a_limit_of_the_acceleration_makes_is_not_calibrated_away() -> None:
    robot = lg.Husky(turn_ratio=0.6).with_effect(
        'command_slew', shape='forward', slew_forward=0.5)
    found = assessed([robot.simulate('s_bend')])
    assert [one.kind for one in found.errors] == ['channel_delay', 'turn_gain']
    said = ' '.join(line for one in found.advice() for line in one.sentences)
    assert 'limit of the acceleration' in said
    assert 'find the cause of the delay before anything is calibrated' in said
    for setting in ('wheel_separation', '--set', 'lg_husky identify'):
        assert setting not in said


def test_the_diagnosis_is_named_for_the_cause_of_every_difference() -> None:
    for robot in (lg.Husky(turn_ratio=0.6), NOMINAL.with_effect('payload', payload_mass=20.0)):
        last = assessed([robot.simulate('s_bend')]).advice()[-1]
        assert last.where == 'The cause'
        assert '`lg_husky diagnose REC --out DIR`' in last.sentences[0]


def test_an_interval_has_digits_enough_to_be_one() -> None:
    one = only(assessed([NOMINAL.with_effect('payload', payload_mass=20.0).simulate('s_bend')]))
    value, low, high = re.findall(r'0\.\d+', one.statement)
    assert float(low) < float(value) < float(high)


def test_a_limit_of_the_yaw_rate_is_no_wrong_gain() -> None:
    one = only(assessed(drives(NOMINAL.with_effect(
        'command_limit', shape='yaw', limit_yaw=0.4))))
    assert one.kind == 'yaw_limit'
    assert one.value.value == pytest.approx(0.4, rel=0.03)
    assert 'angular.z.max_velocity' in one.robot[0]


def test_an_encoder_is_told_from_a_side_that_turns_more_slowly() -> None:
    encoder = only(assessed(drives(NOMINAL.with_effect(
        'encoder_scale', side='left', encoder_factor=1.06))))
    assert (encoder.kind, encoder.quantity) == ('encoder', 'wheel_left')
    assert encoder.value.value == pytest.approx(1.06, abs=0.005)
    slow = only(assessed(drives(NOMINAL.with_effect(
        'coulomb_drivetrain', side='left', dry_torque=6.0))))
    assert slow.kind == 'sides'
    assert slow.value.value < 0.98
    assert re.fullmatch(r'The left wheels turn 0\.\d+ times as fast as predicted, the right ones '
                        r'((0|1)\.\d+ times )?as fast as predicted \(ratio .*\)\.', slow.statement)


@pytest.mark.parametrize(('gain', 'words'), [
    (1.0002, 'as fast as predicted'), (0.9997, 'as fast as predicted'),
    (0.93, '0.93 times as fast as predicted'), (1.2, '1.2 times as fast as predicted')])
def test_a_factor_that_is_rounded_to_one_is_not_said(gain: float, words: str) -> None:
    assert _pace(gain) == words


def test_faults_of_sensors_are_said_first_and_not_taken_for_errors_of_the_model(
        nominal_drives: list[Recording]) -> None:
    one = only(assessed(drives(NOMINAL.with_effect('gyro_sign'))))
    assert one.kind == 'sensor'
    assert 'wrong sign' in one.statement
    assert 'URDF' in one.robot[0]
    stamps = only(assessed([late(recording, 'imu', 0.3) for recording in nominal_drives]))
    assert stamps.kind == 'sensor'
    assert stamps.value.value == pytest.approx(0.3, abs=0.02)
    assert '0.3 s late' in stamps.robot[0]


def test_wheels_off_the_ground_end_the_comparison(nominal_drives: list[Recording]) -> None:
    def still(recording: Recording) -> Recording:
        pose = recording.stream('pose')
        return replace(recording, streams={
            'command': recording.stream('command'), 'wheels': recording.stream('wheels'),
            'pose': TimeSeries(pose.times, 0.0 * pose.values, pose.names)})
    one = only(assessed([still(recording) for recording in nominal_drives]))
    assert one.kind == 'off_ground'


def test_without_wheels_a_yaw_gain_is_not_put_down_to_slip_or_commands() -> None:
    def bare(recording: Recording) -> Recording:
        return replace(recording, streams={name: recording.stream(name)
                                           for name in ('command', 'imu', 'pose')})
    found = assessed([bare(one) for one in drives(lg.Husky(turn_ratio=0.6))])
    one = only(found)
    assert one.kind == 'yaw_gain'
    assert one.value.value == pytest.approx(0.6 / 0.541, rel=0.02)


def test_a_few_seconds_allow_no_verdict() -> None:
    found = assessed([NOMINAL.simulate('straight')])
    assert not found.compared
    advice, = found.advice()
    assert advice.where == 'Too little to compare'
    assert '10 s' in advice.sentences[0]


def test_compare_says_it_in_text_json_and_page(tmp_path: Path) -> None:
    robot = lg.Husky(turn_ratio=0.6)
    robot.simulate('s_bend').save(tmp_path / 'bag')
    lg.Husky(turn_ratio=0.3).save(tmp_path / 'far.yaml')
    done = CliRunner().invoke(cli, [
        'compare', str(tmp_path / 'bag'), '--model', str(tmp_path / 'far.yaml'),
        '--model', 'paper', '--out', str(tmp_path / 'out'), '--figures', '0', '--json'])
    assert done.exit_code == 0, done.output
    said = json.loads(done.stdout)['what_to_change']
    assert said == json.loads((tmp_path / 'out' / 'compare.json').read_text())['what_to_change']
    assert said['model'] == 'paper'  # the closer of the two
    difference, = said['differences']
    assert difference['kind'] == 'turn_gain'
    assert difference['low'] <= difference['value'] <= difference['high']
    headings = [one['where'] for one in said['advice']]
    assert headings == ['What differs from paper', 'On the robot', 'In the simulator',
                        'The cause']
    page = (tmp_path / 'out' / 'index.html').read_text(encoding='utf-8')
    assert '<h2>What to change</h2>' in page
    assert '<code>--set turn_ratio=0.6</code>' in page
    assert 'turn_ratio' in (tmp_path / 'out' / 'compare.txt').read_text(encoding='utf-8')


def test_every_entry_of_the_table_has_words_a_unit_and_advice() -> None:
    data = yaml.safe_load(config_path('prediction_errors.yaml').read_text(encoding='utf-8'))
    for kind, entry in data['errors'].items():
        assert set(entry) == {'unit', 'statement', 'robot', 'simulator'}, kind
        assert entry['robot'] or entry['simulator'] or kind == 'sensor', kind
