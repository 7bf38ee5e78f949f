# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Coefficients of the confidence, from the outcomes of trials.

For each kind of answer the share right is a logistic function of what informs about it,
``p = 1 / (1 + exp(-(c0 + c1 x1 + ...)))``. The coefficients maximise the likelihood of the
outcomes with independent Gaussian priors around zero, and around a stated share right for c0, so
that few outcomes do not make certainty.

Whether a name that is beyond chance is real has coefficients as well, one of them of the part of
the robot that it belongs to. What decides them are right
names, those that stand beside a right one, and those of robots that lack nothing: of a name that
stands in another's place nothing is learned about its size. Names of earlier versions that are
less likely real than not by the coefficients in force would not be said today: the confidence is
fitted to what is left of their answers without them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Any

from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.proof import catalogue
from lg_husky_sim.proof.scoring import judge
from lg_husky_sim.proof.settings import settings
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Json = Mapping[str, Any]

FloatArray = NDArray[np.float64]

#: Parts of the robot that effects belong to.
PARTS = tuple(sorted(set(catalogue.SUBSYSTEM.values())))

#: Answer to the names of its coefficients in the settings of the diagnosis.
COEFFICIENTS = {
    'known': ('name_constant', 'name_share', 'name_gain'),
    'nothing_missing': ('nothing_constant', 'nothing_beyond', 'nothing_left'),
    'unknown': ('unknown_constant', 'unknown_share_slope'),
    'changed': ('change_constant', 'change_chance'),
    'unchanged': ('unchanged_constant', 'unchanged_chance'),
    'real': ('real_constant', 'real_told', *(f'real_{part}' for part in PARTS)),
}


def _number(name: str) -> float:
    """Return a setting of the calibration."""
    return float(settings()['calibration'][name]['value'])


def _answer(line: Json) -> str:
    """Return what kind of answer was given: the verdict, or whether the robot changed."""
    if line['kind'] != 'before_after':
        return str(line['verdict'])
    return 'unchanged' if line['verdict'] == 'nothing_missing' else 'changed'


def _row(verdict: str, features: Json) -> list[float]:
    """Return what multiplies the coefficients of an answer."""
    if verdict == 'nothing_missing':
        left = float(features['share']) * max(float(features['gain']), 1.0)
        return [1.0, float(float(features['chance']) < _number('false_alarm_rate')),
                math.log10(max(left, 1.0))]
    if verdict in ('unchanged', 'changed'):
        return [1.0, math.log10(max(float(features['chance']), 1e-12))]
    share = math.log(min(max(float(features['share']), 1e-3), 10.0))
    if verdict == 'unknown':
        return [1.0, share]
    return [1.0, share, math.log10(max(float(features['gain']), 1.0))]


def _weakest(line: Json) -> Json:
    """Return the features with the gain of the weakest name; up to a version, of the first."""
    features: Json = line['features']
    if 'margin' not in features or not line['said']:
        return features
    return {**features, 'gain': min(float(one['gain']) for one in line['said'])}


def _told(name: Json, features: Json) -> list[float]:
    """Return what multiplies the coefficients of whether a name is real."""
    count = features.get('readings', _number('readings'))
    part = catalogue.SUBSYSTEM.get(name['effect'])
    return [1.0, math.log10(2.0 * max(float(name['gain']), 1.0) / count),
            *(float(part == one) for one in PARTS)]


def _is_said(name: Json, features: Json) -> bool:
    """Return whether a name would be said today."""
    if name['gain'] is None or name['effect'] not in catalogue.SUBSYSTEM:
        return True
    return sum(_number(coefficient) * x for coefficient, x in zip(
        COEFFICIENTS['real'], _told(name, features), strict=True)) > 0.0


def _as_today(line: Json) -> Json:
    """Return an answer without the names that are too little to be said today."""
    if line['kind'] == 'before_after' or line['verdict'] != 'known':
        return line
    features: Json = line['features']
    kept = [one for one in line['said'] if _is_said(one, features)]
    if len(kept) == len(line['said']):
        return line
    if not kept:
        return {**line, 'verdict': 'nothing_missing', 'said': [], 'groups': [],
                'features': {**features, 'chance': 0.0}}
    weakest = min((float(one['gain']) for one in kept if one['gain'] is not None),
                  default=features['gain'])
    return {**line, 'said': kept, 'features': {**features, 'gain': weakest}}


def _names(line: Json) -> list[tuple[list[float], bool]]:
    """Return what multiplies the coefficients of whether a name is real, and whether it is."""
    if line['kind'] not in ('none', 'single', 'pair'):
        return []
    true = {one['effect'] for one in line['true']}
    said = [one for one in line['said'] if one['effect'] != 'unknown' and one['gain'] is not None]
    if true and not any(one['effect'] in true for one in said):
        return []
    return [(_told(one, line['features']), one['effect'] in true) for one in said]


def calibrated(lines: Sequence[Json], slopes: Mapping[str, float] | None = None
               ) -> dict[str, tuple[float, int, int]]:
    """
    Fit the coefficients of the confidence.

    Parameters
    ----------
    lines : sequence of mapping
        Outcomes with the features of their confidence.
    slopes : mapping of str to float, optional
        Coefficients that keep their values; the others are fitted beside them. Few outcomes tell
        how often a tool is right, but not what informs about it.

    Returns
    -------
    dict
        Coefficient to its value, the number of outcomes, and how many of them were right.

    Raises
    ------
    LgHuskyError
        If features are damaged, or no outcome has any.

    """
    rows: dict[str, list[list[float]]] = {name: [] for name in COEFFICIENTS}
    right: dict[str, list[float]] = {name: [] for name in COEFFICIENTS}
    for line in lines:
        if not line.get('features'):
            continue
        try:
            now = _as_today(line)
            answer = _answer(now)
            row = _row(answer, _weakest(now)) if answer in rows else []
            said = _names(line) if judge(line).right is not None else []
        except (KeyError, TypeError, ValueError, ZeroDivisionError) as error:
            raise LgHuskyError(f'case {line["case"]}: the features of its confidence need the '
                               f'numbers share, chance and gain: {error}') from error
        mark = judge(now).right
        if row and mark is not None:
            rows[answer].append(row)
            right[answer].append(mark)
        for told, real in said:
            rows['real'].append(told)
            right['real'].append(float(real))
    if not any(right.values()):
        raise LgHuskyError('no outcome has the features of its confidence: they are of an '
                           'earlier version')
    found = {}
    for verdict, names in COEFFICIENTS.items():
        x = np.array(rows[verdict]).reshape(-1, len(names))
        y = np.array(right[verdict])
        kept = [None if slopes is None else slopes.get(name) for name in names]
        for name, value in zip(names, _fit(x, y, kept), strict=True):
            found[name] = (value, y.size, int(np.sum(y)))
    return found


def _fit(x: FloatArray, y: FloatArray, kept: Sequence[float | None]) -> FloatArray:
    """Return the most probable coefficients; those that are kept are given."""
    centre = np.zeros(x.shape[1])
    share = _number('right')
    centre[0] = math.log(share / (1.0 - share))
    free = np.array([value is None for value in kept])
    found = np.array([c if value is None else value
                      for c, value in zip(centre, kept, strict=True)])

    def cost(c: FloatArray) -> float:
        z = x[:, free] @ c + x[:, ~free] @ found[~free]
        return float(np.sum(np.logaddexp(0.0, z) - y * z)
                     + 0.5 * np.sum(((c - centre[free]) / _number('spread')) ** 2))
    found[free] = minimize(cost, centre[free], method='BFGS').x
    return found
