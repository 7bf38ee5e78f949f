# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A decision as a diagnosis: findings in words and numbers, and where the robot is off."""

from __future__ import annotations

from collections.abc import Sequence
import math

from lg_husky_sim.diagnosis.before_after.comparison import Block, Candidate
from lg_husky_sim.diagnosis.before_after.decision import Decision
from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.prediction import CHANNELS, residual
from lg_husky_sim.diagnosis.before_after.settings import Quantity, Settings
from lg_husky_sim.diagnosis.result import (
    Estimate,
    Finding,
    Indistinguishable,
    Mismatch,
    Rivalry,
)
from lg_husky_sim.reporting.words import number, with_interval
import numpy as np

#: Names of the channels in a diagnosis, with the part of the robot that each belongs to.
_NAMES = {'left': ('wheel_left', 'drivetrain'), 'right': ('wheel_right', 'drivetrain'),
          'yaw': ('yaw_rate', 'rotation'), 'ahead': ('advance', 'translation'),
          'turn': ('turn', 'rotation')}


def estimates(one: Candidate, settings: Settings) -> tuple[Estimate, ...]:
    """Return what a change tells of its parameters after it, with 95 % intervals."""
    wide = settings.decision['confidence_z'] * one.sd
    known = {q.name: q for q in settings.quantities}
    found = []
    for k, name in enumerate(one.parameters):
        if name in one.change.aside:
            continue
        quantity = known[name]
        at = one.before[k] + one.shift[k]
        value, low, high = (_value(quantity, at + side * wide[k]) for side in (0.0, -1.0, 1.0))
        found.append(Estimate(name, value, quantity.unit, low, high))
    return tuple(found)


def _value(quantity: Quantity, z: float) -> float:
    value = math.exp(min(z, math.log(quantity.upper))) if quantity.logarithmic else float(z)
    return float(np.clip(value, quantity.lower, quantity.upper))


def statement(one: Candidate, settings: Settings) -> str:
    """Return one sentence with the numbers before and after."""
    known = {q.name: q for q in settings.quantities}
    parts = []
    for k, after in enumerate(estimates(one, settings)):
        before = _value(known[after.name], float(one.before[k]))
        if after.high > after.low:
            # To a hundredth of that interval: what is less is nothing beside it.
            before = round(before, 2 - math.floor(math.log10(after.high - after.low)))
        parts.append(f'{known[after.name].meaning} {number(before)} → '
                     f'{with_interval(after.value, after.low, after.high, after.unit)}')
    return f'{one.change.title[0].upper()}{one.change.title[1:]}: {"; ".join(parts)}.'


def findings(decisions: Sequence[Decision], settings: Settings) -> tuple[Finding, ...]:
    """Return what is claimed, one finding a change."""
    total = sum(one.gain for one in decisions)
    return tuple(_finding(one, settings, one.gain / total) for one in decisions if one.gain > 0.0)


def _finding(decision: Decision, settings: Settings, share: float) -> Finding:
    named = decision.named
    rivals = tuple(Rivalry(one.change.effect, one.change.side, one.gain)
                   for one in decision.rivals)
    if named is None:
        near = decision.rivals[0].change if decision.rivals else None
        return Finding('unknown', 'none', near.subsystem if near else 'drivetrain',
                       near.elements if near else (), near.regime if near else '', None, (),
                       decision.unknown, decision.chance, share, rivals,
                       'Something has changed that is none of the known changes: the later '
                       'recordings need other parameters than the earlier ones.')
    change = named.change
    effect, side = change.effect, change.side
    for one in estimates(named, settings):
        if one.name == 'gyro_factor' and one.value < 0.0:
            effect = 'gyro_sign'
        if one.name == 'pull':
            side = 'left' if one.value > 0.0 else 'right'
    return Finding(effect, side, change.subsystem, change.elements, change.regime,
                   None, estimates(named, settings), named.gain, decision.chance, share, rivals,
                   statement(named, settings))


def not_told_apart(decisions: Sequence[Decision], settings: Settings
                   ) -> tuple[Indistinguishable, ...]:
    """Return the names that the data leave open, and the sensors and drives that would tell."""
    found: dict[Indistinguishable, None] = {}
    for decision in decisions:
        if len(decision.tied) < 2:
            continue
        effects = decision.tied[:int(settings.decision['group'])]
        named = [s for s in settings.separations if s.effects & set(effects)]
        closest = sorted(named, key=lambda s: -len(s.effects & set(effects)))[:2]
        found[Indistinguishable(
            effects, tuple(dict.fromkeys(x for s in closest for x in s.sensors)),
            tuple(dict.fromkeys(x for s in closest for x in s.drives)))] = None
    return tuple(found)


def mismatches(block: Block, after: Sequence[Drive], decision: Decision, settings: Settings
               ) -> tuple[Mismatch, ...]:
    """Return the stretches of the later drives that the base before does not explain."""
    numbers = settings.decision
    found: list[Mismatch] = []
    named = decision.named
    for drive in after:
        earlier = residual(block.base, drive, block.before)
        later = residual(block.base, drive, block.after)
        for stream, rows in earlier.items():
            times = drive.bins[stream].centres()
            times = times if stream != 'pose' else 0.5 * (times[1:] + times[:-1])
            for k, channel in enumerate(CHANNELS[stream]):
                if channel not in _NAMES:
                    continue
                width = max(1, round(numbers['smooth'] / max(float(np.median(np.diff(times))),
                                                             1e-9)))
                kernel = np.ones(width) / width
                smooth = np.convolve(rows[:, k], kernel, 'same')
                noise = max(float(np.std(np.convolve(later[stream][:, k], kernel, 'same'))), 1e-9)
                strength = np.abs(smooth) / noise
                name, part = _NAMES[channel]
                for begin, end, peak in _stretches(times, strength, numbers['strong']):
                    found.append(Mismatch(
                        drive.recording, name, round(begin, 3), round(end, 3), round(peak, 2),
                        part if named is None else named.change.subsystem))
    found.sort(key=lambda m: -m.strength * (m.end - m.start + numbers['smooth']))
    return tuple(found[:int(numbers['listed'])])


def _stretches(times: np.ndarray, strength: np.ndarray, strong: float
               ) -> list[tuple[float, float, float]]:
    on = np.flatnonzero(strength > strong)
    groups = np.split(on, np.flatnonzero(np.diff(on) > 1) + 1) if on.size else []
    return [(float(times[g[0]]), float(times[g[-1]]), float(np.max(strength[g]))) for g in groups]
