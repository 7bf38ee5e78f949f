# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How verbs speak: JSON, quiet, one line a stage, completion, and what they list."""

from __future__ import annotations

import io
import json
from pathlib import Path
import re
import subprocess
import sys
from typing import Any

import click
from click.shell_completion import ShellComplete
from click.testing import CliRunner
import lg_husky_sim as lg
from lg_husky_sim.api.tables import Table
from lg_husky_sim.cli import main
from lg_husky_sim.cli.common import BRIEF, Output
from lg_husky_sim.cli.terminal import print_table
from lg_husky_sim.errors import SettingsError
from lg_husky_sim.husky.effects import catalogue
from lg_husky_sim.manoeuvres import builtin_manoeuvres
import pytest


def run(*arguments: str) -> Any:
    """Run a verb in this process; standard output and error apart."""
    return CliRunner().invoke(main.cli, list(arguments), catch_exceptions=False)


@pytest.fixture(scope='module')
def drive(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(lg.Husky().simulate('s_bend').save(tmp_path_factory.mktemp('bags') / 'drive'))


def completions(words: list[str], incomplete: str) -> tuple[list[str], set[str]]:
    """Return what the shell would offer, and the kinds of it (plain, file)."""
    complete = ShellComplete(main.cli, {}, 'lg_husky', '_LG_HUSKY_COMPLETE')
    found = complete.get_completions(words, incomplete)
    return [item.value for item in found], {item.type for item in found}


def test_diagnose_takes_what_other_programs_call_it_with() -> None:
    """Scorers and scripts pass all of these; an option that goes breaks each of them."""
    verb = main.cli.get_command(click.Context(main.cli), 'diagnose')
    assert verb is not None
    assert {'--out', '--baseline', '--robot', '--set', '--seed', '--jobs'} <= {
        name for option in verb.params for name in option.opts}


@pytest.mark.parametrize('verb', ['compare', 'identify', 'diagnose', 'info'])
def test_recordings_are_completed_as_files(verb: str) -> None:
    assert completions([verb], '') == ([''], {'file'})
    assert completions([verb, 'one'], 'tw') == (['tw'], {'file'})


def test_effects_parameters_and_manoeuvres_are_completed() -> None:
    assert set(completions(['effects'], '')[0]) == set(catalogue())
    assert completions(['identify', '--effects'], 'torque_ripple,gyro_b')[0] == [
        'torque_ripple,gyro_bias']
    assert 'wheel_radius=' in completions(['simulate', '--set'], 'wheel_r')[0]
    assert completions(['identify', '--free'], 'mass,track')[0] == ['mass,track']
    assert set(completions(['simulate', '--commands'], '')[0]) == set(builtin_manoeuvres())
    assert completions(['simulate', '--commands'], 'bags/') == (['bags/'], {'file'})
    assert completions(['derive', '--model'], 'exp')[0] == ['expanded']


def test_the_catalogue_is_listed_without_making_a_mistake() -> None:
    said = run('effects').output
    assert all(name in said for name in catalogue())
    one = json.loads(run('effects', 'coulomb_drivetrain', '--json').output)
    assert {row['parameter'] for row in one} == {'dry_torque', 'dry_speed', 'breakaway_share',
                                                 'breakaway_speed'}
    assert {row['estimated'] for row in one} <= {True, False}
    every = {row['effect']: row for row in json.loads(run('effects', '--json').output)}
    assert every['encoder_scale']['sides'] == ['left', 'right']
    assert every['payload']['sides'] == []
    assert every['payload']['what_it_is']
    assert '  left, right  ' in said


def test_an_effect_says_what_shows_it_and_what_to_change() -> None:
    said = run('effects', 'coulomb_drivetrain').output
    assert 'Drives that bring it out\n  - ' in said
    assert 'turn the wheels by hand (<where>): <dry_torque> N·m of dry friction' in said
    assert 'In angle brackets\n  - numbers and words that the report of a diagnosis' in said
    assert 'In angle brackets' not in run('effects', 'gyro_sign').output
    assert '`friction` in the URDF' in said
    assert '<code>friction</code>' in lg.list_effects('coulomb_drivetrain').html()
    assert all('{' not in str(lg.list_effects(name)) for name in catalogue())
    assert '<limit_yaw>' in drawn(lg.list_effects('command_limit'), 80)


def test_manoeuvres_and_parameters_are_listed(tmp_path: Path) -> None:
    assert {row['manoeuvre'] for row in json.loads(run('manoeuvres', '--json').output)} == set(
        builtin_manoeuvres())
    path = lg.Husky(mass=60.0).save(tmp_path / 'heavy.yaml')
    rows = json.loads(run('parameters', str(path), '--json').output)
    assert next(row['value'] for row in rows if row['parameter'] == 'mass') == 60.0
    free = {row['parameter']: row['free'] for row in rows}
    assert free['wheel_damping'] is True
    assert free['gear_ratio'] is False


def test_verbs_that_show_a_model_take_it_as_robot(tmp_path: Path) -> None:
    path = str(lg.Husky(mass=60.0, about='The heavy one').save(tmp_path / 'heavy.yaml'))
    for option in ('--robot', '--model'):
        rows = json.loads(run('parameters', option, path, '--json').output)
        assert next(row['value'] for row in rows if row['parameter'] == 'mass') == 60.0
        assert run('derive', option, path).output.startswith('The heavy one\n')
    for verb, said in (('parameters', 'one model is listed'), ('derive', 'one graph is derived')):
        done = run(verb, path, '--robot', path)
        assert done.exit_code == 2
        assert said in done.output


def test_info_says_what_a_bag_is_good_for(drive: str) -> None:
    said = run('info', drive)
    assert said.exit_code == 0
    assert 'Enough for a diagnosis.' in said.output
    (data,) = json.loads(run('info', drive, '--json').stdout)
    assert data['enough_for_diagnose'] is True
    assert {row['stream'] for row in data['streams']} >= {'command', 'wheels', 'imu', 'pose'}


def test_info_takes_a_folder_of_bags(drive: str, tmp_path: Path) -> None:
    for name in ('a', 'b'):
        lg.read(drive).save(tmp_path / name)
    names = [one['name'] for one in json.loads(run('info', str(tmp_path), '--json').stdout)]
    assert names == ['a', 'b']


def test_compare_prints_the_json_that_it_writes(drive: str, tmp_path: Path) -> None:
    done = run('compare', drive, '--model', 'paper', '--out', str(tmp_path / 'out'), '--figures',
               '0', '--json', '-q', '--bag', str(tmp_path / 'signals'), '--trajectories',
               str(tmp_path / 'tum'))
    assert json.loads(done.stdout) == json.loads(
        (tmp_path / 'out' / 'compare.json').read_text('utf-8'))
    assert done.stderr == ''
    assert {path.name for path in tmp_path.iterdir()} == {
        'out', 'signals', 'signals.foxglove.json', 'signals.plotjuggler.xml', 'tum'}


def test_a_page_is_opened_only_when_asked_for(
        drive: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(click, 'launch', opened.append)
    arguments = ['compare', drive, '--out', str(tmp_path / 'out'), '--figures', '0']
    run(*arguments)
    assert opened == []
    run(*arguments, '--open')
    assert opened == [str(tmp_path / 'out' / 'index.html')]


def test_the_page_says_which_verbs_have_no_result_to_print() -> None:
    page = (Path(__file__).parents[1] / 'docs' / 'command_line.md').read_text(encoding='utf-8')
    said = page.split('`demo`, `drive`', 1)[1].split('print no JSON')[0]
    context = click.Context(main.cli)
    without = {name for name in main.cli.list_commands(context)
               if 'as_json' not in {option.name for option in main.cli.get_command(
                   context, name).params}}  # type: ignore[union-attr]
    assert {'demo', 'drive', *re.findall('`([a-z-]+)`', said)} == without


def test_quiet_and_verbose_exclude_each_other() -> None:
    with pytest.raises(click.UsageError, match='exclude each other'):
        CliRunner().invoke(main.cli, ['manoeuvres', '-q', '-v'], standalone_mode=False,
                           catch_exceptions=False)


def test_verbose_tells_stages_and_where_an_error_comes_from(drive: str, tmp_path: Path) -> None:
    (tmp_path / 'torn.mcap').write_bytes(b'no bag')
    done = subprocess.run(
        [sys.executable, '-m', 'lg_husky_sim.cli.main', 'info', '-v', drive,
         str(tmp_path / 'torn.mcap')], text=True, capture_output=True, timeout=120, check=False)
    lines = done.stderr.splitlines()
    assert done.returncode == 1
    assert lines[0].endswith('reading drive')
    assert 'Traceback (most recent call last):' in done.stderr
    assert lines[-1].startswith('error: cannot read')


def test_without_a_terminal_long_work_tells_each_stage_and_short_work_nothing(
        capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr('lg_husky_sim.api.progress.time.monotonic', lambda: now[0])
    with Output().stages() as report:
        report('reading', 0.0)
        assert capsys.readouterr().err == ''
        for stage, now[0] in (('fitting', 2.0 * BRIEF), ('fitting', 5.0), ('drawing', 61.5)):
            report(stage, 0.5)
    assert [line.split() for line in capsys.readouterr().err.splitlines()] == [
        ['2.0', 's', '50%', 'fitting'], ['61.5', 's', '50%', 'drawing']]
    with Output(quiet=True).stages() as report:
        now[0] = 100.0
        report('silent', 1.0)
    assert capsys.readouterr().err == ''


def drawn(table: Table, width: int) -> str:
    """Return a table as it stands on a terminal."""
    from rich.console import Console
    console = Console(width=width, file=io.StringIO(), record=True)
    print_table(table, console)
    return str(console.export_text())


def test_tables_of_the_terminal_hold_the_same_cells_and_units() -> None:
    for table in (lg.list_manoeuvres(), lg.list_effects('torque_ripple')):
        text = drawn(table, 200)
        assert all(str(cell) in text for row in table.rows for cell in row
                   if isinstance(cell, str))
        assert all(name in text for name in table.columns), 'rich took [s] for a markup'


@pytest.mark.parametrize('width', [30, 60, 80])
def test_a_narrow_terminal_breaks_no_word_of_a_table(width: int) -> None:
    for table in (lg.list_manoeuvres(), lg.list_effects(), lg.Husky().table()):
        said = ' '.join(str(cell) for row in table.rows for cell in row if isinstance(cell, str))
        assert set(said.split()) <= set(drawn(table, width).split())


def test_a_narrow_terminal_breaks_a_topic_at_its_names() -> None:
    table = Table('Streams', ('stream', 'topic', 'longest gap [s]'), (
        ('command', '/husky_velocity_controller/cmd_vel', 0.05), ('turn', 'in m/rad', None)))
    lines = drawn(table, 50).splitlines()
    assert [line.split()[-1] for line in lines if '/' in line] == [
        '0.05', '/cmd_vel', '–']
    assert max(map(len, lines)) <= 50
    assert '/husky_velocity_controller' in lines[4]


def test_a_bag_is_replaced_only_with_overwrite_and_the_message_says_so(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ['simulate', '--commands', 'straight', '--out', str(tmp_path / 'bag')]
    assert main.run(arguments) == 0
    assert main.run(arguments) == 1
    assert '--overwrite' in capsys.readouterr().err
    assert main.run([*arguments, '--overwrite']) == 0


def test_paper_names_the_packaged_model_unless_a_file_is_called_so(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert lg.Husky('paper').model == lg.Husky().model
    monkeypatch.chdir(tmp_path)
    lg.Husky(mass=60.0).save('paper')
    assert lg.Husky('paper').parameters['mass'] == 60.0


def test_derive_prints_numbers_and_exports_them(tmp_path: Path) -> None:
    path = tmp_path / 'husky.json'
    said = run('derive', '--export', str(path))
    assert 'With the numbers of the model' in said.stdout
    assert '-2090.91' in said.stdout
    assert json.loads(path.read_text('utf-8')) == json.loads(run('derive', '--json').stdout)


def test_a_diagnosis_without_end_is_refused(tmp_path: Path) -> None:
    """The reader of JSON calls itself for each bracket."""
    (tmp_path / 'diagnosis.json').write_text('[' * 100_000, encoding='utf-8')
    with pytest.raises(SettingsError, match='is not a diagnosis: maximum recursion'):
        run('plan-drive', str(tmp_path), '--out', str(tmp_path / 'drive.yaml'))


@pytest.mark.parametrize('verb', ['info', 'simulate', 'identify', 'evaluate', 'diagnose',
                                  'compare', 'twin', 'demo'])
def test_a_robot_is_given_to_every_verb_by_the_same_word(verb: str) -> None:
    command = main.cli.get_command(click.Context(main.cli), verb)
    assert command is not None
    flags = next(one.opts for one in command.params if '--model' in one.opts)
    assert '--robot' in flags


def test_what_a_drive_can_determine_is_said_of_the_robot_that_is_given(drive: str, tmp_path: Path
                                                                       ) -> None:
    lg.Husky(mass=90.0, command_gain=0.7).save(tmp_path / 'robot.yaml')
    said = run('info', drive, '--robot', str(tmp_path / 'robot.yaml'), '--json')
    assert '0.7' in said.stdout
    assert said.stdout != run('info', drive, '--json').stdout


def test_the_page_names_the_verbs_that_set_and_choose() -> None:
    text = (Path(__file__).resolve().parent.parent / 'docs' / 'command_line.md').read_text('utf-8')
    said = re.search(
        r'`--set` is an option of (.*?), `--topic` of these and (.*?);', text, re.DOTALL)
    assert said is not None
    setting, more = (set(re.findall(r'`([\w-]+)`', part)) for part in said.groups())
    context = click.Context(main.cli)
    forms: dict[str, set[str | None]] = {}
    for name in main.cli.list_commands(context):
        command = main.cli.get_command(context, name)
        assert command is not None
        forms[name] = {one.metavar for one in command.params}
    assert {name for name, form in forms.items() if 'NAME=VALUE […]' in form} == setting
    assert {name for name, form in forms.items() if 'ROLE=NAME […]' in form} == setting | more
