# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Step a robot live, or roll out a recording's commands, over one kernel."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import BodyTwist, FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation.arrays import workspace
from lg_husky_sim.simulation.event_kernel import COLUMNS, follow
from lg_husky_sim.simulation.events import Events, Propagator
from lg_husky_sim.simulation.initial_state import InitialStates
from lg_husky_sim.simulation.runaway import refuse_runaway
import numpy as np


@dataclass(frozen=True, eq=False)
class SimulatorState:
    """
    Everything that a simulation carries from one step to the next.

    Parameters
    ----------
    flat : numpy.ndarray, shape (n + tail,)
        Laid out as :mod:`lg_husky_sim.simulation.event_kernel` says; read-only.
    row : numpy.ndarray, shape (15,)
        The kernel's output columns at this moment; read-only.
    states : tuple of str
        Names of the states of graph and controllers.
    waiting : numpy.ndarray, shape (n_waiting, 3)
        Commands that a dead time holds back: when each was given, before now [s], its forward
        speed [m/s] and yaw rate [rad/s]; read-only.

    """

    flat: FloatArray
    row: FloatArray
    states: tuple[str, ...]
    waiting: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def n(self) -> int:
        """Return the number of states of graph and controllers."""
        return len(self.states)

    @property
    def time(self) -> float:
        """Return the simulated time [s]."""
        return float(self.flat[self.n + 6])

    @property
    def pose(self) -> Pose:
        """Return the true pose."""
        flat = self.flat
        return Pose(float(flat[self.n + 4]), float(flat[self.n + 5]), float(flat[self.n + 3]))

    @property
    def twist(self) -> BodyTwist:
        """Return the true velocity of the base."""
        return BodyTwist(float(self.row[2]), float(self.row[3]))

    @property
    def wheel_rates(self) -> tuple[float, float]:
        """Left and right wheel rates [rad/s]."""
        return float(self.row[0]), float(self.row[1])

    @property
    def wheel_angles(self) -> tuple[float, float]:
        """Integrals of the wheel rates, left and right [rad]."""
        return float(self.flat[self.n]), float(self.flat[self.n + 1])

    @property
    def currents(self) -> tuple[float, float]:
        """Motor currents, left and right [A]."""
        return float(self.row[4]), float(self.row[5])

    @property
    def voltages(self) -> tuple[float, float]:
        """Motor voltages, left and right [V]."""
        return float(self.row[13]), float(self.row[14])

    @property
    def acceleration(self) -> float:
        """Forward acceleration dv/dt at this moment [m/s²]."""
        return float(self.row[6])

    @property
    def distance(self) -> float:
        """Signed way along the path [m]."""
        return float(self.flat[self.n + 2])


class Simulator:
    """
    A plant that is stepped at one period.

    Parameters
    ----------
    plant : Plant
    period : float
        Step [s].
    fine_pose : bool
        Whether x and y are wanted to better than 1e-7 m; else they are arcs of the steps, which
        is a little faster.

    Raises
    ------
    ParameterError
        If the period is not a positive number.

    """

    def __init__(self, plant: Plant, period: float, *, fine_pose: bool = True) -> None:
        if not (math.isfinite(period) and period > 0.0):
            raise ParameterError(f'period = {period} s is not a positive number')
        self.plant = plant
        self.period = period
        self.fine_pose = fine_pose
        self.propagator = Propagator(plant)
        self._starts = InitialStates(plant)
        self._latency = max(one.command.latency for one in plant.sets)

    def initial(self, pose: Pose | None = None, twist: BodyTwist | None = None,
                time: float = 0.0, wheel_rates: tuple[float, float] | None = None,
                wheel_angles: tuple[float, float] = (0.0, 0.0),
                command: BodyTwist | None = None) -> SimulatorState:
        """
        Return a state to start from.

        Parameters
        ----------
        pose : Pose, optional
            Place [m] and heading [rad] of the base; the origin if not given.
        twist : BodyTwist, optional
            Velocity of the base; at rest if not given.
        time : float
            Simulated time [s].
        wheel_rates : tuple of float, optional
            Left and right [rad/s]; those that roll without slip at ``twist`` if not given.
        wheel_angles : tuple of float
            Left and right [rad].
        command : BodyTwist, optional
            What has been commanded until then, which a base with dead time or limits still
            follows, as if it had been for long: a ramp up to it is over. Nothing if not given.

        Returns
        -------
        SimulatorState
            Other states (currents, controllers) are those of the nearest steady drive.

        """
        pose, twist = pose or Pose(), twist or BodyTwist()
        if wheel_rates is None and (twist.forward or twist.yaw):
            wheel_rates = self._starts.rates_without_slip(twist)
        flat = self._starts.flat(pose, twist, time, wheel_rates, wheel_angles, command)
        row = np.zeros(len(COLUMNS))
        row[:4] = *(wheel_rates or (0.0, 0.0)), twist.forward, twist.yaw
        row[7:13] = *wheel_angles, 0.0, pose.heading, pose.x, pose.y
        return _state(flat, row, self.plant.states, np.zeros((0, 3)))

    def rolling(self, left: float, right: float) -> BodyTwist:
        """Return the velocity at which wheels of these rates [rad/s] do not slip."""
        ahead = sum(self.initial(twist=BodyTwist(1.0, 0.0)).wheel_rates) / 2.0
        turning = self.initial(twist=BodyTwist(0.0, 1.0)).wheel_rates
        return BodyTwist(0.5 * (left + right) / ahead, (right - left) / (turning[1] - turning[0]))

    def step(self, state: SimulatorState, command: BodyTwist) -> SimulatorState:
        """
        Return the state one period later.

        Parameters
        ----------
        state : SimulatorState
            At the start of the step.
        command : BodyTwist
            Given now, and held over the step.

        Returns
        -------
        SimulatorState

        """
        start = state.time
        return self._follow(state, np.array((start, start + self.period)),
                            np.array(((command.forward, command.yaw),)))[0]

    def run(self, state: SimulatorState, commands: FloatArray
            ) -> tuple[SimulatorState, FloatArray]:
        """
        Advance by one period for each row of ``commands``.

        Parameters
        ----------
        state : SimulatorState
            To start from.
        commands : numpy.ndarray, shape (n_steps, 2)
            Forward speed [m/s] and yaw rate [rad/s].

        Returns
        -------
        SimulatorState
            At the end.
        numpy.ndarray, shape (n_steps, 15)
            The kernel's columns after each step.

        """
        # One after the other, as steps by themselves would add them.
        clock = np.full(1 + len(commands), self.period)
        clock[0] = state.time
        return self._follow(state, np.add.accumulate(clock), commands)

    def _follow(self, state: SimulatorState, clock: FloatArray, commands: FloatArray
                ) -> tuple[SimulatorState, FloatArray]:
        # A command from each time of the clock to the next. The node comes here for every single
        # step, where each array costs as much as a tenth of what the kernel takes.
        before, steps = len(state.waiting), len(commands)
        stamps, values = np.empty(before + steps), np.empty((before + steps, 2))
        np.add(state.waiting[:, 0], clock[0], out=stamps[:before])
        stamps[before:] = clock[:-1]
        values[:before] = state.waiting[:, 1:]
        values[before:] = commands
        flat, out = np.array(state.flat), np.empty((steps, len(COLUMNS)))
        refuse_runaway(follow(
            flat, stamps, values, clock[1:], np.arange(steps), out, clock[1:], self.fine_pose,
            self.propagator.packed, workspace(self.propagator.packed)))
        waiting = np.empty((before + steps, 3))
        np.subtract(stamps, clock[-1], out=waiting[:, 0])
        waiting[:, 1:] = values
        # The last ones, as they stand in order of their times.
        held = int(np.count_nonzero(waiting[:, 0] + self._latency >= -self.period))
        row = np.array(out[-1] if steps else state.row)
        return _state(flat, row, state.states, waiting[len(waiting) - held:]), out

    def adopt(self, state: SimulatorState) -> SimulatorState:
        """
        Return another simulator's state for this one, without a jump in motion or pose.

        Parameters
        ----------
        state : SimulatorState
            Of a simulator of any drivetrain and effects.

        Returns
        -------
        SimulatorState
            Where the states are others, wheel rates, velocity, currents, angles and pose
            are kept, and the others (front axles, a controller's states) are those of the steady
            drive that comes nearest.

        """
        n = len(self.plant.states)
        if state.states == self.plant.states:
            return state
        one = self.plant.sets[0]
        steady = self._starts.steady
        drive = np.linalg.lstsq(one.rows[:4] @ steady, state.row[:4], rcond=None)[0]
        nearest = steady @ drive
        flat = np.concatenate([nearest, state.flat[state.n:]])
        flat[:n] += np.linalg.lstsq(one.rows[:6], state.row[:6] - one.rows[:6] @ nearest,
                                    rcond=None)[0]
        return _state(flat, np.array(state.row), self.plant.states, np.array(state.waiting))


def _state(flat: FloatArray, row: FloatArray, states: tuple[str, ...], waiting: FloatArray
           ) -> SimulatorState:
    for array in (flat, row, waiting):
        array.setflags(write=False)
    return SimulatorState(flat, row, states, waiting)


def hold(commands: TimeSeries, start: float, period: float, count: int) -> FloatArray:
    """
    Average zero-order-held commands over the steps of a grid.

    Parameters
    ----------
    commands : TimeSeries
        Names forward, yaw; each value holds until the next stamp, nothing is commanded before
        the first.
    start, period : float
        Grid [s].
    count : int
        Number of steps.

    Returns
    -------
    numpy.ndarray, shape (count, 2)

    """
    edges = start + period * np.arange(count + 1)
    values = np.column_stack([commands.column('forward'), commands.column('yaw')])
    if len(commands) == 0:
        return np.zeros((count, 2))
    spans = np.diff(commands.times)
    area = np.vstack([np.zeros(2), np.cumsum(values[:-1] * spans[:, None], axis=0)])
    last = np.searchsorted(commands.times, edges, side='right') - 1
    known = last >= 0
    safe = np.maximum(last, 0)
    reached = area[safe] + values[safe] * (edges - commands.times[safe])[:, None]
    reached[~known] = 0.0
    averaged: FloatArray = np.diff(reached, axis=0) / period
    return averaged


def rollout(plant: Plant, commands: TimeSeries, end: float, period: float = 0.02,
            start: float | None = None, pose: Pose | None = None,
            twist: BodyTwist | None = None, wheel_rates: tuple[float, float] | None = None,
            wheel_angles: tuple[float, float] = (0.0, 0.0),
            command: BodyTwist | None = None) -> TimeSeries:
    """
    Drive a plant with recorded commands.

    Parameters
    ----------
    plant : Plant
        Robot to drive, as it is in one recording.
    commands : TimeSeries
        Names forward [m/s], yaw [rad/s]; each holds from its own stamp on. One from before the
        start counts as given there.
    end : float
        Last time [s].
    period : float
        Step [s].
    start : float, optional
        First time [s]; the first command's stamp if not given.
    pose, twist, wheel_rates, wheel_angles, command
        Where to start, as in :meth:`Simulator.initial`.

    Returns
    -------
    TimeSeries
        Columns of the kernel at start, start + period, ...: the truth, before the sensors.

    Raises
    ------
    ParameterError
        If the period is not positive.

    """
    simulator = Simulator(plant, period)
    first = float(commands.times[0]) if start is None else start
    count = max(0, math.floor((end - first) / period + 1e-9))
    times: FloatArray = first + period * np.arange(count + 1, dtype=np.float64)
    state = simulator.initial(pose, twist, first, wheel_rates, wheel_angles, command)
    events = Events(commands, times[1:], start=first, fresh=True)
    out = simulator.propagator.run(events, state.flat)
    return TimeSeries(times, np.vstack([state.row, out]), COLUMNS)
