# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Drive a plant with commands at any stamps and read it off at any times, without a grid.

``trajectory`` is the whole in one call. Where many parameter values meet the same commands and
times, prepare those once::

    events = Events(commands, times, start=0.0)
    for plant in plants:
        drive = Propagator(plant)
        columns = drive.run(events, drive.initial())
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
import math

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import BodyTwist, FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation.arrays import FROM_TIME, KIND, ONSET, Packed
from lg_husky_sim.simulation.event_kernel import COLUMNS
from lg_husky_sim.simulation.event_kernel import run as run_kernel
from lg_husky_sim.simulation.initial_state import InitialStates
from lg_husky_sim.simulation.modes import packed
import numpy as np
from numpy.typing import ArrayLike

__all__ = ['COLUMNS', 'Events', 'Propagator', 'run', 'trajectory']


class Events:
    """
    Commands and the times at which a drive is wanted, checked and sorted once.

    Parameters
    ----------
    commands : TimeSeries
        Names forward [m/s], yaw [rad/s]; each holds from its own stamp until the next. Those
        before ``start`` count with their own stamps: a dead time may still hold them back.
    times : array_like, shape (n_times,)
        Where output is wanted [s], in any order, not before ``start``.
    start : float, optional
        Where the simulation begins [s]; the first command's stamp if not given.
    fresh : bool
        Whether a command from before ``start`` counts as given at the start.

    Raises
    ------
    ParameterError
        If a time is not finite or lies before the start, or nothing says where to start.

    """

    def __init__(self, commands: TimeSeries, times: ArrayLike, *, start: float | None = None,
                 fresh: bool = False) -> None:
        if start is None:
            if len(commands) == 0:
                raise ParameterError('start is not given, and there is no command to start at')
            start = float(commands.times[0])
        wanted = np.array(times, dtype=np.float64).ravel()  # a copy: its type is one, writable
        if not math.isfinite(start) or not np.all(np.isfinite(wanted)):
            raise ParameterError(f'start = {start} s and the {wanted.size} times must be finite')
        if wanted.size and wanted.min() < start:
            raise ParameterError(f'time = {wanted.min():g} s lies before start = {start:g} s')
        self.start = start
        ordered = bool(np.all(wanted[1:] >= wanted[:-1]))
        self.order = None if ordered else np.argsort(wanted, kind='stable')
        #: Sorted times [s], and where each stood.
        self.times = wanted if self.order is None else wanted[self.order]
        self.places = np.arange(wanted.size) if self.order is None else self.order
        self.end = float(self.times[-1]) if wanted.size else start
        stamps = np.array(commands.times)
        values = np.column_stack([commands.column('forward'), commands.column('yaw')])
        if fresh:
            first = max(int(np.searchsorted(stamps, start, side='right')) - 1, 0)
            stamps, values = np.maximum(stamps[first:], start), values[first:]
        self.stamps = stamps
        self.values = np.ascontiguousarray(values)


class Propagator:
    """
    A plant in the coordinates of its modes, ready to be driven.

    Parameters
    ----------
    plant : Plant

    """

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        #: What the kernel needs.
        self.packed = packed(plant)
        self._starts = InitialStates(plant)

    def initial(self, pose: Pose | None = None, twist: BodyTwist | None = None,
                time: float = 0.0, wheel_rates: tuple[float, float] | None = None,
                wheel_angles: tuple[float, float] = (0.0, 0.0),
                command: BodyTwist | None = None) -> FloatArray:
        """Return a flat state to start from, as :meth:`InitialStates.flat` says."""
        return self._starts.flat(pose, twist, time, wheel_rates, wheel_angles, command)

    def twist_without_slip(self, left: float, right: float) -> BodyTwist:
        """Return the velocity of the base whose wheels turn at such rates [rad/s]."""
        return self._starts.twist_without_slip(left, right)

    def run_in(self, events: Events, begin: FloatArray, start: FloatArray) -> FloatArray:
        """
        Return a flat state to start from after some commands.

        Parameters
        ----------
        events : Events
            Of commands before the start; their only time is that of the start.
        begin : numpy.ndarray, shape (n + TAIL,)
            Flat state where they start.
        start : numpy.ndarray, shape (n + TAIL,)
            What is known of the start, with its time.

        Returns
        -------
        numpy.ndarray, shape (n + TAIL,)
            As of :meth:`InitialStates.run_in`.

        """
        flat = np.array(begin)
        run_kernel(flat, events.stamps, events.values, events.times, events.places,
                   np.empty((1, len(COLUMNS))), events.end, False, self.packed)
        return self._starts.run_in(flat, start)

    @cached_property
    def _never_and_always(self) -> tuple[Packed, Packed]:
        return _switched(self.packed, math.inf), _switched(self.packed, -math.inf)

    def run(self, events: Events, initial: FloatArray, *, fine_pose: bool = True,
            legs: Sequence[tuple[float, bool]] = ()) -> FloatArray:
        """
        Drive the plant from a state through all events.

        Parameters
        ----------
        events : Events
            Commands with their stamps, and the times that are wanted.
        initial : numpy.ndarray, shape (n + TAIL,)
            Flat state, of :meth:`initial`; its time is replaced by the events' start.
        fine_pose : bool
            Whether x and y are wanted to better than 1e-7 m; else they are arcs between the
            times, which is a little faster.
        legs : sequence of (float, bool)
            Until when [s] a plant's second set acts or does not, by turns, the last one without
            end; where its own onset says if none are given.

        Returns
        -------
        numpy.ndarray, shape (n_times, 15)
            :data:`COLUMNS` at the events' times, in the order in which they were given.

        """
        flat = np.array(initial)
        flat[len(self.plant.states) + 6] = events.start
        out, first = np.empty((events.times.size, len(COLUMNS))), 0
        for until, second in legs or ((math.inf, None),):
            packed = self.packed if second is None else self._never_and_always[second]
            last = int(np.searchsorted(events.times, until, side='right'))
            run_kernel(flat, events.stamps, events.values, events.times[first:last],
                       events.places[first:last], out, min(until, events.end), fine_pose, packed)
            if until >= events.end:
                break
            first = last
        return out


def _switched(packed: Packed, since: float) -> Packed:
    # With a second set that acts from a time on, in place of its own onset.
    stages = np.array(packed.stages)
    stages[:, KIND], stages[:, ONSET] = FROM_TIME, since
    return packed._replace(stages=stages)


def run(plant: Plant, events: Events, initial: FloatArray) -> FloatArray:
    """Drive a plant through events from a flat state, as :meth:`Propagator.run`."""
    return Propagator(plant).run(events, initial)


def trajectory(plant: Plant, commands: TimeSeries, times: ArrayLike, *,
               start: float | None = None, pose: Pose | None = None,
               twist: BodyTwist | None = None, wheel_rates: tuple[float, float] | None = None,
               wheel_angles: tuple[float, float] = (0.0, 0.0),
               command: BodyTwist | None = None) -> TimeSeries:
    """
    Drive a plant with commands and return where it is at the given times.

    Parameters
    ----------
    plant : Plant
        Robot to drive, as it is in one recording.
    commands : TimeSeries
        Names forward [m/s], yaw [rad/s]; each holds from its own stamp until the next.
    times : array_like, shape (n_times,)
        Sorted, not before ``start`` [s].
    start : float, optional
        Where the simulation begins [s]; the first command's stamp if not given.
    pose, twist, wheel_rates, wheel_angles
        Where it starts, as in :meth:`InitialStates.flat`.
    command : BodyTwist, optional
        What was in force before the first command; nothing if not given.

    Returns
    -------
    TimeSeries
        :data:`COLUMNS` at ``times``: the truth, before the sensors. Where something jumps, what
        was before the jump.

    Raises
    ------
    ParameterError
        If a time is not finite or lies before the start.

    """
    events = Events(commands, times, start=start)
    drive = Propagator(plant)
    state = drive.initial(pose, twist, events.start, wheel_rates, wheel_angles, command)
    return TimeSeries(np.asarray(times, dtype=np.float64), drive.run(events, state), COLUMNS)
