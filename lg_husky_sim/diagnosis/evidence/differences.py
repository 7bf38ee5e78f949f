# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Derivatives of predicted readings by the unknowns, by finite differences of simulations.

Numbers of the log that move readings of different sensors share a simulation, but for the delay
of a pose that tells when the robot was beyond a place where an effect acts: it moves them all. Of
what commands and readings are late only the sum counts: derivatives by lags of the commands are
the sums of those by the delays of the sensors, and derivatives by effects that are such delays are
those by them, since finite differences would tell them apart by their errors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
import itertools

from lg_husky_sim.diagnosis.evidence.drives import Drive
from lg_husky_sim.diagnosis.evidence.measured_place import is_measured
from lg_husky_sim.diagnosis.evidence.observation import APART, moved_by
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.signals import FloatArray
import numpy as np


@dataclass(frozen=True)
class Differences:
    """
    Difference quotients of what a model predicts.

    Parameters
    ----------
    predict : callable
        Returns the readings of each drive at a point.
    drives : sequence of Drive
    pool : concurrent.futures.Executor
        Threads for the independent simulations.

    """

    predict: Callable[[Point], tuple[FloatArray, ...]]
    drives: Sequence[Drive]
    pool: Executor

    def by(self, point: Point, predicted: Sequence[FloatArray], which: Sequence[int]
           ) -> dict[int, list[FloatArray]]:
        """
        Return derivatives of the readings of each drive by some places, by the place.

        Parameters
        ----------
        point : Point
            Where derivatives are taken.
        predicted : sequence of numpy.ndarray
            Readings of each drive there.
        which : sequence of int
            Places of its unknowns.

        """
        names = {u.name: k for k, u in enumerate(point.unknowns) if u.kind == 'log'}
        acting = self._lags(names)
        alike = {k: names[same] for k, u in enumerate(point.unknowns)
                 if k in which and u.kind == 'effect'
                 and (same := point.delays.get(u.name, '')) in names}
        lags = acting.keys() & {*which, *alike.values()}
        delays = [names[name] for name in APART[0] if name in names]
        wanted = {*which, *alike.values()}.difference(alike, lags).union(delays if lags else ())
        onset = point.structure.onset
        acting_by = {'delay_pose'} if any(is_measured(d, onset) for d in self.drives) else set()
        together = [own for row in APART if len(own := [
            names[name] for name in row
            if names.get(name) in wanted and name not in acting_by]) > 1]
        alone = wanted.difference(*together)
        made = dict(itertools.chain.from_iterable(self.pool.map(
            lambda ks: self._quotients(point, predicted, ks),
            [*([k] for k in sorted(alone)), *together])))
        for k in lags:
            made[k] = [sum(parts) if on else np.zeros_like(parts[0]) for on, *parts in zip(
                acting[k], *(made[delay] for delay in delays), strict=True)]
        for k, delay in alike.items():
            unknown = point.unknowns[k]
            slope = unknown.value(point.places[k]) if unknown.logarithmic else 1.0
            made[k] = [slope * part for part in made[delay]]
        return made

    def along(self, point: Point, which: Sequence[int]) -> list[int]:
        """
        Return places with those whose derivatives must be of the same point.

        An effect that is a delay, beside a delay of the log whose derivative is older, could be
        told from it by what has changed since.
        """
        if not any(point.unknowns[k].name in point.delays for k in which):
            return list(which)
        names = {u.name: k for k, u in enumerate(point.unknowns) if u.kind == 'log'}
        late = [*self._lags(names), *(names[name] for name in APART[0] if name in names)]
        return [*which, *(k for k in late if k not in which)]

    def _lags(self, names: Mapping[str, int]) -> dict[int, list[bool]]:
        # Places of the lags of commands, and whether each delays each drive.
        each = [('command_delay', d.late, d.own_lag) for d in self.drives]
        return {names[name]: [name in own for own in each]
                for name in dict.fromkeys(itertools.chain(*each)) if name in names}

    def _quotients(self, point: Point, predicted: Sequence[FloatArray], ks: Sequence[int]
                   ) -> list[tuple[int, list[FloatArray]]]:
        # By places that move different readings, if there is more than one.
        steps = np.zeros(len(point.unknowns))
        for k in ks:
            unknown = point.unknowns[k]
            over = point.places[k] + unknown.step > unknown.upper
            steps[k] = -unknown.step if over else unknown.step
        shifted = self.predict(point.at(point.places + steps))
        changes = [a - b for a, b in zip(shifted, predicted, strict=True)]
        if len(ks) == 1:
            return [(ks[0], [change / steps[ks[0]] for change in changes])]
        found = []
        for k in ks:
            parts = [np.zeros_like(change) for change in changes]
            for part, change, drive in zip(parts, changes, self.drives, strict=True):
                for rows in moved_by(point.unknowns[k].name, drive):
                    part[rows] = change[rows] / steps[k]
            found.append((k, parts))
        return found
