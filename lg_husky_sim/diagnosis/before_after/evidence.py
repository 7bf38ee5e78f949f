# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Evidence of every change from each recording's quadratic: one linear solve a hypothesis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr


@dataclass(frozen=True, eq=False)
class Quadratic:
    """
    A recording's negative log likelihood near a point p, as 0.5 θ'Hθ - h'θ + c.

    Parameters
    ----------
    recording : str
    after : bool
    place : numpy.ndarray, shape (n,)
        The point p, where the recording was fitted.
    curvature : numpy.ndarray, shape (n, n)
    slope : numpy.ndarray, shape (n,)
    cost : float
        The constant c [nats].
    lasting : mapping of int to float
        By index of a limit that this recording only exceeds: the share of its curvature that is
        left without the stretch that says most.

    """

    recording: str
    after: bool
    place: FloatArray
    curvature: FloatArray
    slope: FloatArray
    cost: float = 0.0
    lasting: Mapping[int, float] = field(default_factory=dict)

    def value(self, at: FloatArray) -> float:
        """Return the negative log likelihood at parameters [nats]."""
        return float(0.5 * at @ self.curvature @ at - self.slope @ at + self.cost)

    def among(self, index: NDArray[np.intp]) -> Quadratic:
        """Return this for some of the parameters; it does not depend on the others."""
        return replace(self, place=self.place[index], slope=self.slope[index],
                       curvature=self.curvature[np.ix_(index, index)],
                       lasting={i: self.lasting[k] for i, k in enumerate(index.tolist())
                                if k in self.lasting})

    def less(self, shift: FloatArray) -> Quadratic:
        """Return this as a function of the parameters less a shift of them."""
        moved = self.curvature @ shift
        return replace(self, place=self.place - shift, slope=self.slope - moved,
                       cost=self.cost + float(0.5 * shift @ moved - self.slope @ shift))

    def curved(self, k: int, at: float, least: float, lasting: float) -> Quadratic:
        """Return this with so much curvature at least along a parameter, about a value of it."""
        more = max(least - float(self.curvature[k, k]), 0.0)
        curvature, slope = np.array(self.curvature), np.array(self.slope)
        curvature[k, k] += more
        slope[k] += more * at
        return replace(self, curvature=curvature, slope=slope,
                       cost=self.cost + 0.5 * more * at ** 2,
                       lasting={**self.lasting, k: lasting} if more > 0.0 else self.lasting)

    def told(self, sd: FloatArray) -> FloatArray:
        """Return what it says of each parameter (inverse variance), of a prior of these sd."""
        precision = self.curvature + np.diag(sd ** -2)
        return np.asarray(np.maximum(
            1.0 / np.diag(np.linalg.inv(precision)) - sd ** -2, 0.0), dtype=np.float64)

    def flatter(self, k: int, by: float) -> Quadratic:
        """Return this with so many times the curvature along a parameter, about its place."""
        at, scale = self.place, np.ones(self.place.size)
        scale[k] = np.sqrt(by)
        curvature = scale[:, None] * self.curvature * scale
        slope = curvature @ at - scale * (self.curvature @ at - self.slope)
        return replace(self, curvature=curvature, slope=slope,
                       cost=self.value(at) - float(0.5 * at @ curvature @ at - slope @ at))

    def fading(self) -> Quadratic:
        """Return this without the stretch that exceeds each of the limits the most."""
        found = self
        for k, share in self.lasting.items():
            found = found.flatter(k, share)
        return found

    def only_exceeds(self, which: NDArray[np.intp]) -> bool:
        """Return whether these are limits of which it tells only that it exceeds them."""
        silent = np.diag(self.curvature)[which] == 0.0
        return all(k in self.lasting or none for k, none in zip(
            which.tolist(), silent, strict=True)) and not np.all(silent)

    def varying(self, sd: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Return curvature, slope and log evidence with the recording's own deviation."""
        inner = sd[:, None] * self.curvature * sd
        inner[np.diag_indices(sd.size)] += 1.0
        left = sd[:, None] * np.linalg.solve(inner, sd[:, None] * np.column_stack(
            [self.curvature, self.slope]))
        curvature = self.curvature - self.curvature @ left[:, :-1]
        slope = self.slope - self.curvature @ left[:, -1]
        sign_log = np.linalg.slogdet(inner)[1]
        return curvature, slope, float(
            0.5 * self.slope @ left[:, -1] - 0.5 * sign_log - self.cost)


@dataclass(frozen=True, eq=False)
class Solution:
    """
    A hypothesis solved.

    Parameters
    ----------
    evidence : float
        Log evidence [nats], up to a constant shared by all.
    shared : numpy.ndarray, shape (n,)
        Parameters before.
    shift : numpy.ndarray, shape (k,)
        What differs after.
    covariance : numpy.ndarray, shape (k, k)

    """

    evidence: float
    shared: FloatArray
    shift: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, eq=False)
class Evidence:
    """
    All recordings' quadratics with the priors.

    Parameters
    ----------
    quadratics : sequence of Quadratic
    mean, sd : numpy.ndarray, shape (n,)
        Prior of what is shared.
    recording_sd : numpy.ndarray, shape (n,)
        Deviations from recording to recording.
    change_sd : numpy.ndarray, shape (n,)
        Prior of a change.
    bounds : tuple of numpy.ndarray, optional
        Least and largest values, shapes (n,), of what has changed; none if not given.

    """

    quadratics: Sequence[Quadratic]
    mean: FloatArray
    sd: FloatArray
    recording_sd: FloatArray
    change_sd: FloatArray
    bounds: tuple[FloatArray, FloatArray] | None = None

    def estimated(self, weight: float, rounds: int, free: float) -> Evidence:
        """
        Return this with deviations from recording to recording as these data have them.

        By expectation and maximisation with both sets free, so that a change is none of them::

            sd^2 = (weight k sd_assumed^2 + sum of E[deviation^2]) / (weight + n_recordings)
            k = max(1, n_others / sum of sd_assumed^2 / sd^2 of all other parameters)

        where k is what the others have in common, of rough ground say: the likeliest scale of
        inverse gamma distributions. But none is larger than by how far apart the fits of the
        parameter ended, for where parameters depend on each other, derivatives that are a little
        off promise that a recording is far from where it ended. With places p of curvature c, for
        each parameter by itself::

            E[deviation^2] = s^2 ((p - m)^2 + 1 / sum of w) + (1 - s) sd^2
            w = c / (1 + sd^2 c),  s = sd^2 w,  m = sum of w p / sum of w for each set

        So recordings that say nothing of a parameter leave it as assumed, and those that say much
        add what they are apart (as a moderated variance does, Smyth 2004).

        Parameters
        ----------
        weight : float
            Recordings that the assumed deviations are worth.
        rounds : int
            Of the iteration.
        free : float
            Factor on the prior of a change: one of any size is no deviation.

        Returns
        -------
        Evidence

        """
        n, most = self.mean.size, self._apart(weight, rounds)
        found = replace(self, change_sd=free * self.change_sd)
        for _ in range(rounds):
            at, covariance, _ = found._posterior(np.arange(n))
            sd = found.recording_sd
            squares = np.zeros(n)
            for one in self.quadratics:
                level = np.hstack([np.eye(n), np.eye(n) if one.after else np.zeros((n, n))])
                left = sd[:, None] * one.curvature
                inner = left * sd
                inner[np.diag_indices(n)] += 1.0
                spread = np.linalg.inv(inner)
                move = spread @ left @ level
                deviation = spread @ (sd * one.slope) - move @ at
                squares += deviation ** 2 + np.diag(spread) + np.sum(
                    move @ covariance * move, axis=1)
            found = replace(found, recording_sd=np.minimum(most, np.sqrt(
                (weight * self._common(sd) * self.recording_sd ** 2 + sd ** 2 * squares)
                / (weight + len(self.quadratics)))))
        return replace(found, change_sd=self.change_sd)

    def _apart(self, weight: float, rounds: int) -> FloatArray:
        # The deviations of each parameter by itself, by how far apart the fits ended.
        sets = [[one for one in self.quadratics if one.after == after] for after in (False, True)]
        known = [(np.array([one.place for one in those]),
                  np.array([np.maximum(np.diag(one.curvature), 0.0) for one in those]))
                 for those in sets if those]
        sd = self.recording_sd
        for _ in range(rounds):
            squares = np.zeros(sd.size)
            for places, curvatures in known:
                w = curvatures / (1.0 + sd ** 2 * curvatures)
                total = np.maximum(w.sum(axis=0), np.finfo(np.float64).tiny)
                share = sd ** 2 * w
                off = places - (w * places).sum(axis=0) / total
                squares += (share ** 2 * (off ** 2 + 1.0 / total)
                            + (1.0 - share) * sd ** 2).sum(axis=0)
            sd = np.sqrt((weight * self._common(sd) * self.recording_sd ** 2 + squares)
                         / (weight + len(self.quadratics)))
        return sd

    def _common(self, sd: FloatArray) -> FloatArray:
        # By how much the variances of all other parameters exceed what is assumed.
        share = (self.recording_sd / np.maximum(sd, np.finfo(np.float64).tiny)) ** 2
        others = np.count_nonzero(share) - 1
        if others < 1:
            return np.ones(sd.size)
        return np.asarray(np.maximum(1.0, others / (share.sum() - share)), dtype=np.float64)

    def solve(self, changed: NDArray[np.intp]) -> Solution:
        """
        Return the solution where the parameters of these indices differ after.

        With bounds, their prior and with it the likelihood count inside only. For a parameter
        whose value after is a with standard deviation s, and was b before a change of prior c, the
        evidence is larger by::

            log P(lower < N(a, s) < upper) - log P(lower < N(b, c) < upper)

        and where a is outside, the solution is the likeliest with a at its bound.
        """
        n = self.mean.size
        at, covariance, evidence = self._posterior(changed)
        if self.bounds is not None and changed.size:
            level = np.hstack([np.eye(n)[changed], np.eye(changed.size)])
            lower, upper = (bound[changed] for bound in self.bounds)
            sd = np.sqrt(np.diag(level @ covariance @ level.T))
            evidence += _inside(level @ at, sd, lower, upper) - _inside(
                np.clip(at[changed], lower, upper), self.change_sd[changed], lower, upper)
            at = _bounded(at, covariance, level, lower, upper)
        return Solution(evidence, at[:n], at[n:], np.asarray(covariance[n:, n:], dtype=np.float64))

    @cached_property
    def nothing(self) -> float:
        """Log evidence of no change [nats]."""
        return self.solve(np.zeros(0, dtype=np.intp)).evidence

    @cached_property
    def without_one(self) -> tuple[Evidence, ...]:
        """Return this without each of the recordings; none where a set has no other one."""
        later = sum(one.after for one in self.quadratics)
        if min(later, len(self.quadratics) - later) < 2:
            return ()
        return tuple(replace(self, quadratics=[one for one in self.quadratics if one is not left])
                     for left in self.quadratics)

    @cached_property
    def without_a_stretch(self) -> tuple[Evidence, ...]:
        """Return this without the stretch of each recording that exceeds limits the most."""
        return tuple(replace(self, quadratics=[one.fading() if one is own else one
                                               for one in self.quadratics])
                     for own in self.quadratics)

    def told(self, changed: NDArray[np.intp], known: NDArray[np.intp]) -> float:
        """
        Return what parameters that differ gain over some of them by all but any one recording.

        No accident makes a robot exceed its limits for all of a recording. One that tells nothing
        else of what differs is left out but for the stretch that says most.

        Parameters
        ----------
        changed, known : numpy.ndarray of int
            Indices of the parameters that differ, and of those that do so anyway.

        Returns
        -------
        float
            The least of the gains without each of the recordings, at the deviations from recording
            to recording that all have; of all recordings where a set has but one [nats].

        """
        claimed = np.setdiff1d(changed, known)
        left = [fading if own.only_exceeds(claimed) else without
                for own, without, fading in zip(self.quadratics, self.without_one,
                                                self.without_a_stretch, strict=True)
                ] if self.without_one else [self]
        return min(one.solve(changed).evidence - (
            one.solve(known).evidence if known.size else one.nothing) for one in left)

    @cached_property
    def _varying(self) -> list[tuple[FloatArray, FloatArray, float]]:
        return [one.varying(self.recording_sd) for one in self.quadratics]

    def _posterior(self, changed: NDArray[np.intp]) -> tuple[FloatArray, FloatArray, float]:
        # Mean and covariance of what is shared and of what differs, and the log evidence.
        n, k = self.mean.size, changed.size
        precision = np.zeros((n + k, n + k))
        slope = np.zeros(n + k)
        precision[np.arange(n), np.arange(n)] = 1.0 / self.sd ** 2
        slope[:n] = self.mean / self.sd ** 2
        own = np.arange(n, n + k)
        precision[own, own] = 1.0 / self.change_sd[changed] ** 2
        prior = (-0.5 * float(np.sum((self.mean / self.sd) ** 2))
                 - float(np.sum(np.log(self.sd))) - float(np.sum(np.log(self.change_sd[changed]))))
        for one, (curvature, direction, constant) in zip(
                self.quadratics, self._varying, strict=True):
            prior += constant
            precision[:n, :n] += curvature
            slope[:n] += direction
            if one.after and k:
                precision[:n, n:] += curvature[:, changed]
                precision[n:, :n] += curvature[changed]
                precision[n:, n:] += curvature[np.ix_(changed, changed)]
                slope[n:] += direction[changed]
        covariance = np.linalg.inv(precision)
        at = covariance @ slope
        evidence = prior + 0.5 * float(slope @ at) - 0.5 * float(np.linalg.slogdet(precision)[1])
        return at, np.asarray(covariance, dtype=np.float64), evidence


def joined(parts: Sequence[Quadratic]) -> list[Quadratic]:
    """Return the sums over the stretches of each recording, which share its deviation."""
    found: dict[str, Quadratic] = {}
    for part in parts:
        there = found.get(part.recording)
        found[part.recording] = part if there is None else Quadratic(
            part.recording, part.after, part.place, there.curvature + part.curvature,
            there.slope + part.slope, there.cost + part.cost)
    return list(found.values())


def _inside(value: FloatArray, sd: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    # Log probability; of two bounds far apart for their deviations.
    return float(np.sum(log_ndtr((value - lower) / sd) + log_ndtr((upper - value) / sd)))


def _bounded(at: FloatArray, covariance: FloatArray, level: FloatArray, lower: FloatArray,
             upper: FloatArray) -> FloatArray:
    # The likeliest with what is outside at its bound: a Gaussian given some of its values.
    held, found = np.zeros(lower.size, dtype=bool), at
    while True:
        value = level @ found
        outside = ((value < lower) | (value > upper)) & ~held
        if not np.any(outside):
            return found
        held |= outside
        rows = level[held]
        found = at - covariance @ rows.T @ np.linalg.solve(
            rows @ covariance @ rows.T, rows @ at - np.clip(level @ at, lower, upper)[held])
