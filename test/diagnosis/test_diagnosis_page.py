# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis answers in its first lines: what, where, how much, how sure, and what to do."""

from __future__ import annotations

from dataclasses import replace
import math

from lg_husky_sim.diagnosis.before_after.settings import Change, settings
from lg_husky_sim.diagnosis.commercial_base import CommercialBase
from lg_husky_sim.diagnosis.model_mismatch import _said
from lg_husky_sim.diagnosis.output import summary_text
from lg_husky_sim.diagnosis.report import advice, competing, headline, report_data
from lg_husky_sim.diagnosis.result import (
    Diagnosis,
    diagnosis_data,
    Estimate,
    Finding,
    LEAST_CHANCE,
    Rivalry,
    Verdict,
)
from lg_husky_sim.diagnosis.wording import number_words, sentence, sized
from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.reporting.advice import names_in
from lg_husky_sim.reporting.sections import Cell, Tone
import pytest


def _finding(effect: str, side: str, *numbers: Estimate) -> Finding:
    return Finding(effect, side, 'drivetrain', ('J_LW',), 'while driving', None, numbers, 800.0,
                   1e-9, 0.9, (), 'A sentence.')


def _diagnosis(verdict: Verdict, *findings: Finding) -> Diagnosis:
    model = load_model()
    return Diagnosis(verdict, 0.93, findings, (), (), (), {}, {}, {}, {}, '', model, model)


RIPPLE = _finding('torque_ripple', 'left', Estimate('ripple_cos', 3.0, 'N·m', 2.8, 3.2),
                  Estimate('ripple_sin', -4.0, 'N·m', -4.2, -3.8))


def test_a_ripple_has_amplitude_and_phase() -> None:
    amplitude, phase = sized(RIPPLE.parameters)
    assert (amplitude.name, amplitude.value, amplitude.unit) == ('amplitude', 5.0, 'N·m')
    assert (amplitude.low, amplitude.high) == pytest.approx((4.8, 5.2))
    assert phase.value == pytest.approx(math.atan2(-4.0, 3.0))
    assert phase.high - phase.low == pytest.approx(2 * 0.2 / 5.0)


def test_a_finding_without_rivals_says_so_in_plain_words() -> None:
    said = summary_text(_diagnosis(Verdict.KNOWN, RIPPLE), False)
    assert 'competing effects: none that predicts better' in said


def test_the_first_line_is_one_sentence_with_its_confidence() -> None:
    first, *_ = summary_text(_diagnosis(Verdict.KNOWN, RIPPLE), False).splitlines()
    assert first == 'Missing effect found: torque ripple, left side (confidence 0.93)'


def test_errors_of_a_tried_base_are_written_with_the_same_digits() -> None:
    base = CommercialBase(load_model(), {'dead_time': 0.0, 'slew_forward': 1.0, 'slew_yaw': 2.0})
    said = _said(base, True, {'wheel_speed_rmse': 3.21}, {'wheel_speed_rmse': 3.0})
    assert said.endswith(' was tried as one hypothesis. Its errors on held-out data are 3.0 rad/s '
                         'in wheel rates (recalibrated 3.2); `model.yaml` runs like it.')


def test_each_harmonic_of_a_ripple_has_amplitude_and_phase() -> None:
    twice = _finding('torque_ripple', 'left', *RIPPLE.parameters,
                     Estimate('ripple_cos_twice', 0.6, 'N·m', 0.5, 0.7),
                     Estimate('ripple_sin_twice', 0.8, 'N·m', 0.7, 0.9))
    first, phase, second, other = sized(twice.parameters)
    assert (first.value, phase.name) == (5.0, 'phase')
    assert second.name == 'amplitude of the second harmonic'
    assert second.value == pytest.approx(1.0)
    assert (other.name, other.unit) == ('phase of the second harmonic', 'rad')
    assert dict(headline(_diagnosis(Verdict.KNOWN, twice)).facts)['Size'] == (
        'amplitude 5 N·m (4.8 to 5.2); amplitude of the second harmonic 1 N·m (0.9 to 1.1)')


def test_the_first_line_names_effect_and_side() -> None:
    said = headline(_diagnosis(Verdict.KNOWN, RIPPLE))
    assert said.text == 'Missing effect found: torque ripple, left side'
    assert dict(said.facts) == {
        'Effect': 'torque ripple', 'Side': 'left', 'Size': 'amplitude 5 N·m (4.8 to 5.2)',
        'Acts': 'always', 'Confidence': '93 %'}


def test_a_change_of_the_floor_has_no_side_and_its_numbers_no_other_unit() -> None:
    """Before and after, a slope is in m/s²; the catalogue has it in N."""
    slope = _finding('slope', 'both', Estimate('slope_x', -0.345, 'm/s²', -0.362, -0.329))
    diagnosis = _diagnosis(Verdict.KNOWN, slope)
    facts = dict(headline(diagnosis, changed=True).facts)
    assert (facts['Side'], facts['Acts']) == ('whole robot', 'in the later recordings')
    robot = advice(diagnosis, {}, changed=True)[0].sentences
    assert any('level floor' in line for line in robot)
    assert not any('0.345' in line for line in robot)


def test_advice_takes_numbers_of_before_and_after_in_their_unit_only() -> None:
    others = {one.name: one.unit for one in settings().quantities}
    for kind in catalogue().values():
        said = names_in(' '.join((*kind.advice.robot, *kind.advice.simulator)))
        for one in kind.parameters:
            assert one.name not in said or others.get(one.name, one.unit) == one.unit, one.name


@pytest.mark.parametrize('change', settings().changes, ids=lambda one: one.effect)
def test_every_change_says_what_to_do_on_the_robot(change: Change) -> None:
    units = {one.name: one.unit for one in settings().quantities}
    found = _finding(change.effect, change.side, *(
        Estimate(name, 1.0, units[name], 0.9, 1.1) for name in change.parameters))
    parts = {one.where: one.sentences for one in advice(
        _diagnosis(Verdict.KNOWN, found), {}, changed=True)}
    assert parts['On the robot']
    assert not any('{' in line for lines in parts.values() for line in lines)


@pytest.mark.parametrize(('verdict', 'changed', 'text', 'tone'), [
    (Verdict.NOTHING_MISSING, False, 'No missing physics found', Tone.GOOD),
    (Verdict.NOTHING_MISSING, True, 'No change found', Tone.GOOD),
    (Verdict.UNKNOWN, False, 'Something is missing that is not in the catalogue', Tone.BAD),
    (Verdict.UNKNOWN, True, 'Something has changed that is not in the catalogue', Tone.BAD),
    (Verdict.KNOWN, True, 'What changed: torque ripple, left side', Tone.FOUND)])
def test_the_first_line_answers_the_question(verdict: Verdict, changed: bool, text: str,
                                             tone: Tone) -> None:
    found = () if verdict is Verdict.NOTHING_MISSING else (RIPPLE,)
    said = headline(_diagnosis(verdict, *found), changed=changed)
    assert (said.text, said.tone) == (text, tone)


def test_advice_has_the_numbers_and_the_stream() -> None:
    late = _finding('sensor_time_offset', 'none', Estimate('stamp_delay', 0.206, 's', 0.2, 0.21))
    robot, simulator = advice(_diagnosis(Verdict.KNOWN, RIPPLE, late), {
        ('sensor_time_offset', 'none'): 'pose'})
    assert 'the left wheels' in robot.sentences[0]
    assert '5 N·m' in robot.sentences[0]
    assert any('The stamps of the pose' in line and '0.206 s late' in line
               for line in robot.sentences)
    assert not any('imu_latency' in line for line in simulator.sentences)
    assert 'model:=model.yaml' in simulator.sentences[-1]


def test_many_numbers_stand_in_the_sentence_and_not_in_a_box() -> None:
    numbers = [Estimate(name, 1.0, 'm', 0.9, 1.1) for name in ('com_x', 'com_y', 'com_height')]
    for count in (1, 2, 3):
        facts = dict(headline(_diagnosis(
            Verdict.KNOWN, _finding('payload', 'none', *numbers[:count]))).facts)
        assert ('Size' in facts) == (count < 3)


@pytest.mark.parametrize(('name', 'shapes'), [
    ('stamp_delay', {('sensor_time_offset', 'none'): 'imu'}), ('imu_late', {})])
def test_stamps_that_are_early_are_called_early(name: str, shapes: dict[tuple[str, str], str]
                                                ) -> None:
    early = _finding('sensor_time_offset', 'none', Estimate(name, -0.24, 's', -0.25, -0.22))
    diagnosis = _diagnosis(Verdict.KNOWN, early)
    assert dict(headline(diagnosis).facts)['Size'] == 'stamps 0.24 s early (0.22 to 0.25)'
    assert 'of the IMU are 0.24 s early' in advice(diagnosis, shapes)[0].sentences[0]
    if name == 'stamp_delay':
        said = sentence(Effect('sensor_time_offset', shape='imu'), None, early.parameters,
                        'everywhere')
        assert said.startswith('The stamps of the IMU are off: 0.24 s early (0.22 to 0.25).')


def test_a_robot_that_is_no_husky_is_given_no_model_to_load() -> None:
    diagnosis = replace(_diagnosis(Verdict.UNKNOWN, _finding('unknown', 'none')), fits=False)
    (robot,) = advice(diagnosis, {})
    assert 'wheels are on the ground' in robot.sentences[0]


def test_a_limit_on_the_speed_says_nothing_of_the_yaw_rate() -> None:
    limit = _finding('command_limit', 'none', Estimate('limit_forward', 0.45, 'm/s', 0.44, 0.46))
    _, simulator = advice(_diagnosis(Verdict.KNOWN, limit), {})
    (line,) = simulator.sentences
    assert '`max_forward: 0.45` [m/s] in sim_node' in line
    assert 'max_yaw' not in line


def test_settings_that_do_what_the_model_does_are_said_as_the_other_way() -> None:
    slew = _finding('command_slew', 'none', Estimate('slew_forward', 1.44, 'm/s²', 1.4, 1.5),
                    Estimate('slew_yaw', 3.0, 'rad/s²', 2.9, 3.1))
    model = load_model()

    def said(*findings: Finding) -> tuple[str, ...]:
        # with the finding in its model
        return advice(replace(_diagnosis(Verdict.KNOWN, *findings),
                              model=replace(model, about='found')), {})[-1].sentences
    line = said(slew)[-1]
    assert line.startswith('Either load the model with the finding: `ros2 run')
    assert line.endswith('acts twice.')
    assert ('Or load `plain.yaml` and set `max_forward_acceleration: 1.44` [m/s²] and '
            '`max_yaw_acceleration: 3` [rad/s²] in sim_node; not both') in line
    assert sum('max_forward_acceleration' in one for one in said(slew)) == 1
    assert said(slew, RIPPLE)[-1].endswith('The latter lacks what else was found.')
    assert said(RIPPLE)[-1].startswith('Load the model with the finding: ')


@pytest.mark.parametrize(('effect', 'shape', 'number', 'robot', 'simulator'), [
    ('command_slew', 'forward', Estimate('slew_forward', 1.8, 'm/s²', 1.7, 1.9),
     '`linear.x.max_acceleration` of diff_drive_controller: it acts like 1.8 m/s²',
     '`max_forward_acceleration: 1.8`'),
    ('command_limit', 'yaw', Estimate('limit_yaw', 0.99, 'rad/s', 0.98, 1.0),
     '`angular.z.max_velocity` of diff_drive_controller', '`max_yaw: 0.99`'),
    ('sensor_time_offset', 'imu', Estimate('stamp_delay', 0.2, 's', 0.19, 0.21),
     'of the IMU are 0.2 s late', 'sim_node'),
    ('torque_ripple', '', Estimate('ripple_cos', 3.0, 'N·m', 2.8, 3.2), 'the left wheels',
     'sim_node')])
def test_the_user_is_told_which_setting_to_change(effect: str, shape: str, number: Estimate,
                                                  robot: str, simulator: str) -> None:
    side = 'left' if effect == 'torque_ripple' else 'none'
    numbers = RIPPLE.parameters if effect == 'torque_ripple' else (number,)
    said = {one.where: ' '.join(one.sentences) for one in advice(
        _diagnosis(Verdict.KNOWN, _finding(effect, side, *numbers)), {(effect, side): shape})}
    assert robot in said['On the robot']
    assert simulator in said['In the simulator']


@pytest.mark.parametrize(('gain', 'words'), [(31740.0, '100 % of its gain'),
                                             (400.0, '1 % of its gain'), (0.0, '')])
def test_the_runner_up_is_said_as_near_as_its_bar_is_long(gain: float, words: str) -> None:
    finding = replace(_finding('command_limit', 'none'), held_out_gain=31740.0,
                      rivals=(Rivalry('payload', 'none', gain),))
    (section,) = competing(_diagnosis(Verdict.KNOWN, finding))
    first, other = (row[1] for row in section.tables[0].rows)
    assert isinstance(first, Cell)
    assert isinstance(other, Cell)
    assert first.bar == 1.0
    assert other.bar == pytest.approx(gain / 31740.0)
    runner_up = [line for line in section.text if line.startswith('Runner-up')]
    assert len(runner_up) == bool(words)
    assert all(words in line for line in runner_up)


def test_what_gets_worse_on_held_out_data_is_said_first_everywhere() -> None:
    said = _diagnosis(Verdict.KNOWN, RIPPLE)
    model = replace(said.model, about='with the finding')
    worse = replace(said, model=model, held_out_plain={'max_abs_y_m': 0.05, 'yaw_rate_rmse': 0.2},
                    held_out_augmented={'max_abs_y_m': 0.1, 'yaw_rate_rmse': 0.1})
    (warning,) = worse.warnings
    assert 'largest |Y| error [m] from 0.05 to 0.1;' in warning
    assert 'yaw rate' not in warning
    assert summary_text(worse).splitlines()[1] == f'  warning: {warning}'
    assert diagnosis_data(worse)['warnings'] == [warning]
    certain = replace(worse, findings=(replace(RIPPLE, p_value=0.0),))
    assert diagnosis_data(certain)['findings'][0]['evidence']['p_value'] == LEAST_CHANCE
    page = report_data(worse, ['rec'], [], [])
    assert page.headline.warnings == (f'O{warning[1:]}.',)
    assert replace(worse, held_out_augmented=worse.held_out_plain).warnings == ()


def test_reports_call_effects_and_numbers_by_names_of_the_field() -> None:
    dry = _finding('coulomb_drivetrain', 'left', Estimate('dry_left', 6.43, 'N·m', 5.74, 7.13))
    known = headline(_diagnosis(Verdict.KNOWN, dry))
    assert known.text == 'Missing effect found: dry friction in the drivetrain, left side'
    changed = headline(_diagnosis(Verdict.KNOWN, dry), changed=True)
    assert dict(changed.facts)['Size'] == (
        'dry friction of the left drivetrain 6.43 N·m (5.74 to 7.13)')
    moved = headline(_diagnosis(Verdict.KNOWN, _finding('com_shift', 'both')), changed=True)
    assert moved.text == 'What changed: shift of the centre of mass'


def test_sentences_call_numbers_by_their_labels() -> None:
    limit = _finding('command_limit', 'none', Estimate('limit_yaw', 0.99, 'rad/s', 0.98, 1.0))
    assert 'yaw rate 0.99 rad/s' in sentence(Effect('command_limit', shape='yaw'), None,
                                             limit.parameters, 'everywhere')
    facts = dict(headline(_diagnosis(Verdict.KNOWN, limit)).facts)
    assert facts['Effect'] == 'limit of the commanded speed or yaw rate'
    assert facts['Size'].startswith('yaw rate 0.99 rad/s')
    assert number_words('latency_later') == 'dead time'
    assert number_words('wheel_damping') == 'wheel damping'
