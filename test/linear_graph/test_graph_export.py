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
            r'lg_husky_(\w)\[(\d+)\]\[(\d+)\] = \{(.*?)\};', text, re.DOTALL):
        numbers = [float(v) for v in re.findall(r'[-+\d.e]+', body)]
        found[name] = np.array(numbers).reshape(int(rows), int(columns))
    return found


def test_c_holds_every_digit_and_compiles(space: StateSpace, tmp_path: Path) -> None:
    path = export(space, tmp_path / 'husky.h', 'ends here: */ int main')
    assert_same(space, c_matrices(path.read_text('utf-8')))
    if compiler := shutil.which('cc'):
        (tmp_path / 'use.c').write_text(
            '#include "husky.h"\n#include <stdio.h>\n'
            'int main(void) { printf("%.17g", lg_husky_A[5][5]); return 0; }\n')
        subprocess.run([compiler, '-o', 'use', 'use.c'], cwd=tmp_path, check=True, timeout=60)
        said = subprocess.run([tmp_path / 'use'], capture_output=True, check=True, timeout=60)
        assert float(said.stdout) == space.A[5, 5]


def test_latex_holds_every_digit(space: StateSpace, tmp_path: Path) -> None:
    text = export(space, tmp_path / 'husky.tex').read_text('utf-8')
    found: dict[str, object] = {}
    for name, body in re.findall(r'\\\[ (\w) = \\begin\{bmatrix\}(.*?)\\end', text, re.DOTALL):
        found[name] = [[float(v) for v in row.split('&')] for row in body.split('\\\\')]
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
