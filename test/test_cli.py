# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line as its users meet it: help, bad input in one line, interrupts, speed."""

from __future__ import annotations

from importlib.util import find_spec
import os
from pathlib import Path
import signal
import subprocess
import sys
import textwrap

import click
from click.testing import CliRunner
from lg_husky_sim.cli import main
import pytest

PRESENT = [verb for verb, module in main.VERBS.items() if find_spec(module) is not None]
ROOT = Path(__file__).resolve().parent.parent


def lg_husky(*arguments: str, cwd: Path | None = None,
             **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command as a process, as a user does."""
    return subprocess.run(
        [sys.executable, '-m', 'lg_husky_sim.cli.main', *arguments], cwd=cwd, text=True,
        capture_output=True, timeout=120, check=False, env={**os.environ, **environment})


def assert_one_line_error(done: subprocess.CompletedProcess[str], *words: str, code: int = 1
                          ) -> None:
    assert done.returncode == code, done
    assert done.stderr.startswith('error: '), done.stderr
    assert done.stderr.count('\n') == 1, done.stderr
    assert done.stdout == ''
    for word in words:
        assert word in done.stderr


@pytest.fixture
def verb_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Put a verb `act` in place whose one argument says how it ends."""
    (tmp_path / 'lg_husky_test_verb.py').write_text(textwrap.dedent("""
        import click
        from lg_husky_sim.errors import ParameterError

        @click.command()
        @click.argument('how')
        def command(how):
            if how == 'ours':
                raise ParameterError('mass = -1 kg is below\\nits lower bound 0')
            if how == 'several':
                raise ParameterError('2 errors\\n  mass is missing\\n  track is missing')
            if how == 'file':
                open('/nonexistent/file')
            if how == 'interrupt':
                raise KeyboardInterrupt
            if how == 'bug':
                raise ZeroDivisionError('a bug')
            if how == 'code':
                raise SystemExit(3)
            click.echo('done')
    """))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(main.VERBS, 'act', 'lg_husky_test_verb')
    return 'act'


@pytest.mark.parametrize(('how', 'code', 'said'), [
    ('ours', 1, 'error: mass = -1 kg is below its lower bound 0\n'),
    ('several', 1, 'error: 2 errors\n  mass is missing\n  track is missing\n'),
    ('file', 1, 'error: /nonexistent/file: No such file or directory\n'),
    ('interrupt', 130, 'interrupted\n'),
    ('well', 0, ''),
])
def test_ends_become_exit_codes_and_one_line(
        verb_from: str, capsys: pytest.CaptureFixture[str], how: str, code: int,
        said: str) -> None:
    assert main.run([verb_from, how]) == code
    assert capsys.readouterr().err.strip() == said.strip()


def test_a_bug_keeps_its_traceback(verb_from: str) -> None:
    with pytest.raises(ZeroDivisionError, match='a bug'):
        main.run([verb_from, 'bug'])


def test_a_mistyped_verb_gets_a_suggestion_and_lists_those_there_are() -> None:
    assert_one_line_error(lg_husky('identfy'), 'did you mean identify?', *PRESENT, code=2)


def test_without_arguments_the_help_appears() -> None:
    done = lg_husky()
    assert (done.returncode, done.stderr) == (0, '')
    assert 'Usage: lg_husky' in done.stdout


@pytest.mark.parametrize('verb', PRESENT)
def test_each_verb_explains_itself_and_each_option(verb: str) -> None:
    result = CliRunner().invoke(main.cli, [verb, '-h'])
    assert result.exit_code == 0, result.output
    command = main.cli.get_command(click.Context(main.cli), verb)
    assert command is not None
    assert command.get_short_help_str()
    for parameter in command.params:
        if isinstance(parameter, click.Option) and not parameter.hidden:
            assert parameter.help, f'{verb} {parameter.opts[0]} has no help'


@pytest.mark.parametrize('verb', PRESENT)
def test_unknown_option_is_one_line(verb: str) -> None:
    assert_one_line_error(lg_husky(verb, '--no-such-option'), '--no-such-option', f'{verb} -h',
                          code=2)


def test_verbs_that_are_not_installed_are_not_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(main.VERBS, 'absent', 'lg_husky_sim.cli.no_such_module')
    assert 'absent' not in main.cli.list_commands(click.Context(main.cli))
    assert 'absent' not in CliRunner().invoke(main.cli, ['-h']).output


@pytest.mark.parametrize(('what', 'slow'), [
    ('from lg_husky_sim.cli.main import run\nrun(["-h"])',
     {'sympy', 'scipy', 'matplotlib', 'rosbags', 'numba', 'mujoco', 'cyclonedds'}),
    ('import lg_husky_sim.diagnosis.diagnose',
     {'scipy.stats', 'scipy.signal', 'sympy', 'matplotlib'})])
def test_nothing_slow_or_optional_is_loaded_before_it_is_needed(what: str, slow: set[str]
                                                                ) -> None:
    ask = (f'import sys\n{what}\n'
           f'sys.exit(", ".join(sorted({slow} & set(sys.modules))) or None)')
    done = subprocess.run([sys.executable, '-c', ask], text=True, capture_output=True,
                          timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, '')


def test_ctrl_c_ends_a_running_verb_with_130(verb_from: str, tmp_path: Path) -> None:
    (tmp_path / 'lg_husky_test_verb.py').write_text(
        'import click, time\n\n@click.command()\ndef command():\n'
        '    print("running", flush=True)\n    time.sleep(60)\n')
    # A shell's background jobs, such as CI's, are born deaf to SIGINT.
    start = ('import signal\n'
             'signal.signal(signal.SIGINT, signal.default_int_handler)\n'
             'from lg_husky_sim.cli import main\n'
             'main.VERBS["act"] = "lg_husky_test_verb"\nmain.main()')
    with subprocess.Popen([sys.executable, '-c', start, verb_from], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          env={**os.environ, 'PYTHONPATH': f'{tmp_path}:{ROOT}'}) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == 'running\n'
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=30)
    assert process.returncode == 130
    assert said.strip() == 'interrupted'


def test_a_reader_that_leaves_is_no_error() -> None:
    done = subprocess.run(['bash', '-c', f'{sys.executable} -m lg_husky_sim.cli.main -h | true'],
                          text=True, capture_output=True, timeout=60, check=False)
    assert done.stderr == ''


def test_version_is_the_one_of_the_package() -> None:
    done = lg_husky('--version')
    assert done.returncode == 0
    assert done.stdout.strip() == f'lg_husky, version {main.version()}'
    assert f"version='{main.version()}'" in (ROOT / 'setup.py').read_text(encoding='utf-8')
