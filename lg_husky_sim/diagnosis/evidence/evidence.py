# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
One likelihood for every hypothesis: whitened residuals of an open-loop simulation.

For a structure with numbers p, the residuals ``r(p) = measured - simulated(p)`` of every drive are
whitened by one fixed linear operator W, and::

    cost(p) = sum (nu+1)/2 log(1 + (W r)^2 / nu) + sum ((p - nominal) / tolerance)^2 / 2

is a negative log posterior (innovations with Student's t). The gain of a hypothesis is what it
lowers the cost by, in nats: a likelihood ratio of exp(gain).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.evidence.bounded_step import step_inside
from lg_husky_sim.diagnosis.evidence.deviation import axle_inertias, slow_model
from lg_husky_sim.diagnosis.evidence.differences import Differences
from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive
from lg_husky_sim.diagnosis.evidence.frames import frame_of
from lg_husky_sim.diagnosis.evidence.noise import (
    fit_noise,
    Noise,
    reach_of,
    Whitener,
    whitener_of,
)
from lg_husky_sim.diagnosis.evidence.observation import Motion, observe, simulate
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.products import normal_matrix
from lg_husky_sim.diagnosis.evidence.repaired_commands import repaired
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np


@dataclass(frozen=True, eq=False)
class Fit:
    """
    The best point of a structure, as far as the search went.

    Parameters
    ----------
    point : Point
    cost : float
        Negative log posterior [nats].
    whitened : numpy.ndarray, shape (n,)
        Innovations of all drives, one after the other.
    jacobian : numpy.ndarray, shape (n, k)
        Of the simulated readings, whitened, by the places.
    slopes : tuple of numpy.ndarray
        The same of each drive, not whitened; empty where no fit goes on from here.
    predicted : tuple of numpy.ndarray
        Simulated readings of each drive.

    """

    point: Point
    cost: float
    whitened: FloatArray
    jacobian: FloatArray
    slopes: tuple[FloatArray, ...]
    predicted: tuple[FloatArray, ...]

    @property
    def bare(self) -> Fit:
        """Return the same without derivatives, which are as large as all the rest."""
        return replace(self, slopes=(), jacobian=np.zeros((0, 0)))

    @property
    def descent(self) -> FloatArray:
        """Where the cost falls: less its gradient by the places, shape (k,)."""
        return descent_of(self.jacobian, self.whitened, self.point)

    @property
    def promised(self) -> float:
        """Return what another step gains by these derivatives [nats]."""
        return promised_by(self.jacobian, self.whitened, self.point)


def descent_of(jacobian: FloatArray, whitened: FloatArray, point: Point) -> FloatArray:
    """Return less the gradient of the cost by the places of a point, shape (k,)."""
    pulled: FloatArray = jacobian.T @ (student.weights(whitened) * whitened)
    return pulled - point.weights * point.prior_residuals


def promised_by(jacobian: FloatArray, whitened: FloatArray, point: Point) -> float:
    """Return what one step from a point gains by derivatives [nats]."""
    normal = normal_matrix(jacobian, student.weights(whitened)) + np.diag(point.weights ** 2)
    slope = descent_of(jacobian, whitened, point)
    # A number that acts nowhere, of an effect without a prior, may leave it singular.
    return 0.5 * float(slope @ np.linalg.lstsq(normal, slope, rcond=None)[0])


class Evidence:
    """
    Drives with the noise of their residuals: scores, fits and gains.

    Parameters
    ----------
    drives : sequence of Drive
    names : sequence of str
        Names of the recordings in the order of time.
    noise : Noise
    whiteners : sequence of Whitener
        One a drive.
    pool : Threads
        For independent simulations.

    """

    def __init__(self, drives: Sequence[Drive], names: Sequence[str], noise: Noise,
                 whiteners: Sequence[Whitener], pool: Threads) -> None:
        self.drives = tuple(drives)
        self.names = tuple(names)
        self.noise = noise
        self.whiteners = tuple(whiteners)
        self.pool = pool
        self.count = sum(d.measured.size for d in drives)

    def plants(self, plant: Plant) -> list[Plant]:
        """Return the plant as it is in each drive."""
        onset = plant.onset
        earlier = onset.before(self.names) if onset is not None and onset.recording else ()
        return [plant.in_recording(d.recording, earlier) for d in self.drives]

    def motions(self, point: Point, probe: bool = False) -> list[Motion]:
        """Return the simulated motion of each drive."""
        return list(self.pool.map(lambda plant, drive: simulate(plant, drive, point.log, probe),
                                  self.plants(point.plant), self.drives))

    def predict(self, point: Point) -> tuple[FloatArray, ...]:
        """Return the simulated readings of each drive."""
        return tuple(self.pool.map(
            lambda plant, drive: observe(simulate(plant, drive, point.log), drive, point.log),
            self.plants(point.plant), self.drives))

    def whiten(self, columns: Sequence[FloatArray]) -> FloatArray:
        """Whiten residuals or differences, given drive by drive."""
        return np.concatenate(list(self.pool.map(
            lambda whitener, own: whitener.apply(own), self.whiteners, columns)))

    def residuals(self, predicted: Sequence[FloatArray]) -> FloatArray:
        """Return the innovations of simulated readings."""
        return self.whiten([d.measured - p for d, p in zip(self.drives, predicted, strict=True)])

    def cost(self, whitened: FloatArray, point: Point) -> float:
        """Return the negative log posterior of a point, up to a constant [nats]."""
        return student.cost(whitened) + 0.5 * float(np.sum(point.prior_residuals ** 2))

    def surprise(self, fit: Fit) -> float:
        """Return the cost of a fit under this noise, comparable under any noise [nats]."""
        return fit.cost + self._spread()

    def surprise_at(self, point: Point) -> float:
        """Return the same of a point."""
        return self.cost(self.residuals(self.predict(point)), point) + self._spread()

    def _spread(self) -> float:
        return sum(float(np.sum(np.log(w.scale))) for w in self.whiteners)

    @property
    def _differences(self) -> Differences:
        return Differences(self.predict, self.drives, self.pool)

    def derivatives(self, point: Point, predicted: Sequence[FloatArray],
                    which: Sequence[int]) -> list[FloatArray]:
        """Return derivatives of the readings of each drive by some of the places."""
        made = self._differences.by(point, predicted, which)
        return [np.column_stack([made[k][d] for k in which]) for d in range(len(self.drives))]

    def fit(self, start: Point, slopes: Sequence[FloatArray] | None = None, *,
            rounds: int = 8, renew: Sequence[int] | None = None, inflation: float = 1.0) -> Fit:
        """
        Fit the unknowns of a point by Gauss-Newton steps.

        Derivatives are kept from step to step while they foretell what a step gains.

        Parameters
        ----------
        start : Point
            Where to begin, and which unknowns there are.
        slopes : sequence of numpy.ndarray, optional
            Derivatives of the readings of each drive by the places; those of ``renew`` are taken
            anew. All are where none are given.
        rounds : int
            Largest number of steps.
        renew : sequence of int, optional
            Places whose derivatives are taken anew, at first and where steps disappoint; all of
            them if not given.
        inflation : float
            Factor on the standard deviation of the noise.

        Returns
        -------
        Fit

        """
        point = start
        predicted = self.predict(point)
        whitened = self.residuals(predicted) / inflation
        cost = self.cost(whitened, point)
        which = self._differences.along(point, range(len(point.unknowns)) if renew is None
                                        else renew)
        raw = [np.zeros((d.measured.size, len(point.unknowns))) for d in self.drives] if (
            slopes is None) else [np.array(one) for one in slopes]
        fresh = slopes is not None and renew is None
        damping = 1e-6
        rows = self.whiten(raw) / inflation if fresh else np.zeros((0, 0))
        for _ in range(rounds):
            if not fresh:
                for old, new in zip(raw, self.derivatives(point, predicted, which), strict=True):
                    old[:, which] = new
                rows = self.whiten(raw) / inflation
            weight = student.weights(whitened)
            normal = normal_matrix(rows, weight) + np.diag(point.weights ** 2)
            slope = descent_of(rows, whitened, point)
            scale = np.diag(normal) + 1e-12
            before, fell, hoped = cost, False, 1.0
            for _ in range(5):
                move = step_inside(normal + damping * np.diag(scale), slope,
                                   *(bound - point.places for bound in point.bounds))
                tried = point.at(point.places + move)
                hoped = float(slope @ move - 0.5 * move @ normal @ move)
                try:
                    seen = self.predict(tried)
                except LgHuskyError:
                    damping = max(damping, 1e-3) * 10.0
                    continue
                after = self.residuals(seen) / inflation
                value = self.cost(after, tried)
                if np.isfinite(value) and value < cost:
                    point, predicted, whitened, cost = tried, seen, after, value
                    damping = max(damping * 0.1, 1e-9)
                    fell = True
                    break
                if fresh:
                    break
                damping = max(damping, 1e-3) * 10.0
            if not fell:
                if fresh and hoped > setting('fit_converged'):
                    fresh = False
                    continue
                break
            if before - cost < setting('fit_converged'):
                break
            fresh = before - cost > setting('trusted_slopes') * hoped
        return Fit(point, cost, whitened, rows, tuple(raw), predicted)

    def renoised(self, fit: Fit, rounds: int = 6, longest: str = 'longest_time') -> Evidence:
        """
        Return this evidence with intensities that are likeliest for a fit's residuals.

        Parameters
        ----------
        fit : Fit
            Whose residuals tell the noise.
        rounds : int
            Largest number of steps.
        longest : str
            Setting: the longest time constant of a disturbance.

        Returns
        -------
        Evidence

        """
        plants = self.plants(fit.point.plant)
        drives = self._repaired(fit, plants)
        predicted = [p if d is old else observe(simulate(plant, d, fit.point.log), d,
                                                fit.point.log)
                     for d, old, plant, p in zip(drives, self.drives, plants, fit.predicted,
                                                 strict=True)]
        frames = [frame_of(d, plant, simulate(plant, d, fit.point.log, True), p, fit.point.log,
                           reach_of(self.noise))
                  for d, plant, p in zip(drives, plants, predicted, strict=True)]
        models = self.deviations(fit.point)
        residuals = [d.measured - p for d, p in zip(drives, predicted, strict=True)]
        noise = fit_noise(self.noise, frames, models, residuals, self.pool, rounds,
                          setting(longest), fit.point.structure.robot)
        whiteners = [whitener_of(f, m, noise) for f, m in zip(frames, models, strict=True)]
        return Evidence(drives, self.names, noise, whiteners, self.pool)

    def _repaired(self, fit: Fit, plants: Sequence[Plant]) -> list[Drive]:
        # The drives with the commands that their bases seem to have got.
        ends = np.cumsum([d.measured.size for d in self.drives])
        log = fit.point.log

        def one_of(number: int) -> Drive:
            drive, whitener = self.drives[number], self.whiteners[number]
            order = whitener.frame.order
            wheels = ~np.isin(drive.channels[order], [int(c) for c in (
                Channel.X, Channel.Y, Channel.HEADING)])

            def score(commands: TimeSeries) -> FloatArray:
                other = replace(drive, commands=commands)
                return whitener.apply(other.measured - observe(
                    simulate(plants[number], other, log), other, log))
            known = drive.commands is drive.logged
            e = fit.whitened[ends[number] - drive.measured.size:ends[number]]
            got = repaired(drive.logged, e if known else score(drive.logged), wheels,
                           whitener.frame.times[order], score)
            return drive if got is drive.commands else replace(drive, commands=got)
        return list(self.pool.map(one_of, range(len(self.drives))))

    def about(self, point: Point) -> Evidence:
        """Return this evidence, whitened about the motion of a point."""
        motions = self.motions(point, True)
        predicted = [observe(m, d, point.log) for m, d in zip(motions, self.drives, strict=True)]
        frames = [frame_of(d, plant, m, p, point.log, reach_of(self.noise))
                  for d, plant, m, p in zip(self.drives, self.plants(point.plant), motions,
                                            predicted, strict=True)]
        models = self.deviations(point)
        return self.with_whiteners([whitener_of(f, m, self.noise) for f, m in zip(
            frames, models, strict=True)])

    def deviations(self, point: Point) -> list[FloatArray]:
        """Return the deviation model of each drive."""
        numbers, inertias = point.numbers, axle_inertias(point.structure, point.numbers)
        return [slow_model(plant, numbers['mass'], numbers['yaw_inertia'], inertias)
                for plant in self.plants(point.plant)]

    def with_whiteners(self, whiteners: Sequence[Whitener]) -> Evidence:
        """Return this evidence with other whiteners."""
        return Evidence(self.drives, self.names, self.noise, whiteners, self.pool)


def evidence_of(drives: Sequence[Drive], names: Sequence[str], point: Point, noise: Noise,
                pool: Threads) -> Evidence:
    """Return the evidence of drives under a first guess of the noise."""
    return Evidence(drives, names, noise, (), pool).about(point)
