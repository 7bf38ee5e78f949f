# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Modal decoupling of a linear plant with equal sides, for many candidates at once.

With equal sides the graph's 6 states decouple exactly: the mean of both sides drives the forward
speed, half their difference drives the yaw rate. Each mode has three states (wheels, body,
current), which is what makes a batch cheap: two 3-state holds in place of one of 6 states.
"""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.errors import FitError
from lg_husky_sim.husky.model import HuskyModel
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import PlantSet
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Largest coupling between the modes, and largest departure from an affine dependence on the
#: parameters, relative to the largest entry.
EXACT = 1e-9
#: Mean and half difference of the two sides, in the order (wheels, body, current) a mode.
_MIX = np.array([[0.5, 0.5, 0.0, 0.0, 0.0, 0.0],
                 [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
                 [0.0, 0.0, 0.0, 0.0, 0.5, 0.5],
                 [-0.5, 0.5, 0.0, 0.0, 0.0, 0.0],
                 [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
                 [0.0, 0.0, 0.0, 0.0, -0.5, 0.5]])
_SIDES = np.array([[1.0, -1.0], [1.0, 1.0]])


@dataclass(frozen=True, eq=False)
class DecoupledModes:
    """
    Continuous matrices of the two modes of several candidates.

    Parameters
    ----------
    a : numpy.ndarray, shape (n_candidates, 2, 3, 3)
        States (wheel rate, body rate, current) of the mean and of half the difference.
    b : numpy.ndarray, shape (n_candidates, 2, 3)
        Input: the mean voltage, and half the difference right − left [V].
    stage : numpy.ndarray, shape (n_candidates, 3)
        Volts per forward speed [V·s/m], volts per yaw rate [V·s/rad] and the clamp [V].

    """

    a: FloatArray
    b: FloatArray
    stage: FloatArray


def _decoupled(plant: PlantSet) -> FloatArray | None:
    # The numbers of one candidate as a flat vector, or None if it does not decouple.
    command = plant.command
    limits = (command.slew_forward, command.slew_yaw, command.limit_forward, command.limit_yaw)
    if (plant.a.shape[0] != 6 or plant.laws.size or command.latency
            or not np.all(np.isinf(limits))):
        return None
    seen = _MIX @ plant.rows[:6]
    back = np.linalg.inv(seen)
    a, b = seen @ plant.a @ back, seen @ plant.b @ _SIDES
    coupling = max(np.abs(a[:3, 3:]).max(), np.abs(a[3:, :3]).max(),
                   np.abs(b[:3, 1]).max(), np.abs(b[3:, 0]).max())
    if coupling > EXACT * max(np.abs(a).max(), np.abs(b).max()):
        return None
    return np.concatenate([
        a[:3, :3].ravel(), a[3:, 3:].ravel(), b[:3, 0], b[3:, 1],
        [command.volts_per_speed, command.volts_per_rate, command.clamp]])


class ModalDecoupling:
    """
    Gives the modes of many candidates.

    Where the matrices depend on the free parameters as an affine function (the dampings and the
    command gain do), that function is learnt from the derived graph and evaluated for all
    candidates at once; otherwise each candidate asks the derived graph.

    Parameters
    ----------
    model : HuskyModel
    parameters : Parameters
        Values of those that are not free.
    free : sequence of str

    Raises
    ------
    FitError
        If the model does not decouple.

    """

    def __init__(self, model: HuskyModel, parameters: Parameters, free: tuple[str, ...]) -> None:
        self.model, self.parameters, self.free = model, parameters, free
        self._values = dict(parameters)
        centre = np.array([parameters[name] for name in free])
        base = self._one(centre)
        if base is None:
            raise FitError('the model does not decouple into two modes: it has unequal sides, '
                           'efforts or a shaped command')
        columns = []
        for i, step in enumerate(map(_step, centre.tolist())):
            shifted = centre.copy()
            shifted[i] += step
            moved = self._one(shifted)
            columns.append(None if moved is None else (moved - base) / step)
        self._slopes: FloatArray | None = None
        if all(column is not None for column in columns):
            slopes = np.array(columns).reshape(len(free), base.size)
            self._offset = base - centre @ slopes
            self._slopes = slopes if self._affine(centre, slopes) else None

    def _affine(self, centre: FloatArray, slopes: FloatArray) -> bool:
        for factor in (0.5, 1.7):
            trial = centre * factor + 1e-3
            exact = self._one(trial)
            if exact is None:
                return False
            error = np.abs(self._offset + trial @ slopes - exact)
            if np.any(error > EXACT * np.maximum(np.abs(exact), 1.0)):
                return False
        return True

    def _one(self, values: FloatArray) -> FloatArray | None:
        given = {**self._values, **dict(zip(self.free, map(float, values), strict=True))}
        return _decoupled(self.model.regimes[0].at(given))

    @property
    def affine(self) -> bool:
        """Whether all candidates are made at once."""
        return self._slopes is not None

    def __call__(self, candidates: FloatArray) -> DecoupledModes:
        """
        Return the modes of candidates.

        Parameters
        ----------
        candidates : numpy.ndarray, shape (n_candidates, n_free)
            Values of the free parameters, a row each.

        Returns
        -------
        DecoupledModes

        Raises
        ------
        FitError
            If a candidate does not decouple.

        """
        if self._slopes is not None:
            # One product and one sum an entry, in a fixed order: the same numbers whatever the
            # number of candidates.
            flat = np.repeat(self._offset[None], len(candidates), axis=0)
            for i in range(len(self.free)):
                flat += candidates[:, i:i + 1] * self._slopes[i]
        else:
            rows = [self._one(row) for row in candidates]
            if any(row is None for row in rows):
                raise FitError('a candidate does not decouple into two modes')
            flat = np.array(rows, dtype=np.float64)
        count = len(candidates)
        return DecoupledModes(
            flat[:, :18].reshape(count, 2, 3, 3), flat[:, 18:24].reshape(count, 2, 3),
            np.ascontiguousarray(flat[:, 24:27]))


def can_decouple(model: HuskyModel, parameters: Parameters, free: tuple[str, ...] = ()) -> bool:
    """Return whether a model decouples into two modes at these parameters, and as some move."""
    if len(model.regimes) != 1:
        return False
    values = dict(parameters)
    moved = [values, *({**values, name: values[name] + _step(values[name])} for name in free)]
    return all(_decoupled(model.regimes[0].at(one)) is not None for one in moved)


def _step(value: float) -> float:
    return max(0.25 * abs(value), 1e-3)
