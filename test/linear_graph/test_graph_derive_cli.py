# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky derive` as its user runs it."""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.cli.main import run
import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples' / 'linear_graph'


def test_the_paper_s_graph_is_derived_step_by_step(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(['derive']) == 0
    shown = capsys.readouterr().out
    for line in (
            'Husky, simplified drivetrain', '  V(L_1) = V(V_S1) - V(R_1) - V(T_ML.1)',
            '  x = [omega(J_LW), omega(J_RW), v(M_H), omega(J_H), i(L_1), i(L_2)]',
            '  (4,3) = (-B_FL*TF_3*TF_4 - B_FR*TF_5*TF_6 - B_RL*TF_1*TF_2 - B_RR*TF_7*TF_8)/J_H',
            '  T_ML = torque_constant*gear_ratio = 3.50165 V/(rad/s)',
            'Poles with the numbers of the model [1/s]: -1663.81, -1663.8, -460.108, -459.992, '
            '-8.83951, -3.59308'):
        assert line in shown.splitlines(), line


def test_parameters_instead_of_elements(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(['derive', '--model', 'expanded', '--parameters', '--output', 'tau(K_BeltL)']) == 0
    shown = capsys.readouterr().out
    assert 'y = [tau(K_BeltL)]' in shown
    assert '  (1,1) = (-2*belt_damping - 2*wheel_damping)/wheel_inertia\n' in shown
    assert '  (8,1) = belt_stiffness\n' in shown
    assert 'Values of the elements' not in shown


def test_latex_of_a_netlist(capsys: pytest.CaptureFixture[str]) -> None:
    path = EXAMPLES / 'rowell_5_3_mass_spring_damper.yaml'
    assert run(['derive', '--model', str(path), '--latex']) == 0
    shown = capsys.readouterr().out
    assert r'\[ A = \begin{bmatrix}- \frac{B}{m} & - \frac{1}{m}\\K & 0\end{bmatrix} \]' in shown
    assert r'\frac{d}{dt} F_{K} &= K v_{K}' in shown
    for opening, closing in (('{', '}'), (r'\begin', r'\end'), (r'\left', r'\right')):
        assert shown.count(opening) == shown.count(closing)


@pytest.mark.parametrize('name', [path.stem for path in sorted(EXAMPLES.glob('*.yaml'))])
def test_every_example_is_derived(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(['derive', '--model', str(EXAMPLES / f'{name}.yaml')]) == 0
    assert 'State-space model' in capsys.readouterr().out


def test_a_model_file_and_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from lg_husky_sim.resources import config_path
    picture = tmp_path / 'husky.svg'
    assert run(['derive', '--model', str(config_path('husky.yaml')),
                '--picture', str(picture)]) == 0
    assert '-3.59308' in capsys.readouterr().out
    assert 'T_ML : 1' in picture.read_text(encoding='utf-8')


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--model', 'simple'], "error: model 'simple' must be simplified, expanded or a .yaml file"),
    (['--model', 'none.yaml'], 'error: none.yaml: No such file or directory'),
    (['--output', 'v(M_G)'],
     "error: unknown output: no branch 'M_G' in the graph; did you mean 'M_H'"),
    (['--picture', 'x.bmp'], "error: picture 'x.bmp' must end in .svg, .png, .pdf"),
])
def test_bad_input_is_one_line_and_exit_code_1(
        arguments: list[str], message: str, capsys: pytest.CaptureFixture[str],
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(['derive', *arguments]) == 1
    shown = capsys.readouterr()
    assert shown.err.startswith(message), shown.err
    assert shown.err.count('\n') == 1
    assert shown.out == ''
    assert list(tmp_path.iterdir()) == []
