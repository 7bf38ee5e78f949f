# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that take several words after one flag, as the command lines in the wild are written."""

from __future__ import annotations

import click
from click.testing import CliRunner
from lg_husky_sim.cli.main import cli
from lg_husky_sim.cli.several import SeveralWords
import pytest


@click.command(cls=SeveralWords)
@click.argument('recordings', nargs=-1, required=True)
@click.option('--out')
@click.option('--baseline', multiple=True, metavar='REC [REC …]')
@click.option('--set', 'settings', multiple=True, metavar='NAME=VALUE […]')
@click.option('--free', multiple=True, metavar='NAMES')
@click.option('--report/--no-report', default=True)
def _echo(recordings: tuple[str, ...], out: str | None, baseline: tuple[str, ...],
          settings: tuple[str, ...], free: tuple[str, ...], report: bool) -> None:
    click.echo('|'.join((' '.join(recordings), ' '.join(baseline), ' '.join(settings),
                         ' '.join(free), out or '', str(report))))


@pytest.mark.parametrize(('line', 'recordings', 'baseline', 'settings', 'free'), [
    ('a b --out o --baseline x y', 'a b', 'x y', '', ''),
    ('a b --baseline x y --out o', 'a b', 'x y', '', ''),
    ('--baseline x y --out o a b', 'a b', 'x y', '', ''),
    ('a b --baseline x --baseline y --out o', 'a b', 'x y', '', ''),
    ('--out o --baseline x --baseline y a b', 'a b', 'x y', '', ''),
    ('--out o --baseline=x a b', 'a b', 'x', '', ''),
    ('--out o --baseline x y --no-report a b', 'a b', 'x y', '', ''),
    ('--baseline x y --out o -- a -b', 'a -b', 'x y', '', ''),
    ('a --set m=1 n=2 --set k=3 b --out o', 'a b', '', 'm=1 n=2 k=3', ''),
    ('a --out o --set m=1 n=2 b', 'a b', '', 'm=1 n=2', ''),
    ('--out o --baseline x a', 'a', 'x', '', ''),
    ('--out o --free x a b', 'a b', '', '', 'x'),
    ('a --free x b --out o', 'a b', '', '', 'x'),
])
def test_words_go_where_they_belong(line: str, recordings: str, baseline: str, settings: str,
                                    free: str) -> None:
    result = CliRunner().invoke(_echo, line.split())
    report = '--no-report' not in line
    assert result.output.strip() == '|'.join((recordings, baseline, settings, free, 'o',
                                              str(report)))


@pytest.mark.parametrize('line', [
    '--baseline x y a --out o', '--out o --baseline x y a b',
    '--baseline x y --baseline z a', '--baseline x y --out o --baseline z a b'])
def test_words_that_may_belong_to_either_are_refused(line: str) -> None:
    result = CliRunner().invoke(_echo, line.split())
    assert result.exit_code != 0
    assert 'all words follow --baseline' in result.output


def test_a_verb_without_arguments_gives_a_flag_all_its_words() -> None:
    command = cli.get_command(click.Context(cli), 'evaluate')
    assert command is not None
    words = ['--out', 'e', '--calibrate', 'a', '--held-out', 'b', 'c', '--steps', 'd', 'f']
    context = command.make_context('evaluate', words)
    assert context.params['held_out'] == ('b', 'c')
    assert context.params['steps'] == ('d', 'f')


def test_a_flag_without_its_word_is_said() -> None:
    result = CliRunner().invoke(_echo, ['a', '--baseline'])
    assert result.exit_code != 0
    assert '--baseline' in result.output


@pytest.mark.parametrize(('verb', 'several'), [
    ('diagnose', {'baselines', 'settings', 'topics'}), ('compare', {'settings', 'topics'}),
    ('evaluate', {'held_out', 'steps', 'rivals', 'settings', 'topics'}),
    ('identify', {'settings', 'topics'}), ('simulate', {'settings', 'topics'}),
    ('play', {'topics'}),
])
def test_the_verbs_say_which_options_take_several(verb: str, several: set[str]) -> None:
    command = cli.get_command(click.Context(cli), verb)
    assert isinstance(command, SeveralWords)
    assert {one.name for one in command.params
            if isinstance(one, click.Option) and '…' in (one.metavar or '')} == several
