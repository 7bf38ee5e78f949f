# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The drive that tells two explanations apart."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from lg_husky_sim.api.robots import Husky
from lg_husky_sim.cli.main import run
from lg_husky_sim.diagnosis.planning import (
    drives,
    imitated,
    named_drive,
    plan,
    typical,
    usual_speeds,
)
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model, save_model
from lg_husky_sim.manoeuvres import load_manoeuvre
import numpy as np
import pytest


def test_drives_keep_to_the_limits_and_end_at_rest() -> None:
    for manoeuvre in drives(0.6, 0.4):
        values = manoeuvre.commands().values
        assert np.max(np.abs(values), axis=0) == pytest.approx(
            np.minimum(np.max(np.abs(values), axis=0), [0.6, 0.4]))
        assert not np.any(values[0])
        assert not np.any(values[-1])


def test_straight_run_tells_a_gyro_bias_from_a_smaller_wheel_and_a_spin_does_not() -> None:
    model = load_model()
    one, two = (typical(name, model.structure, model.parameters)
                for name in ('gyro_bias', 'wheel_radius_mismatch'))
    chosen = [m for m in drives(0.8, 0.8) if m.name in ('long_straight', 'spin_rates')]
    best, worst = plan(one, two, chosen)
    assert best.manoeuvre.name == 'long_straight'
    assert best.nats > 40.0 * worst.nats
    assert best.channel == 'yaw_rate'


def test_an_explanation_imitates_itself() -> None:
    model = load_model()
    one = typical('rolling_resistance', model.structure, model.parameters)
    (manoeuvre,) = (m for m in drives(0.8, 0.8) if m.name == 'two_speeds')
    assert imitated(one, one, manoeuvre)[0] < 0.5


def test_drive_is_named_in_words_where_one_decides() -> None:
    model = load_model()
    pair = ('gyro_bias', 'wheel_radius_mismatch')
    assert named_drive(pair, model.structure, model.parameters) == (
        'full speed ahead and back without a stop')
    assert named_drive(('slope', 'slope'), model.structure, model.parameters) == ''


def test_a_slower_robot_is_asked_no_more_than_a_husky() -> None:
    husky = load_model().parameters
    assert usual_speeds(husky) == (setting('planned_speed'), setting('planned_rate'))
    slow = husky.replacing({'command_gain': 4.0 * husky['command_gain'], 'wheel_radius': 0.05,
                            'track': 0.2})
    assert usual_speeds(slow)[0] == pytest.approx(setting('planned_speed') / 4.0)


def test_command_writes_a_script_that_can_be_driven(tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / 'script.yaml'
    assert run(['plan-drive', '--effects', 'yaw_scrub_coulomb,command_latency',
                '--out', str(out), '--max-speed', '0.5']) == 0
    script = load_manoeuvre(out)
    assert np.max(np.abs(script.commands().column('forward'))) <= 0.5
    assert 'yaw_scrub_coulomb' in script.about
    said = capsys.readouterr().out
    assert '[nats]' in said
    assert f'{script.about.split(";")[0]}' in said


def test_a_slower_robot_is_asked_for_less(tmp_path: Path, capsys: Any) -> None:
    """A Husky has its whole supply at 1.12 m/s, this one at 0.4 m/s."""
    robot, out = tmp_path / 'robot.yaml', tmp_path / 'script.yaml'
    Husky(mass=6.0, wheel_radius=0.05, track=0.24, turn_ratio=0.22, command_gain=2.5).save(robot)
    asked = ['plan-drive', '--effects', 'gyro_bias,payload', '--robot', str(robot), '--out',
             str(out)]
    assert run(asked) == 0
    assert 0.0 < np.max(np.abs(load_manoeuvre(out).commands().column('forward'))) < 0.3
    capsys.readouterr()
    assert run([*asked, '--max-speed', '4.0', '--json']) == 0
    assert np.max(np.abs(load_manoeuvre(out).commands().column('forward'))) > 1.0
    evidence = [row['evidence_nats'] for row in json.loads(capsys.readouterr().out)]
    assert len(evidence) > 3
    assert evidence == sorted(evidence, reverse=True)


@pytest.mark.parametrize(('arguments', 'code', 'message'), [
    ([], 2, 'either the folder'),
    (['--effects', 'slope'], 2, 'two different ids'),
    (['--effects', 'slope,slope'], 2, 'two different ids'),
    (['--effects', 'slope,sloppe'], 1, 'did you mean slope'),
    (['nowhere'], 1, 'not the folder of a diagnosis'),
])
def test_bad_input_is_one_line(arguments: list[str], code: int, message: str, tmp_path: Path,
                               capsys: Any) -> None:
    assert run(['plan-drive', *arguments, '--out', str(tmp_path / 's.yaml')]) == code
    text = capsys.readouterr().err
    assert text.startswith('error: ')
    assert text.count('\n') == 1
    assert message in text
    assert not (tmp_path / 's.yaml').exists()


def test_an_effect_that_is_there_is_taken_with_other_numbers() -> None:
    model = load_model()
    effect = Effect('command_latency')
    structure = model.structure.with_effect(effect)
    parameters = model.parameters.with_entries(*(p.parameter(0.1) for p in effect.parameters()))
    found = typical('command_latency', structure, parameters)
    assert found.structure.effects[-1].again
    plant = compile_model(found.structure).at(found.parameters)
    assert plant.sets[0].command.latency == found.parameters['latency_later'] != 0.1


def test_an_effect_that_shares_a_number_with_another_side_is_refused() -> None:
    model = load_model()
    effect = Effect('coulomb_drivetrain', 'left')
    parameters = model.parameters.with_entries(*(p.parameter() for p in effect.parameters()))
    for side in ('right', 'both'):
        with pytest.raises(ParameterError, match='share the parameter dry_torque'):
            typical('coulomb_drivetrain', model.structure.with_effect(effect), parameters, side)


def test_folder_of_two_diagnoses_is_refused(tmp_path: Path, capsys: Any) -> None:
    """The finding is in the model that the diagnosis wrote, or the files were mixed up."""
    for name in ('plain.yaml', 'model.yaml'):
        save_model(load_model(), tmp_path / name)
    (tmp_path / 'diagnosis.json').write_text(json.dumps({'findings': [{
        'effect': 'slope', 'rivals': [{'effect': 'gyro_bias', 'side': 'none'}]}]}))
    assert run(['plan-drive', str(tmp_path), '--out', str(tmp_path / 's.yaml')]) == 1
    assert 'model.yaml does not add it to plain.yaml' in capsys.readouterr().err
