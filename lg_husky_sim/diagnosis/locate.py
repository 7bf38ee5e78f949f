# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
In which part of the robot, and when, the physics of a fit is off.

Every part has one or more families of unknown inputs: a torque on the drivetrains, a force
between wheels and ground, a force or a moment on the chassis, a share of the motor voltage, an
effort while the command changes, an error of a sensor. Each family is estimated alone, together
with what a recalibration can move; the one with the most evidence names the part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.diagnosis.smoother import explain, Explanation
from lg_husky_sim.diagnosis.unknown_inputs import binned, Bins, Input, Responses, Term
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Parts in the order in which power flows, and the sensors.
SUBSYSTEMS = ('command', 'electrical', 'drivetrain', 'traction', 'translation', 'rotation',
              'sensor')
#: Width of a cell of the picture of parts over time [s].
CELL = 0.5
#: Longest data that are looked at [s]; beyond, the pieces that the fit explains worst.
LONGEST = 400.0
#: Evidence that healthy recordings do not reach [nats].
CERTAIN = 20.0
#: Bins of a quantity that an effort is held against.
COUNT = 15


@dataclass(frozen=True)
class Family:
    """
    Inputs that are estimated together.

    Parameters
    ----------
    name : str
        In words.
    subsystem : str
        Part of the robot that they sit in.
    inputs : tuple of Input
    weight : float
        Factor on the evidence: below 1 for a family that can imitate others.
    """

    name: str
    subsystem: str
    inputs: tuple[Input, ...]
    weight: float = 1.0


@dataclass(frozen=True, eq=False)
class Located:
    """
    What was found.

    Parameters
    ----------
    observations : Observations
        That were looked at.
    bins : tuple of Bins
    responses : Responses
    families : tuple of Family
    explanations : tuple of Explanation
        One for each family; standard deviations only for the best.
    """

    observations: Observations
    bins: tuple[Bins, ...]
    responses: Responses
    families: tuple[Family, ...]
    explanations: tuple[Explanation, ...]

    def score(self, index: int) -> float:
        """Return the weighted evidence of a family [nats]."""
        return self.families[index].weight * self.explanations[index].evidence

    def best(self, subsystem: str = '') -> int:
        """Return the number of the best family, of a part or of all; -1 where there is none."""
        known = [i for i, f in enumerate(self.families) if subsystem in ('', f.subsystem)]
        return max(known, key=self.score, default=-1)

    @property
    def certain(self) -> bool:
        """Whether the best family explains more than what healthy recordings leave."""
        top = self.best()
        return top >= 0 and self.explanations[top].evidence > CERTAIN

    def gains(self) -> dict[tuple[str, int, str], float]:
        """Return what the best family explains [nats] by recording, segment and channel."""
        top = self.best()
        found: dict[tuple[str, int, str], float] = {}
        if top >= 0:
            for bins, estimate in zip(self.bins, self.explanations[top].estimates, strict=True):
                piece = self.observations.pieces[bins.piece]
                for channel, gain in zip(bins.channels, estimate.gains, strict=True):
                    key = (piece.recording, piece.index, channel)
                    found[key] = found.get(key, 0.0) + float(gain)
        return found

    @property
    def strengths(self) -> dict[str, float]:
        """Evidence of each part relative to the strongest, 0 to 1, strongest first."""
        found = {name: max((self.score(i) for i, f in enumerate(self.families)
                            if f.subsystem == name), default=0.0) for name in SUBSYSTEMS}
        top = max(found.values(), default=0.0)
        ordered = sorted(found.items(), key=lambda item: -item[1])
        return {name: value / top if top > 0.0 else 0.0 for name, value in ordered}


def _input(name: str, unit: str, size: float, *terms: Term) -> Input:
    return Input(name, unit, size, terms)


def families() -> tuple[Family, ...]:
    """
    Return the families that are held against each other.

    Returns
    -------
    tuple of Family
        Parts that act through the same balance differ in what their effort goes with: one of
        the command path acts while the command changes, an electrical one is a share of the
        voltage or current of both sides alike, one of the drivetrain is free on either side.
    """
    left, right = ('T_coulomb_drivetrain_L',), ('T_coulomb_drivetrain_R',)
    contacts = (('T_slip_FL', 'T_slip_RL'), ('T_slip_FR', 'T_slip_RR'))
    force, moment = ('F_rolling_resistance',), ('F_yaw_pull',)

    def sides(unit: str, size: float, column: str, kind: str = '') -> tuple[Input, ...]:
        return tuple(_input(f'{side} drivetrain', unit, size,
                            Term(efforts, (), f'{column}_{side}{kind}' if column else 'one'))
                     for side, efforts in (('left', left), ('right', right)))

    def shared(name: str, column: str) -> tuple[Input, ...]:
        return (_input(name, 'N·m', 1.0, Term(left, (), f'{column}_left'),
                       Term(right, (), f'{column}_right')),)

    def sensor(name: str, unit: str, size: float, *pairs: tuple[str, str]) -> tuple[Input, ...]:
        return (_input(name, unit, size, *(Term((), (channel,), factor)
                                           for channel, factor in pairs)),)

    return (
        Family('torque while the command changes', 'command',
               sides('N·m', 1.0, 'voltage', ':change')),
        Family('torque with the commanded speed and yaw rate', 'command', (
            _input('torque with speed', 'N·m', 1.0, Term(left, (), 'voltage_common'),
                   Term(right, (), 'voltage_common')),
            _input('torque with yaw rate', 'N·m', 1.0,
                   Term(left, (), '-voltage_difference'),
                   Term(right, (), 'voltage_difference'))), 0.985),
        Family('torque with the voltage of both sides', 'electrical',
               shared('torque on each side', 'voltage')),
        Family('torque with the current of both sides', 'electrical',
               shared('torque on each side', 'current')),
        Family('torque on both drivetrains', 'drivetrain', sides('N·m', 1.0, ''), GENERAL),
        Family('torque against the rotation of the wheels', 'drivetrain',
               sides('N·m', 1.0, 'wheel', ':sign'), GENERAL),
        Family('torque on the left drivetrain', 'drivetrain', sides('N·m', 1.0, '')[:1]),
        Family('torque on the right drivetrain', 'drivetrain', sides('N·m', 1.0, '')[1:]),
        Family('force between wheels and ground', 'traction', tuple(
            _input(f'{side} contact', 'N·m', 1.0, Term(efforts))
            for side, efforts in zip(('left', 'right'), contacts, strict=True)), GENERAL),
        Family('force on the chassis', 'translation',
               (_input('chassis force', 'N', 5.0, Term(force)),)),
        Family('force with the acceleration', 'translation',
               (_input('chassis force', 'N', 5.0, Term(force, (), 'forward:rate')),)),
        Family('moment on the chassis', 'rotation',
               (_input('yaw moment', 'N·m', 1.0, Term(moment)),)),
        Family('moment with the yaw rate', 'rotation',
               (_input('yaw moment', 'N·m', 1.0, Term(moment, (), 'yaw_rate')),)),
        Family('error of the gyro', 'sensor',
               sensor('gyro error', 'rad/s', 0.02, ('yaw_rate', 'one'))),
        Family('factor of the gyro', 'sensor',
               sensor('gyro error', 'rad/s', 0.1, ('yaw_rate', 'yaw_rate'))),
        Family('factor of the left encoder', 'sensor',
               sensor('left encoder error', 'rad/s', 0.1, ('wheel_left', 'wheel_left'))),
        Family('factor of the right encoder', 'sensor',
               sensor('right encoder error', 'rad/s', 0.1,
                      ('wheel_right', 'wheel_right'))),
        Family('late stamps of the wheels', 'sensor',
               sensor('wheel rate error', 'rad/s', 0.1, ('wheel_left', 'wheel_left:rate'),
                      ('wheel_right', 'wheel_right:rate'))),
        Family('late stamps of the gyro', 'sensor',
               sensor('gyro error', 'rad/s', 0.02, ('yaw_rate', 'yaw_rate:rate'))),
        Family('late stamps of the pose', 'sensor',
               sensor('pose rate error', 'm/s', 0.02, ('advance', 'forward:rate'),
                      ('turn', 'yaw_rate:rate'))),
    )


#: Weight of a family that is free enough to imitate others.
GENERAL = 0.93


def _worst(observations: Observations, fit: Fit) -> tuple[Observations, Fit]:
    # At most LONGEST seconds: the pieces with the largest residual for their length.
    lengths = np.array([max(c.times[-1] for c in p.channels) - p.start
                        for p in observations.pieces])
    if float(np.sum(lengths)) <= LONGEST:
        return observations, fit
    residual = observations.measured - fit.solution.predicted
    energy = np.zeros(lengths.size)
    for one in observations.slices:
        part = residual[one.first:one.last]
        energy[one.piece] += float(np.mean(part ** 2)) / max(float(np.var(
            observations.measured[observations.channel_mask(one.channel)])), 1e-9)
    keep, total = [False] * lengths.size, 0.0
    for place in np.argsort(-energy, kind='stable'):
        if total < LONGEST:
            keep[place] = True
            total += float(lengths[place])
    rows = np.concatenate([np.full(s.last - s.first, keep[s.piece])
                           for s in observations.slices])
    solution = replace(fit.solution, predicted=fit.solution.predicted[rows],
                       jacobian=fit.solution.jacobian[rows])
    return observations.subset(keep), replace(fit, solution=solution)


def locate(observations: Observations, fit: Fit) -> Located:
    """
    Estimate every family of inputs.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        Recalibrated, nothing added.

    Returns
    -------
    Located
    """
    observations, fit = _worst(observations, fit)
    responses = Responses(observations, fit)
    bins = binned(observations, fit, responses.floor(fit.parameters))
    present = set(observations.channels)
    usable = tuple(f for f in families() if all(
        responses.has(one) and any(not t.channels or set(t.channels) & present
                                   for t in one.terms) for one in f.inputs))
    found = [explain(fit, bins, responses, f.inputs, spreads=False)
             for f in usable]
    located = Located(observations, bins, responses, usable, tuple(found))
    top = located.best()
    if top >= 0:
        found[top] = explain(fit, bins, responses, usable[top].inputs)
    return Located(observations, bins, responses, usable, tuple(found))


def subsystem_strengths(observations: Observations, fit: Fit) -> Mapping[str, float]:
    """
    Return how strong the evidence against each part of the robot is.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        Recalibrated, nothing added.

    Returns
    -------
    mapping of str to float
        Relative to the strongest, 0 to 1, strongest first.
    """
    return locate(observations, fit).strengths


def cells(located: Located, piece: int) -> tuple[FloatArray, FloatArray]:
    """
    Return what each part explains of one piece over time.

    Parameters
    ----------
    located : Located
    piece : int
        Place in ``located.bins``.

    Returns
    -------
    numpy.ndarray, shape (n_cells + 1,)
        Edges of the cells [s] on the recording's clock.
    numpy.ndarray, shape (7, n_cells)
        Gain of the best family of each of :data:`SUBSYSTEMS` [nats/s].
    """
    one = located.bins[piece]
    middle = 0.5 * (one.begins + one.ends)
    edges = np.arange(float(middle.min()), float(middle.max()) + CELL, CELL)
    found = np.zeros((len(SUBSYSTEMS), edges.size - 1))
    for row, name in enumerate(SUBSYSTEMS):
        best = located.best(name)
        if best >= 0:
            gains = located.explanations[best].estimates[piece].gains
            found[row] = np.histogram(middle, edges, weights=gains)[0] / CELL
    return edges, found


@dataclass(frozen=True, eq=False)
class Fingerprint:
    """
    A missing effort against the quantity that describes it best.

    Parameters
    ----------
    effort, unit : str
    argument : str
        Quantity.
    at, effort_values : numpy.ndarray, shape (n,)
        Samples.
    middles, means : numpy.ndarray, shape (n_bins,)
        Means of the effort in bins of the quantity.
    share : float
        Share of the effort's variance that the means explain where they were not taken.
    """

    effort: str
    unit: str
    argument: str
    at: FloatArray
    effort_values: FloatArray
    middles: FloatArray
    means: FloatArray
    share: float


#: Quantities that an effort is held against: column of the simulator and words.
ARGUMENTS: Sequence[tuple[str, str]] = (
    ('forward', 'speed [m/s]'), ('yaw_rate', 'yaw rate [rad/s]'),
    ('wheel_left', 'left wheel rate [rad/s]'), ('wheel_right', 'right wheel rate [rad/s]'),
    ('voltage_left', 'left voltage [V]'), ('voltage_right', 'right voltage [V]'),
    ('angle_left', 'left wheel angle [rad]'), ('angle_right', 'right wheel angle [rad]'),
    ('heading', 'heading [rad]'), ('x', 'x [m]'), ('time', 'time [s]'))


def fingerprints(located: Located) -> tuple[Fingerprint, ...]:
    """
    Describe the efforts of the best family.

    Parameters
    ----------
    located : Located

    Returns
    -------
    tuple of Fingerprint
        One for each input of the family, against the quantity that explains it best.
    """
    best = located.best()
    if best < 0:
        return ()
    explanation = located.explanations[best]
    found = []
    for place, one in enumerate(explanation.inputs):
        effort = np.concatenate([
            e.values[:, place] * located.responses.factor(bins.piece, one.terms[0].factor, e.times)
            for bins, e in zip(located.bins, explanation.estimates, strict=True)])
        times = np.concatenate([e.times for e in explanation.estimates])
        even = np.floor(times / 2.0).astype(np.int64) % 2 == 0
        tries = []
        for column, words in ARGUMENTS:
            at = times if column == 'time' else np.concatenate(
                [located.responses.signal(bins.piece, column, e.times)
                 for bins, e in zip(located.bins, explanation.estimates, strict=True)])
            if column.startswith('angle') or column == 'heading':
                at = np.mod(at, 2.0 * np.pi)
            tries.append(_against(one, words, at, effort, even))
        found.append(max(tries, key=lambda f: f.share))
    return tuple(found)


def _against(one: Input, words: str, at: FloatArray, effort: FloatArray,
             even: NDArray[np.bool_]) -> Fingerprint:
    low, high = (float(edge) for edge in np.quantile(at, (0.01, 0.99)))
    edges = np.linspace(low, max(high, low + 1e-9), COUNT + 1)
    cell = np.clip(np.searchsorted(edges, at, side='right') - 1, 0, COUNT - 1)

    def means(mask: NDArray[np.bool_]) -> FloatArray:
        count = np.bincount(cell[mask], minlength=COUNT)
        total = np.bincount(cell[mask], effort[mask], minlength=COUNT)
        return np.where(count > 2, total / np.maximum(count, 1), np.nan)

    left = np.zeros(effort.size)
    for mask in (even, ~even):
        left[~mask] = effort[~mask] - np.nan_to_num(means(mask))[cell[~mask]]
    share = 1.0 - float(np.sum(left ** 2)) / max(float(np.sum(effort ** 2)), 1e-12)
    return Fingerprint(one.name, one.unit, words, at, effort, 0.5 * (edges[1:] + edges[:-1]),
                       means(np.ones(effort.size, dtype=bool)), share)
