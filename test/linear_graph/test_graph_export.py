# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Exported models, read back by what they are exported for."""

from __future__ import annotations

import json
from pathlib import Path
import re
import runpy
import shutil
import subprocess

import control
import lg_husky_sim as lg
from lg_husky_sim.errors import SettingsError
from lg_husky_sim.linear_graph.export import export, to_control, to_scipy, used_matrices
from lg_husky_sim.linear_graph.state_space import StateSpace
import numpy as np
import pytest
from scipy.io import loadmat

NAMES = ('A', 'B', 'C', 'D')
#: The capacitor's current hangs on the rate of change of the source.
NOT_PROPER = """
name: capacitor across a source
elements:
  V: {is: voltage source, from: a}
  C: {is: capacitor, from: a, value: 1 F}
  R: {is: resistor, from: a, to: b, value: 1 Ω}
  L: {is: inductor, from: b, value: 1 H}
outputs: [i(C)]
"""


@pytest.fixture(scope='module')
def space() -> StateSpace:
    return lg.Husky().numeric()


def assert_same(space: StateSpace, found: dict[str, object]) -> None:
    for name in NAMES:
        assert np.array_equal(np.asarray(found[name], dtype=float), getattr(space, name)), name


def test_json_holds_matrices_names_and_numbers(space: StateSpace, tmp_path: Path) -> None:
    path = lg.Husky().export(tmp_path / 'husky.json')
    data = json.loads(path.read_text('utf-8'))
    assert_same(space, data)
    assert tuple(data['states']) == space.states
    assert data['parameters']['wheel_radius'] == 0.1651


def test_matlab_reads_the_mat_file(space: StateSpace, tmp_path: Path) -> None:
    data = loadmat(export(space, tmp_path / 'husky.mat', 'Husky', {'mass': 48.39}))
    assert_same(space, data)
    assert [str(cell[0]) for cell in data['states'].ravel()] == list(space.states)
    assert float(data['parameters']['mass'][0, 0].item()) == 48.39


def test_numpy_reads_the_npz_file_without_pickles(space: StateSpace, tmp_path: Path) -> None:
    with np.load(export(space, tmp_path / 'husky.npz'), allow_pickle=False) as data:
        assert_same(space, dict(data))
        assert tuple(data['inputs']) == space.inputs


def c_matrices(text: str) -> dict[str, object]:
    found: dict[str, object] = {}
    for name, rows, columns, body in re.findall(
            r'\w+_(\w)\[(\d+)\]\[(\d+)\] = \{(.*?)\};', text, re.DOTALL):
        numbers = [float(v) for v in re.findall(r'[-+\d.e]+', body)]
        found[name] = np.array(numbers).reshape(int(rows), int(columns))
    return found


def test_c_holds_every_digit_and_compiles(space: StateSpace, tmp_path: Path) -> None:
    path = export(space, tmp_path / 'husky.h', 'ends here: */ int main')
    assert_same(space, c_matrices(path.read_text('utf-8')))
    if compiler := shutil.which('cc'):
        (tmp_path / 'use.c').write_text(
            '#include "husky.h"\n#include <stdio.h>\n'
            'int main(void) { printf("%.17g", husky_A[5][5]); return 0; }\n')
        subprocess.run([compiler, '-o', 'use', 'use.c'], cwd=tmp_path, check=True, timeout=60)
        said = subprocess.run([tmp_path / 'use'], capture_output=True, check=True, timeout=60)
        assert float(said.stdout) == space.A[5, 5]


def test_latex_holds_every_digit(space: StateSpace, tmp_path: Path) -> None:
    text = export(space, tmp_path / 'husky.tex').read_text('utf-8')
    found: dict[str, object] = {}
    for name, body in re.findall(r'\\\[ (\w) = \\begin\{bmatrix\}(.*?)\\end', text, re.DOTALL):
        found[name] = [
            [float(re.sub(r' \\times 10\^\{(.*)\}', r'e\1', v)) for v in row.split('&')]
            for row in body.split('\\\\')]
    assert_same(space, found)


def test_python_makes_systems_of_control_and_scipy(space: StateSpace, tmp_path: Path) -> None:
    names = runpy.run_path(str(export(space, tmp_path / 'husky.py', 'a """ title')))
    for system in (names['control_system'](), names['scipy_system']()):
        assert_same(space, {name: getattr(system, name) for name in NAMES})
    assert names['control_system']().state_labels == list(space.states)


def test_control_and_scipy_objects_answer_as_the_model(space: StateSpace) -> None:
    """The steady speed for equal voltages, by both and by the matrices themselves."""
    steady = -space.C @ np.linalg.solve(space.A, space.B) + space.D
    assert np.allclose(control.dcgain(to_control(space)), steady)
    by_scipy = to_scipy(space)
    assert np.allclose(-by_scipy.C @ np.linalg.solve(by_scipy.A, by_scipy.B), steady)


def test_a_model_that_is_not_proper_goes_only_where_it_fits(tmp_path: Path) -> None:
    graph = lg.graph(NOT_PROPER)
    data = json.loads(graph.export(tmp_path / 'one.json').read_text('utf-8'))
    assert np.array_equal(data['F'], graph.numeric().F)
    with pytest.raises(SettingsError, match='rate of change of an input'):
        graph.export(tmp_path / 'one.h')
    assert not (tmp_path / 'one.h').exists()


def test_laws_that_are_not_linear_are_named_where_they_are_left_out(tmp_path: Path) -> None:
    husky = lg.Husky().with_effect('coulomb_drivetrain', side='left')
    assert 'Non-linear laws are left out' in husky.export(tmp_path / 'one.h').read_text('utf-8')
    assert 'G' in json.loads(husky.export(tmp_path / 'one.json').read_text('utf-8'))
    assert {'G', 'H'} <= set(used_matrices(husky.numeric()))


def test_an_unknown_ending_lists_those_there_are(space: StateSpace, tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r'must be one of \.json, \.mat'):
        export(space, tmp_path / 'model.xlsx')


RATE = """
name: two capacitors /* in series */
elements:
  V_s: {is: voltage source, from: a}
  C_1: {is: capacitor, from: a, to: b, value: 1 F}
  C_2: {is: capacitor, from: b, value: 1 F}
  R:   {is: resistor, from: b, value: 1 Ω}
outputs: [V(C_2)]
"""
RAM = """
elements:
  F_s: {is: force source, from: ground, to: a}
  m:   {is: mass, from: a, value: 1 kg}
  ram: {is: gyrator, value: 2, port 1: {domain: translational, from: a},
        port 2: {domain: fluid, from: b}}
  R:   {is: valve, from: b, value: 1 Pa·s/m³}
outputs: [Q(ram.2), F(ram.1)]
"""
FREE = 'elements:\n  R: {is: resistor, from: a, value: 1}\n  C: {is: capacitor, from: a, value: 1}'
STATIC = """
elements:
  V_s: {is: voltage source, from: a}
  R_1: {is: resistor, from: a, to: b, value: 1 Ω}
  R_2: {is: resistor, from: b, value: 3 Ω}
outputs: [V(R_2)]
"""


def test_states_less_their_share_of_an_input_are_called_so(tmp_path: Path) -> None:
    """C_2's share in E is a half: the state is V(C_1) - V_s/2, and V(C_2) = V_s/2 - x."""
    graph = lg.graph(RATE)
    system = graph.to_control()
    assert system.state_labels == ['V(C_1) - E u']
    assert (system.C.item(), system.D.item()) == (-1.0, 0.5)
    for ending in ('h', 'tex', 'py'):
        text = graph.export(tmp_path / f'one.{ending}').read_text('utf-8')
        assert 'V(C_1) - E u = V(C_1) - 0.5 V_s' in text, ending
    assert runpy.run_path(str(tmp_path / 'one.py'))['states'] == ['V(C_1) - E u']
    assert json.loads(graph.export(tmp_path / 'one.json').read_text('utf-8'))['states'] == [
        'V(C_1)']


def test_ports_have_names_that_control_takes(tmp_path: Path) -> None:
    graph = lg.graph(RAM)
    written = runpy.run_path(str(graph.export(tmp_path / 'ram.py')))['control_system']()
    for system in (graph.to_control(), written):
        assert system.output_labels == ['Q(ram_2)', 'F(ram_1)']
        assert np.array_equal(system.C, graph.numeric().C)


@pytest.mark.parametrize(('text', 'sizes'), [
    (RATE.replace('outputs: [V(C_2)]', ''), (1, 1, 0)), (FREE, (1, 0, 0)),
    (f'{FREE}\noutputs: [V(C)]', (1, 0, 1)), (STATIC, (0, 1, 1))])
def test_models_without_states_inputs_or_outputs_are_exported(
        text: str, sizes: tuple[int, int, int], tmp_path: Path) -> None:
    graph = lg.graph(text)
    n, m, p = sizes
    written = runpy.run_path(str(graph.export(tmp_path / 'one.py')))
    for system in (graph.to_control(), written['control_system']()):
        assert (system.nstates, system.ninputs, system.noutputs) == (n, m or 1, p)
        assert system.input_labels == (['none'] if m == 0 else list(graph.inputs))
    assert graph.to_scipy().D.shape == (p, m)
    assert written['scipy_system']().A.shape == (n, n)
    header = graph.export(tmp_path / 'one.h').read_text('utf-8')
    assert set(c_matrices(header)) == {
        name for name, size in zip(NAMES, (n, n * m, p * n, p * m), strict=True) if size}
    assert '[0]' not in header
    assert (f'STATES {n}\n' in header, f'OUTPUTS {p}\n' in header) == (True, True)
    assert r'\begin{bmatrix}' + '\n\n' not in graph.export(tmp_path / 'one.tex').read_text('utf-8')


def test_headers_are_iso_c_whatever_the_title_is(tmp_path: Path) -> None:
    path = lg.graph(RATE.replace('/* in', '*/ /* /*/ in').replace(
        'outputs: [V(C_2)]', '')).export(tmp_path / 'one.h')
    first, comment, *_ = re.split(r'/\*|\*/', path.read_text('utf-8'))
    assert (first, comment.count('two capacitors')) == ('', 1)
    if compiler := shutil.which('cc'):
        (tmp_path / 'use.c').write_text(
            '#include "one.h"\nint main(void) { return one_A[0][0] > one_B[0][0]; }\n')
        subprocess.run([compiler, '-std=c99', '-pedantic-errors', '-Wall', '-Werror', '-o', 'use',
                        'use.c'], cwd=tmp_path, check=True, timeout=60)


def test_a_static_graph_has_d_and_f_alone() -> None:
    graph = lg.graph(STATIC)
    assert str(graph.D) == 'Matrix([[R_2/(R_1 + R_2)]])'
    assert graph.numeric().D.tolist() == [[0.75]]
    assert graph.numeric().poles.tolist() == []
    assert repr(graph) == '<Graph graph: 3 branches; y = D u>'
    assert 'none, it has no state' in graph.text()
    charged = lg.graph("""
        elements:
          V_s: {is: voltage source, from: a}
          C:   {is: capacitor, from: a, value: 2}
        outputs: [i(C)]
        """)
    assert (charged.states, charged.numeric().F.tolist()) == ((), [[2.0]])


@pytest.mark.parametrize('ending', ['json', 'mat', 'npz', 'h', 'tex', 'py', 'svg', 'png', 'pdf'])
def test_only_files_of_ours_are_replaced(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f'mine.{ending}'
    graph = lg.graph(STATIC)
    write = graph.draw if ending in ('svg', 'png', 'pdf') else graph.export
    for _ in range(2):
        write(path)
    path.write_text('my own\n', 'utf-8')
    with pytest.raises(SettingsError, match=rf'mine.{ending} exists and is no such result of'):
        write(path)
    assert path.read_text('utf-8') == 'my own\n'


def test_two_headers_go_into_one_program(tmp_path: Path) -> None:
    graph = lg.graph(STATIC)
    graph.export(tmp_path / 'left-motor.h')
    graph.export(tmp_path / '2nd.h', R_1=3.0)
    (tmp_path / 'use.c').write_text(
        '#include "left-motor.h"\n#include "2nd.h"\n#include <stdio.h>\n'
        'int main(void) { printf("%g %g %d", left_motor_D[0][0], model_2nd_D[0][0],\n'
        '                        LEFT_MOTOR_INPUTS + MODEL_2ND_OUTPUTS); return 0; }\n')
    if compiler := shutil.which('cc'):
        subprocess.run([compiler, '-std=c99', '-Wall', '-Werror', '-o', 'use', 'use.c'],
                       cwd=tmp_path, check=True, timeout=60)
        said = subprocess.run([tmp_path / 'use'], capture_output=True, check=True, timeout=60)
        assert said.stdout == b'0.75 0.5 2'


def test_latex_has_powers_of_ten(tmp_path: Path) -> None:
    graph = lg.graph(STATIC)
    text = graph.export(tmp_path / 'one.tex', R_1=1.0, R_2=2e-9).read_text('utf-8')
    assert re.search(r'2\.0\d* \\times 10\^\{-9\}', text)
    assert 'e-09' not in text
