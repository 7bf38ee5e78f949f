# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky evaluate` without options, as a fresh install runs it: without MuJoCo."""

from __future__ import annotations

import json
from pathlib import Path
import sys

from lg_husky_sim.cli.main import run
from lg_husky_sim.evaluation import session
from lg_husky_sim.evaluation.cases import MANOEUVRES, synthetic_case
import pytest

for needed in ('jinja2', 'matplotlib'):
    pytest.importorskip(needed)


@pytest.mark.parametrize('installed', [False, True])
def test_without_mujoco_the_engine_is_left_out_and_said(
        installed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    if installed:
        pytest.importorskip('mujoco')
    else:
        monkeypatch.setitem(sys.modules, 'mujoco', None)
    asked: list[tuple[str, ...]] = []

    def evaluated(request: session.Request, *_: object) -> session.Evaluation:
        asked.append(tuple(request.cases))
        return session.Evaluation('six numbers', {'cases': []})
    monkeypatch.setattr(session, 'run_evaluation', evaluated)
    assert run(['evaluate', '--out', str(tmp_path / 'out')]) == 0
    assert asked == [('synthetic', 'engine') if installed else ('synthetic',)]
    said = capsys.readouterr()
    assert ('it needs MuJoCo' in said.out + said.err) is not installed


def test_the_result_is_printed_as_json(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                       capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(session, 'run_evaluation', lambda *_: session.Evaluation(
        'six numbers', {'cases': [{'what_to_change': {'differences': []}}]}))
    assert run(['evaluate', '--out', str(tmp_path / 'out'), '--case', 'synthetic', '--json']) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)['cases'] == [{'what_to_change': {'differences': []}}]
    assert str(tmp_path / 'out' / 'index.html') in said.err


def test_the_synthetic_case_needs_no_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    case = synthetic_case(0)
    assert list(case.recordings) == list(MANOEUVRES)
    assert case.rivals == {}
