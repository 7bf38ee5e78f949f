# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Look at every candidate once: the signature it leaves, and how much of the residual it explains.

A signature is the change of all predictions when the effect is put into the fitted model, one
column for each parameter or for each size. After whitening, and after everything has been
projected out that a recalibration could explain, the drop of the half sum of squares that a
signature achieves is its score in nats. An effect that begins at a time or a place leaves the
same signature after it and none before, since the memory of the channels is short.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.candidates import Candidate, effect_entries, neutral
from lg_husky_sim.diagnosis.onsets import Onsets
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Onset
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Signature:
    """
    What a candidate changes.

    Parameters
    ----------
    candidate : Candidate
    start : mapping of str to float
        Size at which the columns were taken.
    columns : numpy.ndarray, shape (n_values, k)
        Change of the predictions for the whole size.
    free_sign : bool
        Whether the columns may be taken with either sign.
    """

    candidate: Candidate
    start: Mapping[str, float]
    columns: FloatArray
    free_sign: bool


@dataclass(frozen=True)
class Score:
    """
    What a signature explains.

    Parameters
    ----------
    signature : Signature
    gain : float
        Drop of the half sum of squares [nats].
    size : tuple of float
        Best multiples of the columns.
    onset : Onset or None
    placebo : float
        Largest further gain when it is also on in a single recording before the onset [nats].
    """

    signature: Signature
    gain: float
    size: tuple[float, ...]
    onset: Onset | None = None
    placebo: float = 0.0


def without_columns(score: Score) -> Score:
    """Return a score without the columns of its signature, which a refit does not need."""
    return replace(score, signature=replace(
        score.signature, columns=np.zeros((0, score.signature.columns.shape[1]))))


def signatures_of(candidate: Candidate, structure: Structure, parameters: Parameters,
                  extra: Mapping[str, float], observations: Observations, base: FloatArray
                  ) -> list[Signature]:
    """
    Simulate a candidate on top of a fitted model.

    Parameters
    ----------
    candidate : Candidate
    structure, parameters, extra
        The fitted model.
    observations : Observations
    base : numpy.ndarray, shape (n_values,)
        Its prediction.

    Returns
    -------
    list of Signature
        One for each start; empty where the candidate does not fit the structure or blows up.
    """
    always = replace(candidate.effect, late=False)
    try:
        model = compile_model(replace(structure, onset=None, effects=tuple(
            replace(e, late=False) for e in structure.effects)).with_effect(always))
    except LgHuskyError:
        return []
    found = []
    for start in candidate.starts:
        if candidate.signed:
            fixed = [p.name for p in always.parameters() if p.fixed]
            free = [name for name in start if name not in fixed]
            sizes = [{name: start[name] if name in (one, *fixed) else neutral(name)
                      for name in start} for one in free]
        else:
            sizes = [dict(start)]
        columns = []
        for values in sizes:
            entries = effect_entries(always, values)
            try:
                plant = model.at(parameters.with_entries(*entries))
            except LgHuskyError:
                continue
            change = observations.predict(plant, extra) - base
            if np.all(np.isfinite(change)) and np.max(np.abs(change), initial=0.0) < 1e4:
                columns.append(change)
        if columns and len(columns) == len(sizes):
            found.append(Signature(candidate, start, np.column_stack(columns),
                                   candidate.signed))
    return found


class Projector:
    """
    Whitened residual with the recalibration's directions projected out.

    Parameters
    ----------
    observations : Observations
    metric : Metric
    residual : numpy.ndarray, shape (n_values,)
    jacobian : numpy.ndarray, shape (n_values, n_unknowns)
        Of the recalibration.
    deviations : numpy.ndarray, shape (n_unknowns,)
        Standard deviations of the priors (infinite for none): a direction with a tight prior is
        only projected out as far as the prior allows.
    pull : numpy.ndarray, shape (n_unknowns,)
        Centre minus estimate, in deviations: what the priors still ask for.
    """

    def __init__(self, observations: Observations, metric: Metric, residual: FloatArray,
                 jacobian: FloatArray, deviations: FloatArray, pull: FloatArray) -> None:
        self.observations = observations
        self.metric = metric
        self.size = residual.size
        slope = metric.whiten(observations, jacobian)
        prior = np.diag(1.0 / deviations)
        self.basis, self.triangle = np.linalg.qr(np.vstack([slope, prior]))
        self.pull = pull
        self.residual = self._project(np.concatenate(
            [metric.whiten(observations, residual), pull]))
        # The same for columns that are filtered only: what common errors explain comes first.
        self.directions, self.target = self.basis[:self.size], self.residual[:self.size]
        if observations.common is not None:
            shared = metric.shared(observations)
            explained = shared.directions * np.sqrt(shared.taken * (2.0 - shared.taken))
            self.directions = np.hstack([explained, shared.without(self.directions)])
            self.target = shared.without(self.target)

    def _project(self, rows: FloatArray) -> FloatArray:
        projected: FloatArray = rows - self.basis @ (self.basis.T @ rows)
        return projected

    def recalibrated(self, residual: FloatArray) -> FloatArray:
        """Return how the recalibration would move for a residual, shape (n_unknowns,)."""
        rows = np.concatenate([self.metric.whiten(self.observations, residual), self.pull])
        step: FloatArray = np.linalg.lstsq(self.triangle, self.basis.T @ rows, rcond=None)[0]
        return step

    def projected(self, columns: FloatArray) -> FloatArray:
        """Return columns whitened and projected, shape (n_values + n_unknowns, k)."""
        white = self.metric.whiten(self.observations, columns)
        padding = np.zeros((self.basis.shape[0] - self.size, columns.shape[1]))
        return self._project(np.vstack([white, padding]))

    def all_sums(self, white: FloatArray, parts: Sequence[slice], groups: NDArray[np.int64],
                 count: int) -> list[Sums]:
        """
        Return what :meth:`Sums.gain` needs of many signatures, separately for groups of values.

        Parameters
        ----------
        white : numpy.ndarray, shape (n_values, n_all)
            Columns of all signatures, filtered.
        parts : sequence of slice
            Columns of each signature.
        groups : numpy.ndarray of int64, shape (n_values,)
            Number of each value's group.
        count : int
            How many groups there are.

        Returns
        -------
        list of Sums
            One for each part.
        """
        onto = np.zeros((count, self.directions.shape[1], white.shape[1]))
        along = np.zeros((count, white.shape[1]))
        own = [np.zeros((count, p.stop - p.start, p.stop - p.start)) for p in parts]
        order = np.argsort(groups, kind='stable')
        edges = np.searchsorted(groups[order], np.arange(count + 1))
        white, target, directions = white[order], self.target[order], self.directions[order]
        for g in range(count):
            rows = slice(edges[g], edges[g + 1])
            if rows.stop > rows.start:
                inside = white[rows]
                onto[g] = directions[rows].T @ inside
                along[g] = inside.T @ target[rows]
                square = inside.T @ inside
                for part, block in zip(parts, own, strict=True):
                    block[g] = square[part, part]
        return [Sums(onto[:, :, part], block, along[:, part])
                for part, block in zip(parts, own, strict=True)]


@dataclass(frozen=True, eq=False)
class Sums:
    """
    Products of whitened columns, group by group.

    Parameters
    ----------
    onto : numpy.ndarray, shape (n_groups, n_directions, k)
        With the recalibration's directions.
    own : numpy.ndarray, shape (n_groups, k, k)
        With themselves.
    along : numpy.ndarray, shape (n_groups, k)
        With the projected residual.
    """

    onto: FloatArray
    own: FloatArray
    along: FloatArray

    def gain(self, groups: NDArray[np.bool_], free_sign: bool
             ) -> tuple[float, tuple[float, ...]]:
        """
        Return what the columns explain when they are on in some groups only.

        Parameters
        ----------
        groups : numpy.ndarray of bool, shape (n_groups,)
        free_sign : bool
            Whether they may enter with a negative sign.

        Returns
        -------
        float
            Drop of the half sum of squares [nats].
        tuple of float
            Best multiples.
        """
        drops, sizes = self.gains(groups[None], free_sign)
        return float(drops[0]), tuple(sizes[0].tolist())

    def gains(self, choices: NDArray[np.bool_], free_sign: bool
              ) -> tuple[FloatArray, FloatArray]:
        """
        Return :meth:`gain` for many choices of groups at once.

        Parameters
        ----------
        choices : numpy.ndarray of bool, shape (n_choices, n_groups)
        free_sign : bool

        Returns
        -------
        numpy.ndarray, shape (n_choices,)
            Drops of the half sum of squares [nats].
        numpy.ndarray, shape (n_choices, k)
            Best multiples.
        """
        return _drops(*self._over(choices), free_sign)

    def beside(self, groups: NDArray[np.bool_], others: NDArray[np.bool_], free_sign: bool
               ) -> FloatArray:
        """
        Return what the columns explain elsewhere, once they are on in some groups.

        Parameters
        ----------
        groups : numpy.ndarray of bool, shape (n_groups,)
            Where they are on.
        others : numpy.ndarray of bool, shape (n_choices, n_groups)
            Where they are on with other sizes as well.
        free_sign : bool
            Whether they may enter with a negative sign.

        Returns
        -------
        numpy.ndarray, shape (n_choices,)
            Further drops of the half sum of squares [nats].
        """
        own, added = self._over(groups[None]), self._over(others)
        count, size = added[2].shape
        onto, along = (np.concatenate([np.broadcast_to(one, two.shape), two], axis=-1)
                       for one, two in ((own[0], added[0]), (own[2], added[2])))
        inner = np.zeros((count, 2 * size, 2 * size))
        inner[:, :size, :size], inner[:, size:, size:] = own[1], added[1]
        both = _drops(onto, inner, along, free_sign)[0]
        further: FloatArray = np.maximum(both - _drops(*own, free_sign)[0], 0.0)
        return further

    def _over(self, choices: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray, FloatArray]:
        # The sums over each choice's groups.
        weights = choices.astype(np.float64)
        onto, own, along = (np.tensordot(weights, one, axes=1)
                            for one in (self.onto, self.own, self.along))
        return onto, own, along


def _drops(onto: FloatArray, own: FloatArray, along: FloatArray, free_sign: bool
           ) -> tuple[FloatArray, FloatArray]:
    # A stack of small least squares, each scaled to columns of length one.
    matrix = own - np.swapaxes(onto, 1, 2) @ onto
    norms = np.sqrt(np.maximum(np.diagonal(matrix, axis1=1, axis2=2), 0.0))
    there = norms > 1e-6
    safe = np.where(there, norms, 1.0)
    scaled = matrix / (safe[:, :, None] * safe[:, None, :]) + 1e-6 * np.eye(norms.shape[1])
    target = np.where(there, along / safe, 0.0)
    best = np.linalg.solve(scaled, target[:, :, None])[:, :, 0]
    if not free_sign:
        best = np.maximum(best, 0.0)
    bent = (scaled @ best[:, :, None])[:, :, 0]
    drops: FloatArray = np.sum(best * (target - 0.5 * bent), axis=1)
    return drops, best / safe


def scan(projector: Projector, signatures: Sequence[Signature],
         onsets: Sequence[Onsets] = ()) -> list[Score]:
    """
    Score signatures, without and with onsets.

    Parameters
    ----------
    projector : Projector
    signatures : sequence of Signature
    onsets : sequence of Onsets
        Empty to try none.

    Returns
    -------
    list of Score
        The best of each candidate without, with a given onset and with another; highest gain
        first.
    """
    best: dict[tuple[str, str], Score] = {}

    def offer(score: Score, kind: str) -> None:
        key = (score.signature.candidate.label, kind)
        if key not in best or score.gain > best[key].gain:
            best[key] = score

    if not signatures:
        return []
    white = projector.metric.filtered(projector.observations, np.hstack(
        [s.columns for s in signatures]))
    ends = np.cumsum([s.columns.shape[1] for s in signatures])
    parts = [slice(int(end) - s.columns.shape[1], int(end)) for s, end in zip(
        signatures, ends, strict=True)]
    whole = np.zeros(projector.size, dtype=np.int64)
    for signature, sums in zip(signatures, projector.all_sums(white, parts, whole, 1),
                               strict=True):
        if not signature.candidate.effect.kind.needs_onset:
            gain, size = sums.gain(np.array([True]), signature.free_sign)
            offer(Score(signature, gain, size), 'always')
    summed: dict[int, list[Sums]] = {}
    for family in onsets:
        if not family.onsets:
            continue
        if id(family.groups) not in summed:
            summed[id(family.groups)] = projector.all_sums(white, parts, family.groups,
                                                           family.count)
        choices = np.array([groups for _, groups in family.onsets])
        placebos = np.array(family.placebos)
        for signature, sums in zip(signatures, summed[id(family.groups)], strict=True):
            gains, sizes = sums.gains(choices, signature.free_sign)
            # The first of those that only rounding tells apart: nothing lies between them.
            best_of = int(np.argmax(gains >= np.max(gains) - 1e-9))
            onset, groups = family.onsets[best_of]
            placebo = float(np.max(sums.beside(groups, placebos, signature.free_sign))) if (
                len(placebos)) else 0.0
            offer(Score(signature, float(gains[best_of]), tuple(sizes[best_of].tolist()), onset,
                        placebo), 'given' if family.given else 'late')
    return sorted(best.values(), key=lambda s: -s.gain)
