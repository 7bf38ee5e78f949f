# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's Husky graph built from branches, independently of ``lg_husky_sim.husky``."""

from __future__ import annotations

from lg_husky_sim.linear_graph import Branch, Domain, Kind, LinearGraph, TwoPort
import pytest

ELECTRICAL, TRANSLATIONAL, ROTATIONAL = (
    Domain.ELECTRICAL, Domain.TRANSLATIONAL, Domain.ROTATIONAL)
PAPER = {
    'R_1': 0.46, 'R_2': 0.46, 'L_1': 0.22e-3, 'L_2': 0.22e-3, 'k_t': 0.044488, 'GR': 78.71,
    'J_LW': 0.08, 'J_RW': 0.08, 'M_H': 48.39, 'J_H': 3.0556, 'B_RL': 1.3016, 'B_FL': 1.3016,
    'B_FR': 1.3016, 'B_RR': 1.3016, 'B_H': 12.8650, 'r_W': 0.1651, 'c': 0.5708 / 2.0}


def slip(name: str, first: int, node: str, sign: str) -> tuple[Branch, TwoPort, TwoPort]:
    """Return one wheel: slip damping in series with the two transformers to ground."""
    return (
        Branch(f'B_{name}', Kind.D_TYPE, ROTATIONAL, node, f'{name}_1', f'B_{name}'),
        TwoPort(f'TF_{first}', Kind.TRANSFORMER, (ROTATIONAL, f'{name}_1', f'{name}_2'),
                (TRANSLATIONAL, 'body', 'ground'), '1/r_W'),
        TwoPort(f'TF_{first + 1}', Kind.TRANSFORMER, (ROTATIONAL, f'{name}_2', 'ground'),
                (ROTATIONAL, 'yaw', 'ground'), f'{sign}c/r_W'))


def motor(side: str, number: int, axle: str) -> tuple[Branch, Branch, Branch, TwoPort]:
    """Return one motor circuit and its transformer to the axle."""
    n = number
    return (
        Branch(f'V_S{n}', Kind.ACROSS_SOURCE, ELECTRICAL, f'supply_{n}', 'ground', f'V_s{n}'),
        Branch(f'R_{n}', Kind.D_TYPE, ELECTRICAL, f'supply_{n}', f'coil_{n}', f'R_{n}'),
        Branch(f'L_{n}', Kind.T_TYPE, ELECTRICAL, f'coil_{n}', f'motor_{n}', f'L_{n}'),
        TwoPort(f'T_M{side}', Kind.TRANSFORMER, (ELECTRICAL, f'motor_{n}', 'ground'),
                (ROTATIONAL, axle, 'ground'), 'k_t*GR'))


@pytest.fixture(scope='session')
def paper() -> dict[str, float]:
    """Return Table I with the fitted values of Table II, and Clearpath's radius and track."""
    return dict(PAPER)


@pytest.fixture(scope='session')
def husky() -> LinearGraph:
    """Return the graph of Fig. 10, 6 states."""
    elements = (
        *motor('L', 1, 'axle_L'), *motor('R', 2, 'axle_R'),
        Branch('J_LW', Kind.A_TYPE, ROTATIONAL, 'axle_L', 'ground', 'J_LW'),
        Branch('J_RW', Kind.A_TYPE, ROTATIONAL, 'axle_R', 'ground', 'J_RW'),
        Branch('M_H', Kind.A_TYPE, TRANSLATIONAL, 'body', 'ground', 'M_H'),
        Branch('J_H', Kind.A_TYPE, ROTATIONAL, 'yaw', 'ground', 'J_H'),
        Branch('B_H', Kind.D_TYPE, ROTATIONAL, 'yaw', 'ground', 'B_H'),
        *slip('RL', 1, 'axle_L', '-'), *slip('FL', 3, 'axle_L', '-'),
        *slip('FR', 5, 'axle_R', ''), *slip('RR', 7, 'axle_R', ''))
    return LinearGraph(tuple(e for e in elements if isinstance(e, Branch)),
                       tuple(e for e in elements if isinstance(e, TwoPort)))
