# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a search leaves without a name: how much of it there is, and how to describe it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math

from lg_husky_sim.diagnosis.decision.adoption import evidence_beyond_chance
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.hypotheses.lines import Line, lines
from lg_husky_sim.diagnosis.hypotheses.past_motion import PAST
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import (
    BALANCES,
    Effort,
    efforts,
    FELT,
    RATED,
    READINGS,
)
from lg_husky_sim.diagnosis.hypotheses.swings import Swing, swings
from lg_husky_sim.diagnosis.hypotheses.waves import Wave, waves
from lg_husky_sim.diagnosis.localisation import Missing
from lg_husky_sim.diagnosis.result import Finding
from lg_husky_sim.diagnosis.rivals import rivals_of
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import descriptions, Subsystem
from lg_husky_sim.husky.robot_size import RobotSize
import numpy as np

#: Where an effort acts, or which sensor errs: in words, and its elements.
WHERE = {
    'force': ('a force on the chassis', 'M_H'),
    'moment': ('a yaw moment on the chassis', 'J_H'),
    'torque_left': ('a torque on the left wheels', 'J_LW'),
    'torque_right': ('a torque on the right wheels', 'J_RW'),
    'gyro': ('an error of the gyro', 'imu'),
    'encoder_left': ('an error of the left encoder', 'joint_states'),
    'encoder_right': ('an error of the right encoder', 'joint_states'),
}
#: Over what an effort repeats, and in which unit.
REPEATS = {'angle': ('of the angle of these wheels', 'rad'), 'distance': ('driven', 'm'),
           'voltage': ('of the voltage of this motor', 'V')}


def left_over(evidence: Evidence, fit: Fit) -> tuple[Effort, ...]:
    """
    Look for efforts without a name in what a fit leaves.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        What it leaves of the recordings is searched.

    Returns
    -------
    tuple of Effort
        Smooth ones, those that repeat, that swing or belong to waves, largest evidence first.

    """
    looks = (efforts, lines, swings, waves)
    return tuple(sorted((one for look in looks for one in look(evidence, fit)),
                        key=lambda one: -one.evidence))


def needed_evidence(rest: Sequence[Effort], free: Sequence[Missing]) -> float:
    """
    Return the log evidence beyond which something without a name is missing [nats].

    Parameters
    ----------
    rest : sequence of Effort
        Those of :func:`left_over`: as many as were found at all.
    free : sequence of Missing
        Each balance is looked at for bursts.

    """
    return evidence_beyond_chance(len(rest) + len({m.balance for m in free}))


def remaining(search: Search) -> Search:
    """
    Return a search under the noise that is fair to what it leaves.

    Parameters
    ----------
    search : Search
        That has adopted all it could name.

    Returns
    -------
    Search
        With disturbances that may last as long as a robot stays at a place, where those of the
        search last as long as they may: what a floor does for seconds is no unknown effort. What
        has a name and is too little to be likely real is no unknown effort either.

    """
    if search.beside is not None:
        search = replace(search, final=search.beside)
    longest = setting('longest_time')
    times = [value for name, value in search.evidence.noise.values.items()
             if name.endswith('_time')]
    if not math.isclose(max(times), longest):
        return search
    evidence = search.evidence.renoised(search.final, longest='longest_memory')
    final = evidence.fit(search.final.point, search.final.slopes,
                         rounds=int(setting('whole_rounds')))
    return replace(search, evidence=evidence, final=final)


def felt(rest: Sequence[Effort], free: Sequence[Missing], robot: RobotSize
         ) -> tuple[tuple[Effort, ...], tuple[Missing, ...]]:
    """
    Return the efforts that are not negligible.

    Parameters
    ----------
    rest : sequence of Effort
        Those of :func:`left_over`.
    free : sequence of Missing
        Of all drives.
    robot : RobotSize
        Says which size of an effort is negligible.

    Returns
    -------
    tuple of Effort
    tuple of Missing
        Those that somewhere reach the size from which their description in effects.yaml counts.

    """
    least = {balance: next(p.of(robot).negligible for p in descriptions()[name].parameters
                           if p.negligible)
             for balance, (_, name, *_) in BALANCES.items()}
    least |= {name: setting('least_misread') for name in READINGS}
    largest = dict.fromkeys(BALANCES, 0.0)
    for one in free:
        # A wheel's are sizes of rates, and beyond what commands can change.
        largest[one.balance] = max(largest[one.balance], float(np.max(np.abs(one.values))),
                                   math.inf if BALANCES[one.balance][2] != 'none' else 0.0)
    # What a sensor feels beside what it reads is an offset that changes.
    offset = setting('least_misfelt')
    return (tuple(e for e in rest if e.largest >= (
        offset if e.argument in FELT and e.balance in READINGS else least[e.balance])),
            tuple(m for m in free if largest[m.balance] >= least[m.balance]))


def unknown_finding(search: Search, rest: Sequence[Effort], free: Sequence[Missing]) -> Finding:
    """Return what is missing without a name, by its best description."""
    rest, free = felt(rest, free, search.final.point.structure.robot)
    smooth = max(rest, key=lambda one: one.evidence, default=None)
    bursts = max(free, key=lambda one: one.bursts, default=None)
    if smooth is not None and (bursts is None or smooth.evidence >= bursts.bursts):
        balance, most, regime = smooth.balance, smooth.evidence, smooth.argument.replace('_', ' ')
        text = f'{described(smooth)}, up to {smooth.largest:.3g} {_place(balance)[0]}'
    else:
        assert bursts is not None  # else nothing is left, and the verdict another one
        balance, most, regime = bursts.balance, bursts.bursts, 'scattered times'
        text = f'{WHERE[balance][0]} at {regime}'
        if BALANCES[balance][2] == 'none':
            largest = max(float(np.max(np.abs(m.values))) for m in free if m.balance == balance)
            text += f', up to {largest:.3g} {_place(balance)[0]}'
    _, side, subsystem = _place(balance)
    return Finding(
        'unknown', side, subsystem, (WHERE[balance][1],), regime, None, (), most, float('nan'),
        1.0, rivals_of(replace(search.rounds[0], adopted=False)),
        f'No effect of the catalogue explains it; it is best described as {text}.')


def described(effort: Effort) -> str:
    """Return an effort in words."""
    where = WHERE[effort.balance][0]
    if isinstance(effort, Line):
        of, unit = REPEATS[effort.argument]
        return f'{where} that repeats every {effort.period:.3g} {unit} {of}'
    if isinstance(effort, Swing):
        return (f'{where} that swings every {effort.period:.3g} s in a fixed direction, as on a '
                'deck that tilts')
    if isinstance(effort, Wave):
        return (f'{where} of waves of the ground, {effort.period:.3g} m long, at '
                f'{math.degrees(effort.way):.0f}° to the x axis of the map')
    if effort.argument in PAST:
        return f'{where} that follows {PAST[effort.argument][2]}'
    if effort.argument in RATED:
        _, _, rate, quantity = RATED[effort.argument]
        return f'{where} in proportion to {rate}, by a smooth function of {quantity}'
    return f'{where}, a smooth function of {effort.argument.replace("_", " ")}'


def _place(balance: str) -> tuple[str, str, str]:
    # Unit, side and part of the robot of a balance or a reading.
    if balance in READINGS:
        return 'rad/s', READINGS[balance][1], Subsystem.SENSOR.value
    _, _, side, subsystem, unit = BALANCES[balance]
    return unit, side, subsystem
