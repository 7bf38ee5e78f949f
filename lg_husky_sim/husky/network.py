# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Husky as a linear graph: Figs. 4 to 10 of McCormick, Lang and de Silva.

Across variables are counted from tail to head and flows run from tail to head. A transformer of
ratio TF makes the across variable of its first port TF times that of its second. Node names:
``e`` electrical ground, ``r`` rotational ground, ``t`` translational ground, ``chassis`` the
forward motion and ``yaw`` the turning of the base.
"""

from __future__ import annotations

from collections.abc import Iterable
import re

from lg_husky_sim.linear_graph import Branch, Domain, Kind, LinearGraph, TwoPort

#: Reference nodes.
GROUNDS = {Domain.ELECTRICAL: 'e', Domain.ROTATIONAL: 'r', Domain.TRANSLATIONAL: 't'}
#: Motor number, side letter, wheels (position letter, odd and even transformer, lever arm).
_SIDES = (
    ('1', 'L', '-', (('R', 1, 2), ('F', 3, 4))),
    ('2', 'R', '', (('F', 5, 6), ('R', 7, 8))),
)
_TRANSMISSION = 'torque_constant*gear_ratio'
_TRACTION = '1/wheel_radius'
# Eqs. (8) to (12): cos(theta) r_C / r_W with theta = atan(b/c), r_C = sqrt(b² + c²); half the
# wheelbase stands for both a and b, half the track for c. It reduces to c/r_W.
_LEVER = ('cos(atan((wheelbase/2)/(track/2)))*sqrt((wheelbase/2)**2+(track/2)**2)'
          '/wheel_radius')


def _electrical(number: str, side: str, axle: str) -> tuple[tuple[Branch, ...], TwoPort]:
    domain = Domain.ELECTRICAL
    branches = (
        Branch(f'V_S{number}', Kind.ACROSS_SOURCE, domain, f'source{side}', 'e'),
        Branch(f'R_{number}', Kind.D_TYPE, domain, f'source{side}', f'winding{side}',
               'motor_resistance'),
        Branch(f'L_{number}', Kind.T_TYPE, domain, f'winding{side}', f'motor{side}',
               'motor_inductance'),
    )
    motor = TwoPort(f'T_M{side}', Kind.TRANSFORMER, (domain, f'motor{side}', 'e'),
                    (Domain.ROTATIONAL, axle, 'r'), _TRANSMISSION)
    return branches, motor


def _wheel(side: str, sign: str, position: str, odd: int, even: int, axle: str
           ) -> tuple[Branch, tuple[TwoPort, TwoPort]]:
    domain = Domain.ROTATIONAL
    name = f'{position}{side}'
    slip = Branch(f'B_{name}', Kind.D_TYPE, domain, axle, f'tread{name}', 'wheel_damping')
    forward = TwoPort(f'TF_{odd}', Kind.TRANSFORMER, (domain, f'tread{name}', f'arm{name}'),
                      (Domain.TRANSLATIONAL, 'chassis', 't'), _TRACTION)
    turning = TwoPort(f'TF_{even}', Kind.TRANSFORMER, (domain, f'arm{name}', 'r'),
                      (domain, 'yaw', 'r'), f'{sign}{_LEVER}')
    return slip, (forward, turning)


def _chassis() -> tuple[Branch, ...]:
    return (
        Branch('M_H', Kind.A_TYPE, Domain.TRANSLATIONAL, 'chassis', 't', 'mass'),
        Branch('J_H', Kind.A_TYPE, Domain.ROTATIONAL, 'yaw', 'r', 'yaw_inertia'),
        Branch('B_H', Kind.D_TYPE, Domain.ROTATIONAL, 'yaw', 'r', 'yaw_damping'),
    )


def simplified() -> LinearGraph:
    """
    Return the 6-state graph of Fig. 10: one inertia a side, states as in eq. (17).

    Returns
    -------
    LinearGraph
        Element values are expressions in the names of ``config/husky.yaml``.

    """
    inertias: list[Branch] = []
    rest: list[Branch] = []
    ports: list[TwoPort] = []
    for number, side, sign, wheels in _SIDES:
        axle = f'axle{side}'
        branches, motor = _electrical(number, side, axle)
        inertias.append(Branch(f'J_{side}W', Kind.A_TYPE, Domain.ROTATIONAL, axle, 'r',
                               'wheel_inertia'))
        rest.extend(branches)
        ports.append(motor)
        for position, odd, even in wheels:
            slip, pair = _wheel(side, sign, position, odd, even, axle)
            rest.append(slip)
            ports.extend(pair)
    return LinearGraph((*inertias, *_chassis(), *rest), tuple(ports), GROUNDS)


def expanded() -> LinearGraph:
    """
    Return the 10-state graph of Fig. 5: two axles a side, coupled by a compliant belt.

    Returns
    -------
    LinearGraph
        Rear axles (driven by the motors) first; belts are a spring beside a damper.

    """
    inertias: list[Branch] = []
    rest: list[Branch] = []
    ports: list[TwoPort] = []
    for number, side, sign, wheels in _SIDES:
        rear, front = f'axleR{side}', f'axleF{side}'
        branches, motor = _electrical(number, side, rear)
        for position, axle in (('R', rear), ('F', front)):
            inertias.append(Branch(f'J_{position}{side}', Kind.A_TYPE, Domain.ROTATIONAL, axle,
                                   'r', 'wheel_inertia/2'))
        rest.extend(branches)
        rest.append(Branch(f'K_Belt{side}', Kind.T_TYPE, Domain.ROTATIONAL, rear, front,
                           'belt_stiffness'))
        rest.append(Branch(f'B_Belt{side}', Kind.D_TYPE, Domain.ROTATIONAL, rear, front,
                           'belt_damping'))
        ports.append(motor)
        for position, odd, even in wheels:
            axle = rear if position == 'R' else front
            slip, pair = _wheel(side, sign, position, odd, even, axle)
            rest.append(slip)
            ports.extend(pair)
    return LinearGraph((*inertias, *_chassis(), *rest), tuple(ports), GROUNDS)


#: Ends of the names of what only one side has; an added element ends in _L or _R.
_OF_SIDE = {'left': re.compile(r'(_[FR]?L|LW|ML|BeltL|_S1|\b[RL]_1|TF_[1-4])$'),
            'right': re.compile(r'(_[FR]?R|RW|MR|BeltR|_S2|\b[RL]_2|TF_[5-8])$')}


def on_side(elements: Iterable[str], side: str) -> tuple[str, ...]:
    """
    Return the elements that an effect of a side can act on.

    Parameters
    ----------
    elements : iterable of str
        Names of elements of the graph.
    side : str
        ``left`` or ``right``; any other leaves all elements.

    Returns
    -------
    tuple of str
        Those of the side, and those of both.

    """
    other = _OF_SIDE.get({'left': 'right', 'right': 'left'}.get(side, ''))
    return tuple(name for name in elements if other is None or not other.search(name))
