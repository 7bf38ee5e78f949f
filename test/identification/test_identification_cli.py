# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky identify`, as its user runs it."""

from __future__ import annotations

from collections.abc import Callable
import json
from pathlib import Path

from lg_husky_sim.cli.main import run
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Segment, write_recording
import pytest

pytest.importorskip('rosbags')
pytest.importorskip('jinja2')
pytest.importorskip('matplotlib')


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory, circle: Segment) -> Path:
    return write_recording(tmp_path_factory.mktemp('bags') / 'a<b', circle.streams)


def test_one_command_gives_a_calibrated_model(
        bag: Path, tmp_path: Path, truth: dict[str, float],
        capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / 'new' / 'fit.yaml'
    assert run(['identify', str(bag), '--out', str(out), '--starts', '2']) == 0
    assert sorted(p.name for p in out.parent.iterdir()) == [
        'fit.html', 'fit.json', 'fit.txt', 'fit.yaml']
    fitted = load_model(out)
    for name, value in truth.items():
        assert fitted.parameters[name] == pytest.approx(value, rel=0.05)
        assert fitted.parameters.entry(name).low is not None
    printed = capsys.readouterr().out
    assert out.with_suffix('.txt').read_text().strip() in printed
    page = out.with_suffix('.html').read_text()
    assert 'a&lt;b' in page
    assert 'a<b' not in page
    assert page.count('data:image/png;base64,') >= 3
    assert json.loads(out.with_suffix('.json').read_text())['recordings'] == ['a<b']


def test_each_recording_on_its_own_gives_the_same_numbers(
        bag: Path, tmp_path: Path, make_drive: Callable[..., Segment],
        capsys: pytest.CaptureFixture[str]) -> None:
    other = write_recording(tmp_path / 'other', make_drive(seed=9).streams)
    out = tmp_path / 'fits'
    assert run(['identify', str(bag), str(other), '--out', str(out), '--each', '--starts', '1'
                ]) == 0
    table = capsys.readouterr().out
    alone = tmp_path / 'alone.yaml'
    assert run(['identify', str(other), '--out', str(alone), '--starts', '1']) == 0
    fitted, same = load_model(out / 'other.yaml'), load_model(alone)
    assert dict(fitted.parameters) == dict(same.parameters)
    assert f'{fitted.parameters["command_gain"]:.5g}' in table


def test_estimates_are_not_put_into_a_recording(bag: Path,
                                                capsys: pytest.CaptureFixture[str]) -> None:
    files = sorted(path.name for path in bag.iterdir())
    assert run(['identify', str(bag), '--each', '--out', str(bag), '--starts', '1']) == 1
    assert 'is a recording; choose another folder' in capsys.readouterr().err
    assert sorted(path.name for path in bag.iterdir()) == files


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--out', 'fit.txt'], 'a model file ends in .yaml'),
    (['--out', 'fit.yaml', '--free', 'weight'], "unknown parameter 'weight'"),
    (['--out', 'fit.yaml', '--effects', 'wind'], "unknown effect 'wind'"),
    (['--out', 'fit.yaml', '--set', 'mass=-1'], 'mass = -1 kg is not positive'),
    (['--out', 'fit.yaml', '--nuisance', 'x'], "unknown nuisance 'x'"),
])
def test_bad_input_is_one_line_and_leaves_nothing(
        bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(['identify', str(bag), *arguments]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert error.count('\n') == 1
    assert list(tmp_path.iterdir()) == []


def test_two_workers_of_dask_give_the_same_results(bag: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip('distributed')
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=False,
                                  dashboard_address=None) as cluster:
        address = ['--scheduler', cluster.scheduler_address]
        there, here = tmp_path / 'there.yaml', tmp_path / 'here.yaml'
        assert run(['identify', str(bag), '--out', str(there), '--starts', '2', *address]) == 0
        assert run(['identify', str(bag), '--out', str(tmp_path / 'each'), '--each', '--starts',
                    '2', *address]) == 0
    assert run(['identify', str(bag), '--out', str(here), '--starts', '2']) == 0
    local = dict(load_model(here).parameters)
    assert dict(load_model(there).parameters) == local
    assert dict(load_model(tmp_path / 'each' / f'{bag.name}.yaml').parameters) == local


def test_a_scheduler_that_does_not_answer_is_one_line(
        bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip('distributed')
    monkeypatch.setattr('lg_husky_sim.parallel.PATIENCE', 0.2)
    assert run(['identify', str(bag), '--out', str(tmp_path / 'x.yaml'), '--scheduler',
                'tcp://127.0.0.1:9']) == 1
    assert "no Dask scheduler answers at 'tcp://127.0.0.1:9'" in capsys.readouterr().err
