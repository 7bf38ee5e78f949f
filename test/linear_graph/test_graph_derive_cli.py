# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky derive` as its user runs it."""

from __future__ import annotations

import json
from pathlib import Path

from lg_husky_sim.cli.main import run
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model, ModelFile, save_model
import numpy as np
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


def test_a_and_b_are_printed_in_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(['derive']) == 0
    lines = capsys.readouterr().out.splitlines()
    space = load_model()
    expected = compile_model(space.structure).at(space.parameters).sets[-1]
    for name, matrix in (('A', expected.a), ('B', expected.b)):
        first = len(lines) - lines[::-1].index(f'{name} =')  # the symbolic one stands before
        shown = [[float(part) for part in line.split()]
                 for line in lines[first:first + matrix.shape[0]]]
        np.testing.assert_allclose(shown, matrix, rtol=1e-5)


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
    said = capsys.readouterr().out
    assert run(['derive', str(EXAMPLES / f'{name}.yaml')]) == 0
    assert capsys.readouterr().out == said
    assert 'State-space model' in said


def test_every_picture_that_is_asked_for(tmp_path: Path,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    pictures = [str(tmp_path / 'husky.svg'), str(tmp_path / 'husky.png')]
    wanted = [word for path in pictures for word in ('--picture', path)]
    assert run(['derive', *wanted]) == 0
    assert capsys.readouterr().err == ''.join(f'{path} written\n' for path in pictures)
    assert all(Path(path).stat().st_size for path in pictures)


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
    (['--picture', 'x.svg', '--picture', 'x.bmp'], "error: picture 'x.bmp' must end in .svg"),
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


LATE = {'payload_mass': 5.0, 'payload_inertia': 0.4, 'payload_mass_later': 50.0,
        'payload_inertia_later': 4.0}


def diagnosed(*more: Effect) -> ModelFile:
    """Return a model with a payload that changes, and further effects."""
    effects = (Effect('payload'), Effect('payload', late=True, again=True), *more)
    nominal = load_model()
    parameters = nominal.parameters.with_entries(*(
        p.parameter(LATE.get(p.name)) for effect in effects for p in effect.parameters()))
    return ModelFile(Structure(effects=effects, onset=Onset(OnsetKind.TIME, 0.0)), parameters)


def test_a_changed_effect_has_its_later_numbers(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, model = tmp_path / 'model.yaml', diagnosed()
    save_model(model, path)
    assert run(['derive', '--model', str(path)]) == 0
    shown = capsys.readouterr().out
    mass = model.parameters['mass'] + 50.0
    assert f'  M_H = mass + payload_mass = {mass:g} kg' in shown.replace('mass+p', 'mass + p')
    poles = [float(text) for text in shown.partition('[1/s]: ')[2].split(', ')]
    before, after = (np.sort(np.linalg.eigvals(part.a).real) for part in compile_model(
        model.structure).at(model.parameters).sets)
    np.testing.assert_allclose(poles, after, rtol=1e-5)
    assert not np.allclose(poles, before, rtol=1e-3)
    assert 'Not in the matrices' not in shown
    assert 'The model after the onset of payload' in shown.splitlines()


@pytest.mark.parametrize('form', [[], ['--latex']])
def test_effects_outside_the_graph_are_named(
        form: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'model.yaml'
    save_model(diagnosed(Effect('speed_loop'), Effect('encoder_scale', side='left')), path)
    assert run(['derive', '--model', str(path), *form]) == 0
    line = ('The model after the onset of payload. Not in the matrices and poles, which are those '
            'of the graph alone: speed_loop, encoder_scale')
    assert ('% ' * bool(form) + line) in capsys.readouterr().out.splitlines()


def latex(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    path = folder / 'graph.yaml'
    path.write_text(text, encoding='utf-8')
    assert run(['derive', '--model', str(path), '--latex']) == 0
    short = capsys.readouterr().out.replace(r'\begin{bmatrix} ', '[').replace(
        r' \end{bmatrix}', ']')
    return short.splitlines()


def test_latex_has_the_rates_of_inputs(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shown = latex("""
        elements:
          V_s: {is: voltage source, from: a}
          C_1: {is: capacitor, from: a, to: b, value: 1}
          C_2: {is: capacitor, from: b, value: 1}
          R:   {is: resistor, from: b, value: 1}
        outputs: [i(C_1)]
        """, tmp_path, capsys)
    assert (r'\[ \frac{d}{dt} [V_{C_{1}}] = A [V_{C_{1}}] + B [V_{s}] '
            r'+ E \frac{d}{dt} [V_{s}] \]') in shown
    assert (r'\[ [i_{C_{1}}] = C [V_{C_{1}}] + D [V_{s}] '
            r'+ F \frac{d}{dt} [V_{s}] \]') in shown


def test_latex_has_the_efforts_and_their_arguments(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shown = latex("""
        elements:
          F_s: {is: force source, from: ground, to: body}
          m:   {is: mass, from: body, value: 1}
          d:   {is: damper, from: body, law: quadratic, of: [v(d)], parameters: [p]}
        outputs: [F(m), v(m)]
        """, tmp_path, capsys)
    assert r'\[ \frac{d}{dt} [v_{m}] = A [v_{m}] + B [F_{s}] + G [f_{d}] \]' in shown
    assert r'\[ [F_{m} \\ v_{m}] = C [v_{m}] + D [F_{s}] + L_c [f_{d}] \]' in shown
    assert r'\[ [v_{d}] = H [v_{m}] \]' in shown


def test_names_of_several_letters_are_no_products_in_latex(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shown = '\n'.join(latex("""
        elements:
          tau_m: {is: torque source, from: ground, to: a}
          ks: {is: torsion spring, from: a, value: 1}
          Jrotor_2: {is: inertia, from: a, value: Rload*alpha}
          Cf: {is: rotary damper, from: a, value: 3}
        """, tmp_path, capsys))
    assert r'\tau_{\tau_{m}}' in shown
    assert r'\frac{d}{dt} \tau_{\mathrm{ks}} &= \mathrm{ks} \omega_{\mathrm{ks}}' in shown
    assert r'- \frac{\mathrm{Cf}}{\mathrm{Jrotor}_{2}}' in shown
    from lg_husky_sim.linear_graph.equations import _value_latex
    assert _value_latex('Rload*alpha*ks') == r'\mathrm{Rload} \, \alpha \, \mathrm{ks}'


def test_a_linear_law_of_a_two_port_is_written_out(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'graph.yaml'
    path.write_text("""
        parameters: {n: 2}
        elements:
          V_s: {is: voltage source, from: a}
          R:   {is: resistor, from: a, to: b, value: 1}
          T:   {is: transformer, law: n, parameters: [n],
                port 1: {domain: electrical, from: b}, port 2: {domain: rotational, from: s}}
          J:   {is: inertia, from: s, value: 1}
          G:   {is: gyrator, law: 2*n, parameters: [n],
                port 1: {domain: rotational, from: s}, port 2: {domain: rotational, from: t}}
          B:   {is: rotary damper, from: t, value: 1}
        """, encoding='utf-8')
    assert run(['derive', '--model', str(path)]) == 0
    shown = capsys.readouterr().out.splitlines()
    for line in ('V(T.1) = n * omega(T.2)', 'tau(T.2) = -n * i(T.1)',
                 'tau(G.1) = -omega(G.2) / (2 * n)', 'tau(G.2) = omega(G.1) / (2 * n)'):
        assert f'  {line}' in shown, line


@pytest.mark.parametrize('form', [[], ['--parameters'], ['--latex']])
def test_a_constant_without_a_value_is_one_line(
        form: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'graph.yaml'
    path.write_text('elements: {R: {is: resistor, from: b, value: 1/0}, '
                    'C: {is: capacitor, from: b, value: c}}', encoding='utf-8')
    assert run(['derive', '--model', str(path), *form]) == 1
    shown = capsys.readouterr()
    assert shown.err == (f"error: {path}: branch 'R': expression '1/0' cannot be evaluated: "
                         'division by zero\n')
    assert shown.out == ''


def test_json_has_the_equations_that_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(['derive', 'simplified', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['equations'] == (
        'dx/dt = A x + B u, y = C x + D u')


def test_capital_endings_will_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'MOTOR.YAML'
    path.write_text('elements: {C: {is: capacitor, from: a}, R: {is: resistor, from: a}}', 'utf-8')
    assert run(['derive', str(path), '--quiet']) == 0
    assert 'State-space model' in capsys.readouterr().out
