# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The Husky's matrices against eqs. (19) to (22) and the derived numbers of the paper."""

from __future__ import annotations

import subprocess
import sys

from lg_husky_sim.linear_graph import compile_numeric, LinearGraph
import numpy as np
from numpy.typing import NDArray
import pytest

STATES = ('omega(J_LW)', 'omega(J_RW)', 'v(M_H)', 'omega(J_H)', 'i(L_1)', 'i(L_2)')
POLES = (-1663.81, -1663.80, -460.11, -459.99, -8.8395, -3.5931)
UNEQUAL = {'B_RL': 0.9, 'B_FL': 1.1, 'B_FR': 1.7, 'B_RR': 2.3, 'R_2': 0.5}


def printed_state_matrix(values: dict[str, float], at_4_3: float) -> NDArray[np.float64]:
    """Return A as eq. (19) prints it, with the erratum's factor at row 4, column 3."""
    odd, left, right = 1.0 / values['r_W'], -values['c'] / values['r_W'], (
        values['c'] / values['r_W'])
    rl, fl, fr, rr = (values[f'B_{name}'] for name in ('RL', 'FL', 'FR', 'RR'))
    motor = values['k_t'] * values['GR']
    moment = -fl * odd * left - fr * odd * right - rl * odd * left - rr * odd * right
    wheel_l, wheel_r, mass, inertia = (
        values['J_LW'], values['J_RW'], values['M_H'], values['J_H'])
    return np.array([
        [-(fl + rl) / wheel_l, 0, (fl + rl) * odd / wheel_l, (fl + rl) * left / wheel_l,
         motor / wheel_l, 0],
        [0, -(fr + rr) / wheel_r, (fr + rr) * odd / wheel_r, (fr + rr) * right / wheel_r,
         0, motor / wheel_r],
        [(fl + rl) * odd / mass, (fr + rr) * odd / mass, -(rl + fl + fr + rr) * odd**2 / mass,
         moment / mass, 0, 0],
        [(fl + rl) * left / inertia, (fr + rr) * right / inertia, moment * at_4_3,
         -((rl + fl) * left**2 + (fr + rr) * right**2 + values['B_H']) / inertia, 0, 0],
        [-motor / values['L_1'], 0, 0, 0, -values['R_1'] / values['L_1'], 0],
        [0, -motor / values['L_2'], 0, 0, 0, -values['R_2'] / values['L_2']]])


@pytest.mark.parametrize('changed', [{}, UNEQUAL], ids=['paper', 'unequal'])
def test_matrices_are_eqs_19_to_22_with_the_erratum(
        husky: LinearGraph, paper: dict[str, float], changed: dict[str, float]) -> None:
    values = {**paper, **changed}
    model = compile_numeric(husky, STATES[:4]).at(values)
    assert model.states == STATES
    assert model.inputs == ('V_s1', 'V_s2')
    expected = printed_state_matrix(values, 1.0 / values['J_H'])
    np.testing.assert_allclose(model.A, expected, rtol=1e-12, atol=1e-9)
    drive = np.zeros((6, 2))
    drive[4, 0], drive[5, 1] = 1.0 / values['L_1'], 1.0 / values['L_2']
    np.testing.assert_allclose(model.B, drive, rtol=1e-12)
    np.testing.assert_array_equal(model.C, np.eye(4, 6))
    np.testing.assert_array_equal(model.D, np.zeros((4, 2)))
    assert not model.E.any()


def test_erratum_shows_only_where_dampings_differ(
        husky: LinearGraph, paper: dict[str, float]) -> None:
    values = {**paper, **UNEQUAL}
    derived = compile_numeric(husky).at(values).A
    printed = printed_state_matrix(values, 1.0)
    differing = np.argwhere(~np.isclose(derived, printed, rtol=1e-9, atol=1e-9))
    np.testing.assert_array_equal(differing, [[3, 2]])
    np.testing.assert_allclose(printed_state_matrix(paper, 1.0)[3, 2], 0.0, atol=1e-12)


def test_poles_of_row_21(husky: LinearGraph, paper: dict[str, float]) -> None:
    poles = compile_numeric(husky).at(paper).poles
    assert np.all(poles.imag == 0.0)
    np.testing.assert_allclose(poles.real, POLES, rtol=2e-5)


def test_numeric_path_leaves_sympy_and_matplotlib_alone() -> None:
    code = ('import sys; from lg_husky_sim.husky.network import simplified; '
            'from lg_husky_sim.linear_graph import compile_numeric; '
            "compile_numeric(simplified(), ['v(M_H)']); "
            "print([n for n in ('sympy', 'matplotlib', 'yaml', 'scipy') if n in sys.modules])")
    shown = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                           check=True)
    assert shown.stdout.strip() == '[]'
