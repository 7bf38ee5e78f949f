# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Mistyped words and places that cannot be written are answered by what the user gave."""

from __future__ import annotations

from pathlib import Path

import lg_husky_sim as lg
from lg_husky_sim.cli.main import run
from lg_husky_sim.errors import GraphError, ParameterError
from lg_husky_sim.husky.effects import effect_kind
import pytest

GRAPH = """
elements:
  F: {is: force source, from: ground, to: m}
  M: {is: mass, from: m, value: 2}
outputs: [v(M)]
"""


@pytest.mark.parametrize('verb', [
    ['info', 'x'], ['simulate', '--commands', 'circle', '--out', 'x'],
    ['compare', 'x', '--out', 'x'], ['identify', 'x', '--out', 'x.yaml'],
    ['diagnose', 'x', '--out', 'x'], ['evaluate', '--out', 'x']])
@pytest.mark.parametrize(('option', 'said'), [
    (['--set', 'mass'], "--set 'mass' is not of the form NAME=VALUE with a number (see lg_husky "),
    (['--set', 'mass=abc'], "--set 'mass=abc' is not of the form NAME=VALUE"),
    (['--set', 'mass=60', '--set', 'mass=70'], "--set 'mass=70': mass is given twice"),
    (['--topic', 'foo'], "topic choice 'foo' must be ROLE=NAME with ROLE one of command, ")])
def test_a_choice_that_cannot_be_understood_ends_with_2(
        verb: list[str], option: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*verb, *option]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(('arguments', 'said'), [
    (['prove', '--calibrate'], '--calibrate needs --from FILE.jsonl'),
    (['prove', '--from', __file__, '--out', 'x'], '--from recomputes the figures'),
    (['plan-drive', '--out', 'x'], 'give either the folder of a diagnosis or --effects A,B'),
    (['plan-drive', '--effects', 'slope', '--out', 'x'], "--effects 'slope': expected two"),
    (['evaluate', '--out', 'x', '--rival', 'x'], '--held-out and --rival need --calibrate REC'),
    (['derive', ''], "'' names nothing; leave it out for the default"),
    (['identify', 'x', '--out', 'x.yaml', '--free', ''], "'' names nothing; leave it out"),
    (['identify', 'x', '--out', 'x.yaml', '--effects', ' , '], "' , ' names nothing; leave it"),
    (['simulate', '--commands', '', '--out', 'x'], "'' names nothing; leave it out"),
    (['info', ''], "'' names no file or folder"),
    (['compare', '', '--out', 'x'], "'' names no file or folder"),
    (['parameters', ''], "'' names no file or folder"),
    (['effects', ''], "'' names nothing; leave it out")])
def test_a_command_that_contradicts_itself_or_names_nothing_ends_with_2(
        arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(arguments) == 2
    error, = capsys.readouterr().err.splitlines()
    assert said in error
    assert error.endswith(f'(see lg_husky {arguments[0]} -h)')


@pytest.mark.parametrize(('arguments', 'said'), [
    (['schema', 'modle'],
     "'modle' is not one of graph, model, commands, sim_node; did you mean model?"),
    (['identify', 'drive', '--out', 'x.yaml', '--method', 'least-square'],
     "'least-square' is not one of least-squares, ga, de; did you mean least-squares?")])
def test_a_mistyped_choice_gets_the_nearest_one(
        arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(arguments) == 2
    assert said in capsys.readouterr().err


def test_a_letter_is_not_taken_for_half_of_the_catalogue() -> None:
    with pytest.raises(ParameterError) as caught:
        effect_kind('a')
    assert str(caught.value).startswith("unknown effect 'a' (known: ")
    with pytest.raises(ParameterError, match='did you mean yaw_scrub_coulomb or yaw_scrub_speed'):
        effect_kind('scrub')


def test_one_input_is_one() -> None:
    with pytest.raises(GraphError, match=r"unknown input 'G'; there is F$"):
        lg.graph(GRAPH).step(source='G')
    with pytest.raises(ParameterError, match=r"no output 'x'; there is v\(M\)$"):
        lg.graph(GRAPH).step().column('x')


@pytest.mark.skipif(not Path('/proc/self').exists(), reason='a folder that takes no file')
@pytest.mark.parametrize('arguments', [
    ['simulate', '--commands', 'spin', '--out', '/proc/none'],
    ['derive', '--picture', '/proc/none.svg'], ['derive', '--export', '/proc/none.json']])
def test_what_cannot_be_written_is_called_as_it_was_given(
        arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(arguments) == 1
    error, = (line for line in capsys.readouterr().err.splitlines() if 'error' in line)
    assert error.startswith(f'error: {arguments[-1]}: ')


@pytest.fixture(scope='module')
def drive(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(lg.Husky().simulate('spin').save(tmp_path_factory.mktemp('bags') / 'drive'))


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no work begin."""
    def begun(*_: object, **__: object) -> None:
        pytest.fail('the work has begun')
    for name in ('identification.session.read_recording', 'identification.session.run_tasks',
                 'api.identifying.read_all', 'api.comparing.read_all', 'diagnosis.planning.plan'):
        monkeypatch.setattr(f'lg_husky_sim.{name}', begun)


@pytest.mark.usefixtures('idle')
@pytest.mark.parametrize('each', [[], ['--each']])
@pytest.mark.parametrize('more', [['--free', 'wheel_damping'], []])
def test_a_profile_of_what_is_not_estimated_is_refused_before_the_fit(
        drive: str, tmp_path: Path, each: list[str], more: list[str],
        capsys: pytest.CaptureFixture[str]) -> None:
    assert run(['identify', drive, '--out', str(tmp_path / 'x.yaml'), '--profile', 'mass', *more,
                *each]) == 1
    assert "error: no profile of 'mass': it is not estimated (estimated: wheel_damping" in (
        capsys.readouterr().err)


@pytest.mark.usefixtures('idle')
@pytest.mark.skipif(not Path('/proc/self').exists(), reason='a folder that takes no file')
@pytest.mark.parametrize('arguments', [
    ['identify', 'DRIVE', '--out', '/proc/none.yaml'],
    ['plan-drive', '--effects', 'payload,slope', '--out', '/proc/none.yaml'],
    ['compare', 'DRIVE', '--out', 'OUT', '--trajectories', '/proc/none'],
    ['compare', 'DRIVE', '--out', 'OUT', '--bag', '/proc/none']])
def test_a_place_that_cannot_be_written_is_refused_before_the_work(
        arguments: list[str], drive: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    words = {'DRIVE': drive, 'OUT': str(tmp_path / 'out')}
    assert run([words.get(word, word) for word in arguments]) == 1
    assert f'error: {arguments[-1]} cannot be written: /proc: ' in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(('taken', 'said'), [
    ('tum', 'tum exists and is not a folder'), ('tum/drive_paper.tum', 'drive_paper.tum exists'),
    ('signals.foxglove.json', 'signals.foxglove.json exists')])
def test_compare_writes_all_or_nothing_where_a_place_is_taken(
        taken: str, said: str, drive: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    mine = tmp_path / taken
    mine.parent.mkdir(exist_ok=True)
    mine.write_text('my own\n')
    assert run(['compare', drive, '--out', str(tmp_path / 'out'), '--figures', '0', '--bag',
                str(tmp_path / 'signals'), '--trajectories', str(tmp_path / 'tum')]) == 1
    assert said in capsys.readouterr().err
    assert [path for path in tmp_path.rglob('*') if path.is_file()] == [mine]


def test_compare_replaces_a_bag_as_its_message_says(
        drive: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = tmp_path / 'signals'
    arguments = ['compare', drive, '--out', str(tmp_path / 'out'), '--figures', '0', '--bag',
                 str(bag)]
    assert run(arguments) == 0
    first = (bag / 'metadata.yaml').stat().st_ino
    assert run(arguments) == 1
    assert 'or allow it to be replaced (--overwrite' in capsys.readouterr().err
    assert run([*arguments, '--overwrite']) == 0
    assert (bag / 'metadata.yaml').stat().st_ino != first


def test_a_model_is_saved_where_it_can_be_read(tmp_path: Path) -> None:
    path = lg.Husky().save(tmp_path / 'new' / 'model.yaml')
    assert [one.name for one in path.parent.iterdir()] == ['model.yaml']
    assert path.stat().st_mode & 0o400
    with pytest.raises(OSError, match=r'none\.yaml') as caught:
        lg.Husky().save('/proc/none.yaml')
    assert caught.value.filename == '/proc/none.yaml'


def test_a_factor_between_sensors_has_its_unit_and_width() -> None:
    table = str(lg.Husky().simulate('s_bend').info())
    line = next(line for line in table.splitlines() if line.startswith('speed'))
    assert ' m/rad ' in line
    assert '±0.0000 ' not in line
    gyro = next(line for line in table.splitlines() if line.startswith('yaw rate  imu'))
    assert 'm/rad' not in gyro
