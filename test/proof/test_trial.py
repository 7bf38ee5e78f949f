# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A whole trial: sealed first, blind, resumable, scored; with a diagnosis played by the test."""

from __future__ import annotations

import json
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys

from click.testing import CliRunner
from lg_husky_sim.cli.main import cli
from lg_husky_sim.errors import CommandError, LgHuskyError
from lg_husky_sim.proof import outcomes, trial
from lg_husky_sim.proof.cases import Spec
from lg_husky_sim.proof.scoring import judge
import pytest

SHORT = (10.0, 11.0)
SPECS = (Spec(3, 'clean', wheels='difference', floor='smooth', seconds=SHORT, complete=True),
         Spec(4, 'single', effects=('rolling_resistance',), severity='strong', onset='none',
              wheels='difference', floor='smooth', seconds=SHORT, complete=True))


@pytest.fixture(scope='module')
def prepared(tmp_path_factory: pytest.TempPathFactory) -> trial.Folders:
    folders = trial.Folders(tmp_path_factory.mktemp('trial'))
    trial.keep_plan(folders, SPECS)
    trial.prepare(folders, SPECS, 1, lambda name: None)
    return folders


def play(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Let every diagnosis say "rolling resistance", with a model as good as the truth."""
    asked: list[list[str]] = []

    def run(arguments: list[str]) -> tuple[int, str]:
        asked.append(arguments)
        out = Path(arguments[arguments.index('--out') + 1])
        if 'diagnose' in arguments:
            out.mkdir(parents=True)
            (out / 'diagnosis.json').write_text(json.dumps({
                'verdict': 'known', 'confidence': 0.99, 'findings': [{
                    'effect': 'rolling_resistance', 'subsystem': 'translation',
                    'evidence': {'held_out_gain_nats': 50.0}}]}), encoding='utf-8')
        else:
            held = Path(arguments[arguments.index('--commands') + 1])
            truth = held.with_name(held.name.replace('held', 'truth'))
            shutil.copytree(truth, out)
        return 0, ''

    monkeypatch.setattr(trial, '_run', run)
    return asked


def test_a_cluster_makes_the_same_cases(
        prepared: trial.Folders, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Two workers that stand in another folder; every recording is the same to the last bit."""
    distributed = pytest.importorskip('distributed')
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None
                                  ) as cluster:
        monkeypatch.setenv('LG_HUSKY_BACKEND', f'dask:{cluster.scheduler_address}')
        monkeypatch.chdir(tmp_path)
        there = trial.Folders(Path('there'))
        sealed = trial.prepare(there, SPECS, 1, lambda name: None)
    assert list(sealed) == ['case_0001', 'case_0002']
    files = sorted(path.relative_to(prepared.cases) for path in prepared.cases.rglob('*')
                   if path.is_file())
    assert len(files) > 3
    for path in files:
        assert (there.cases / path).read_bytes() == (prepared.cases / path).read_bytes(), path


def test_a_trial_is_sealed_blind_resumed_and_scored(
        prepared: trial.Folders, monkeypatch: pytest.MonkeyPatch) -> None:
    sealed = json.loads(prepared.commitments.read_text())
    assert sorted(sealed) == ['case_0001', 'case_0002']
    asked = play(monkeypatch)
    done = list(trial.diagnose_all(prepared, sorted(sealed), 2))
    assert len(done) == 2
    for arguments in asked:
        if 'diagnose' in arguments:
            given = ' '.join(arguments)
            assert 'wheel_radius=' in given
            assert 'answers' not in given
            assert 'held' not in given
            assert 'rolling' not in given
    lines = trial.opened(prepared, sealed, sorted(sealed))
    clean, single = (judge(line) for line in lines)
    assert (clean.kind, clean.right, single.right) == ('none', 0.0, 1.0)
    assert single.shares['all'] == pytest.approx(1.0)
    before = len(asked)
    assert len(list(trial.diagnose_all(prepared, sorted(sealed), 2))) == 2
    assert len(asked) == before, 'a resumed trial asks nothing again'


@pytest.mark.parametrize('code', trial.INTERRUPTED)
def test_what_was_interrupted_has_no_outcome(
        prepared: trial.Folders, monkeypatch: pytest.MonkeyPatch, code: int) -> None:
    """Ctrl-C reaches the diagnoses too; the next run asks them again."""
    folders = trial.Folders(prepared.root / f'stopped{code}', prepared.root)
    monkeypatch.setattr(trial, 'command_for', lambda *_: [
        sys.executable, '-c', 'import os, signal, sys; code = int(sys.argv[1])\n'
        # A shell in the background ignores SIGINT, and so do its children.
        'if code >= 0: sys.exit(code)\n'
        'signal.signal(-code, signal.SIG_DFL)\n'
        'os.kill(os.getpid(), -code)', str(code)])
    with pytest.raises(CommandError, match='interrupted'):
        list(trial.diagnose_all(folders, ['case_0001'], 1))
    assert not (folders.runs / 'case_0001' / 'outcome.json').exists()


def test_preparing_again_makes_nothing_new(prepared: trial.Folders) -> None:
    path = prepared.cases / 'case_0001/rec1/metadata.yaml'
    before = path.stat().st_mtime_ns
    trial.prepare(prepared, SPECS, 1, lambda name: None)
    assert path.stat().st_mtime_ns == before


def test_what_the_drives_cannot_show_is_drawn_again(tmp_path: Path) -> None:
    folders = trial.Folders(tmp_path)
    # The paper's circle never reverses.
    spec = Spec(1, 'outside', drive='paper', effects=('reverse_gain',), severity='medium',
                seconds=(20.0, 21.0))
    (name,) = trial.prepare(folders, (spec,), 1, lambda _: None, held_out=False)
    answer = json.loads((folders.answers / f'{name}.json').read_text())
    assert answer['spec']['seed'] != 1
    assert min(answer['nats']) > 1.0
    assert not folders.held_out.exists()


def test_a_folder_holds_one_trial(prepared: trial.Folders) -> None:
    trial.keep_plan(prepared, SPECS)
    with pytest.raises(CommandError, match='holds another trial'):
        trial.keep_plan(prepared, SPECS[:1])


def test_a_case_without_outcome_is_not_scored(prepared: trial.Folders) -> None:
    with pytest.raises(LgHuskyError, match='case_0009 has no outcome yet'):
        trial.opened(prepared, {}, ['case_0009'])


def test_scoring_before_any_diagnosis_says_so(tmp_path: Path) -> None:
    with pytest.raises(LgHuskyError, match='is diagnosed yet'):
        trial.diagnosed(trial.Folders(tmp_path), ['case_0001'])


def test_the_command_line_names_both_sets_and_what_a_ruler_says(tmp_path: Path) -> None:
    folders = trial.Folders(tmp_path)
    for name in ('after/rec1', 'after/rec2', 'before/rec1'):
        (folders.cases / 'case_0001' / name).mkdir(parents=True)
    line = trial.command_for(folders, 'case_0001', tmp_path / 'out',
                             {'wheel_radius_m': 0.1652, 'track_m': 0.57})
    assert [Path(part).parent.name for part in line[4:6]] == ['after', 'after']
    assert Path(line[line.index('--baseline') + 1]).parent.name == 'before'
    assert {'wheel_radius=0.1652', 'track=0.57'} <= set(line)


def test_cases_of_others_are_tried_as_they_are(
        prepared: trial.Folders, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    play(monkeypatch)
    monkeypatch.setattr('lg_husky_sim.cli.common.BRIEF', 0.0)
    out = tmp_path / 'out'
    result = CliRunner().invoke(cli, ['prove', '--given', str(prepared.root), '--out', str(out)])
    assert result.exit_code == 0, result.output
    assert re.findall(r'diagnosed (\d) of 2 cases', result.stderr) == ['1', '2'], 'a line a case'
    facts, lines = outcomes.read(out / 'outcomes.jsonl')
    assert facts['set'] == 'tuning', 'made by this generator'
    assert [line['case'] for line in lines] == ['case_0001', 'case_0002']
    assert 'Tuning trial (seen while tuning: no proof)' in result.output


def test_every_figure_follows_from_the_outcomes_alone(
        prepared: trial.Folders, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip('matplotlib')
    play(monkeypatch)
    first, again = tmp_path / 'docs/proof.md', tmp_path / 'again/proof.md'
    result = CliRunner().invoke(cli, ['prove', '--given', str(prepared.root), '--out',
                                      str(tmp_path / 'out'), '--page', str(first)])
    assert result.exit_code == 0, result.output
    kept = tmp_path / 'docs/proof_tuning.jsonl'
    assert len(kept.read_text(encoding='utf-8').splitlines()) == 3
    shutil.rmtree(tmp_path / 'out')
    again.parent.mkdir()
    shutil.copy(kept, again.parent)
    result = CliRunner().invoke(cli, [
        'prove', '--from', str(again.parent / kept.name), '--page', str(again)])
    assert result.exit_code == 0, result.output
    assert again.read_text(encoding='utf-8') == first.read_text(encoding='utf-8').replace(
        'docs/proof_tuning', 'again/proof_tuning')


def test_the_page_is_written_whatever_the_locale(tmp_path: Path) -> None:
    pytest.importorskip('matplotlib')
    outcomes.write(tmp_path / 'some.jsonl', {
        'command': 'lg_husky prove', 'commit': 'abc', 'planned': 1, 'seal': 'ab' * 32,
        'seeds': '1 to 1', 'set': 'tuning'}, [
            {'case': 'a', 'kind': 'none', 'level': 'clean', 'world': 'x', 'regime': {},
             'unseen': [], 'nats': [], 'true': [], 'verdict': 'nothing_missing',
             'confidence': 0.9, 'said': [], 'groups': [], 'failed': '', 'held_out': [],
             'held_out_failed': '', 'seconds': 2.0}])
    environment = {**os.environ, 'LC_ALL': 'C', 'PYTHONUTF8': '0', 'PYTHONCOERCECLOCALE': '0',
                   'PYTHONIOENCODING': 'utf-8'}
    done = subprocess.run(
        [sys.executable, '-m', 'lg_husky_sim.cli.main', 'prove', '--from', 'some.jsonl',
         '--page', 'proof.md'], cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    assert '≤ 2 %' in (tmp_path / 'proof.md').read_text(encoding='utf-8')


@pytest.mark.parametrize('text', ['', 'no json', '{"case": "a"}', '{"trial": {"schema": "x"}}'])
def test_a_file_that_holds_no_outcomes_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / 'some.jsonl'
    path.write_text(text, encoding='utf-8')
    with pytest.raises(LgHuskyError, match=r'some\.jsonl') as caught:
        outcomes.read(path)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--report', '--seed', '5'], 'seed = 5 is a tuning seed; a report needs 10000 or more'),
    (['--seed', '9999', '--cases', '2'], 'reach the reporting seeds'),
    (['--report', '--seed', '78100'], 'which were reported before'),
    (['--world', 'g4'], 'world g4 is left out of tuning'),
])
def test_what_does_not_belong_to_a_trial_is_refused(tmp_path: Path, arguments: list[str],
                                                    message: str) -> None:
    result = CliRunner().invoke(cli, ['prove', *arguments, '--out', str(tmp_path / 'out')])
    assert isinstance(result.exception, CommandError)
    assert message in str(result.exception)
    assert not (tmp_path / 'out').exists()


def test_a_trial_needs_a_folder() -> None:
    result = CliRunner().invoke(cli, ['prove'])
    assert result.exit_code == 2
    assert '--out DIR is missing' in result.output
