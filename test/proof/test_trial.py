# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A whole trial: sealed first, blind, resumable, scored; with a diagnosis played by the test."""

from __future__ import annotations

import json
from pathlib import Path
import shutil
import sys

from click.testing import CliRunner
from lg_husky_sim.cli.main import cli
from lg_husky_sim.errors import CommandError, LgHuskyError
from lg_husky_sim.proof import trial
from lg_husky_sim.proof.cases import Spec
import pytest

SPECS = (Spec(3, 'clean'), Spec(4, 'single', effects=('rolling_resistance',),
                                severity='strong', onset='none'))


@pytest.fixture(scope='module')
def prepared(tmp_path_factory: pytest.TempPathFactory) -> trial.Folders:
    folders = trial.Folders(tmp_path_factory.mktemp('trial'))
    trial.keep_plan(folders, SPECS)
    trial.prepare(folders, SPECS, 1, lambda name: None)
    return folders


def play(monkeypatch: pytest.MonkeyPatch, folders: trial.Folders) -> list[list[str]]:
    """Let every diagnosis say "rolling resistance", with a model as good as the truth."""
    asked: list[list[str]] = []

    def run(arguments: list[str]) -> tuple[int, str]:
        asked.append(arguments)
        out = Path(arguments[arguments.index('--out') + 1])
        if 'diagnose' in arguments:
            out.mkdir(parents=True)
            (out / 'diagnosis.json').write_text(json.dumps({
                'verdict': 'known', 'confidence': 0.99, 'findings': [{
                    'effect': 'rolling_resistance', 'subsystem': 'translation'}]}))
        else:
            held = Path(arguments[arguments.index('--commands') + 1])
            truth = held.with_name(held.name.replace('held', 'truth'))
            shutil.copytree(truth, out)
        return 0, ''

    monkeypatch.setattr(trial, '_run', run)
    return asked


def test_a_trial_is_sealed_blind_resumed_and_scored(
        prepared: trial.Folders, monkeypatch: pytest.MonkeyPatch) -> None:
    sealed = json.loads(prepared.commitments.read_text())
    assert sorted(sealed) == ['case_0001', 'case_0002']
    asked = play(monkeypatch, prepared)
    done = list(trial.diagnose_all(prepared, sorted(sealed), 2))
    assert len(done) == 2
    for arguments in asked:
        if 'diagnose' in arguments:
            given = ' '.join(arguments)
            assert 'answers' not in given
            assert 'held' not in given
            assert 'rolling' not in given
    clean, single = trial.open_and_judge(prepared, sealed, sorted(sealed))
    assert (clean.kind, clean.verdict, single.top1) == ('clean', 'known', True)
    assert single.shares['all'] == pytest.approx(1.0)
    before = len(asked)
    assert len(list(trial.diagnose_all(prepared, sorted(sealed), 2))) == 2
    assert len(asked) == before, 'a resumed trial asks nothing again'


@pytest.mark.parametrize('code', trial.INTERRUPTED)
def test_what_was_interrupted_has_no_outcome(
        prepared: trial.Folders, monkeypatch: pytest.MonkeyPatch, code: int) -> None:
    """Ctrl-C reaches the diagnoses too; the next run asks them again."""
    folders = trial.Folders(prepared.root / f'stopped{code}')
    shutil.copytree(prepared.cases, folders.cases)
    monkeypatch.setattr(trial, 'command_for', lambda *_: [
        sys.executable, '-c', 'import os, sys; code = int(sys.argv[1])\n'
        'os.kill(os.getpid(), -code) if code < 0 else sys.exit(code)', str(code)])
    with pytest.raises(CommandError, match='interrupted'):
        list(trial.diagnose_all(folders, ['case_0001'], 1))
    assert not (folders.runs / 'case_0001' / 'outcome.json').exists()


def test_trials_are_counted_together(prepared: trial.Folders,
                                     monkeypatch: pytest.MonkeyPatch) -> None:
    play(monkeypatch, prepared)
    list(trial.diagnose_all(prepared, ['case_0001', 'case_0002'], 1))
    with pytest.raises(LgHuskyError, match='holds no scored trial'):
        trial.scored(prepared.root)
    facts = {'command': 'lg_husky prove', 'planned': 2, 'seal': 'ab', 'first_seed': 3,
             'last_seed': 4}
    (prepared.root / 'results.json').write_text(json.dumps({**facts, 'judgements': []}))
    judged, kept = trial.scored(prepared.root)
    assert [one.kind for one in judged] == ['clean', 'single']
    assert kept == {**facts, 'cases': 2}


def test_preparing_again_makes_nothing_new(prepared: trial.Folders) -> None:
    path = prepared.cases / 'case_0001/recordings/rec1/metadata.yaml'
    before = path.stat().st_mtime_ns
    trial.prepare(prepared, SPECS, 1, lambda name: None)
    assert path.stat().st_mtime_ns == before


def test_what_the_drives_cannot_show_is_drawn_again(tmp_path: Path) -> None:
    folders = trial.Folders(tmp_path)
    spec = Spec(1, 'outside', drive='paper', effects=('reverse_gain',), severity='medium')
    sealed = trial.prepare(folders, (spec,), 1, lambda _: None)
    (name,) = sealed
    answer = json.loads((folders.answers / f'{name}.json').read_text())
    assert answer['spec']['seed'] != 1
    assert [one['severity'] for one in answer['effects']] == ['medium']
    assert answer['effects'][0]['effect'] != 'reverse_gain'


def test_a_folder_holds_one_trial(prepared: trial.Folders) -> None:
    trial.keep_plan(prepared, SPECS)
    with pytest.raises(CommandError, match='holds another trial'):
        trial.keep_plan(prepared, SPECS[:1])


def test_a_case_without_outcome_is_not_scored(prepared: trial.Folders) -> None:
    with pytest.raises(LgHuskyError, match='case_0009 has no outcome yet'):
        trial.open_and_judge(prepared, {}, ['case_0009'])


def test_scoring_before_any_diagnosis_says_so(tmp_path: Path) -> None:
    with pytest.raises(LgHuskyError, match='is diagnosed yet'):
        trial.diagnosed(trial.Folders(tmp_path), ['case_0001'])


def test_the_command_line_names_baselines_and_recordings(tmp_path: Path) -> None:
    folders = trial.Folders(tmp_path)
    for name in ('recordings/rec1', 'recordings/rec2', 'baseline/base1'):
        (folders.cases / 'case_0001' / name).mkdir(parents=True)
    line = trial.command_for(folders, 'case_0001', tmp_path / 'out')
    assert [Path(part).name for part in line[4:6]] == ['rec1', 'rec2']
    assert Path(line[line.index('--baseline') + 1]).name == 'base1'


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--report', '--seed', '5'], 'seed = 5 is a tuning seed; a report needs 10000 or more'),
    (['--seed', '9999', '--cases', '2'], 'reach the reporting seeds'),
])
def test_seeds_of_the_other_kind_are_refused(tmp_path: Path, arguments: list[str],
                                             message: str) -> None:
    result = CliRunner().invoke(cli, ['prove', *arguments, '--out', str(tmp_path / 'out')])
    assert isinstance(result.exception, CommandError)
    assert message in str(result.exception)
    assert not (tmp_path / 'out').exists()


def test_each_trial_counts_once(tmp_path: Path) -> None:
    for pooled in (['--pool', str(tmp_path / 'out')],
                   ['--pool', str(tmp_path / 'one'), '--pool', str(tmp_path / 'one')]):
        result = CliRunner().invoke(cli, ['prove', *pooled, '--out', str(tmp_path / 'out')])
        assert isinstance(result.exception, CommandError)
        assert 'each trial counts once' in str(result.exception)
    assert not (tmp_path / 'out').exists()
