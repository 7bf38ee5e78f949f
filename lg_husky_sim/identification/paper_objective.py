# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's objective, eq. (23): the sum of absolute x and y errors along a drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from lg_husky_sim.errors import FitError, LgHuskyError
from lg_husky_sim.husky.model import HuskyModel
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.fit_segments import segment_for_fit
from lg_husky_sim.identification.modal_decoupling import can_decouple, ModalDecoupling
from lg_husky_sim.identification.simd_batch import batch_cost, operators
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import BodyTwist, FloatArray, Pose
from lg_husky_sim.simulation.event_kernel import COLUMNS
from lg_husky_sim.simulation.simulator import hold, Simulator
from lg_husky_sim.simulation.starting import at_rest, commanded_until
import numpy as np

#: Step of the simulation [s], as in the paper's 50 Hz data.
PERIOD = 0.02
#: Positions averaged for the start of a drive that begins at rest [s].
REST = 0.5
_X, _Y = COLUMNS.index('x'), COLUMNS.index('y')


@dataclass(frozen=True, eq=False)
class Track:
    """
    The measured positions of one drive, and what is needed to simulate it.

    Parameters
    ----------
    name : str
        Recording and segment.
    start : float
        Time of the first measured position [s].
    commands : numpy.ndarray, shape (n_steps, 2)
        Forward speed [m/s] and yaw rate [rad/s] over each step of :data:`PERIOD`.
    pose : Pose
        At the start.
    twist : BodyTwist
        At the start.
    wheel_rates : tuple of float or None
        Left and right at the start [rad/s]; None where none were recorded: the wheels roll.
    steps : numpy.ndarray of int64, shape (n_samples,)
        Step in which each measured position lies.
    shares : numpy.ndarray, shape (n_samples,)
        Where within the step.
    targets : numpy.ndarray, shape (n_samples, 2)
        Measured x and y [m].
    recording : str
    recordings : tuple of str
        All that are fitted, in their order: some effects begin between them.
    before : BodyTwist
        What had been commanded until the start.

    """

    name: str
    start: float
    commands: FloatArray
    pose: Pose
    twist: BodyTwist
    wheel_rates: tuple[float, float] | None
    steps: np.typing.NDArray[np.int64]
    shares: FloatArray
    targets: FloatArray
    recording: str = ''
    recordings: tuple[str, ...] = ()
    before: BodyTwist = field(default_factory=BodyTwist)

    @property
    def times(self) -> FloatArray:
        """Return the times of the measured positions [s]."""
        at: FloatArray = self.start + (self.steps + self.shares) * PERIOD
        return at

    def simulate(self, plant: Plant) -> FloatArray:
        """
        Return the plant's x and y at the measured times, shape (n_samples, 2) [m].

        Parameters
        ----------
        plant : Plant
            Robot to drive, taken as it is in the track's recording.

        """
        if plant.onset is not None:
            plant = plant.in_recording(self.recording, plant.onset.before(self.recordings))
        simulator = Simulator(plant, PERIOD, fine_pose=False)
        state = simulator.initial(self.pose, self.twist, self.start, self.wheel_rates,
                                  command=self.before)
        _, out = simulator.run(state, self.commands)
        grid = np.vstack([state.row, out])[:, [_X, _Y]]
        before, after = grid[self.steps], grid[self.steps + 1]
        there: FloatArray = before + self.shares[:, None] * (after - before)
        return there


def track_of(segment: Segment, recordings: Sequence[str] = ()) -> Track | None:
    """
    Prepare a segment.

    Parameters
    ----------
    segment : Segment
        With commands and a pose.
    recordings : sequence of str
        Names of all that are fitted, in their order.

    Returns
    -------
    Track or None
        None where there is no pose or no command.

    """
    pose, commands = segment.streams.get('pose'), segment.streams.get('command')
    if pose is None or commands is None or len(pose) < 3 or len(commands) == 0:
        return None
    start = float(pose.times[0])
    wheels = segment.streams.get('wheels')
    early = pose.slice(start, start + REST)
    moved = np.hypot(np.ptp(early.column('x')), np.ptp(early.column('y')))
    active = commands.slice(-np.inf, start + REST).values
    first, fitted = Pose(*map(float, pose.values[0])), segment_for_fit(segment)
    twist = BodyTwist()
    rates: tuple[float, float] | None = (0.0, 0.0)
    if not np.any(active) and moved < 0.1:
        # At rest the mean of the first positions, of which each is noisy.
        first = Pose(*(float(np.mean(early.column(n))) for n in ('x', 'y', 'heading')))
    elif fitted is None or not at_rest(fitted.twist, fitted.initial_wheel_rates):
        span = max(float(early.times[-1] - start), 1e-3)
        way = early.values[-1] - early.values[0]
        along = way[0] * np.cos(first.heading) + way[1] * np.sin(first.heading)
        twist = BodyTwist(float(along) / span, float(way[2]) / span)
        near = None if wheels is None else wheels.slice(start, start + REST)
        rates = None if near is None or not len(near) else (
            float(np.median(near.column('left'))), float(np.median(near.column('right'))))
    place = (pose.times - start) / PERIOD
    count = max(1, int(np.ceil(place[-1] - 1e-9)))
    steps = np.clip(np.ceil(place - 1e-9).astype(np.int64) - 1, 0, count - 1)
    return Track(f'{segment.recording}[{segment.index}]', start,
                 hold(commands, start, PERIOD, count), first, twist, rates, steps,
                 place - steps, np.ascontiguousarray(pose.values[:, :2]), segment.recording,
                 tuple(recordings), commanded_until(start, commands, twist, rates))


class PaperObjective:
    """
    Eq. (23) as a function of many candidates.

    Parameters
    ----------
    model : HuskyModel
    parameters : Parameters
        Values of those that are not free.
    free : tuple of str
    segments : sequence of Segment
        Those without pose are left out.

    Raises
    ------
    FitError
        If no segment has a pose.

    """

    def __init__(self, model: HuskyModel, parameters: Parameters, free: tuple[str, ...],
                 segments: Sequence[Segment]) -> None:
        names = tuple(dict.fromkeys(segment.recording for segment in segments))
        tracks = (track_of(segment, names) for segment in segments)
        self.tracks = tuple(track for track in tracks if track is not None)
        if not self.tracks:
            raise FitError('the objective of eq. (23) needs a pose and a command; no segment '
                           'has both')
        self.model, self.parameters, self.free = model, parameters, free
        self._decoupling = (ModalDecoupling(model, parameters, free)
                            if can_decouple(model, parameters, free) else None)
        self._begins = [self._begin(track) for track in self.tracks if self.batched]

    def _begin(self, track: Track) -> FloatArray:
        # States of both modes at the start: (wheels, body, current) of mean and difference.
        # What was not measured is that of the given parameters for all candidates: currents,
        # and wheels that follow their motors, are forgotten within milliseconds.
        plant = self.model.at(self.parameters)
        state = Simulator(plant, PERIOD, fine_pose=False).initial(
            track.pose, track.twist, track.start, track.wheel_rates)
        left, right, forward, yaw, *currents = plant.sets[0].rows[:6] @ state.flat[:state.n]
        return np.array([0.5 * (left + right), forward, 0.5 * (currents[0] + currents[1]),
                         0.5 * (right - left), yaw, 0.5 * (currents[1] - currents[0]),
                         track.pose.x, track.pose.y, track.pose.heading])

    @property
    def batched(self) -> bool:
        """Whether candidates run through the batch kernel."""
        return self._decoupling is not None

    @property
    def steps(self) -> int:
        """Return the number of simulation steps of one candidate."""
        return sum(len(track.commands) for track in self.tracks)

    def __call__(self, candidates: FloatArray) -> FloatArray:
        """
        Return the cost of each candidate.

        Parameters
        ----------
        candidates : numpy.ndarray, shape (n_candidates, n_free)
            Values of the free parameters, a row each.

        Returns
        -------
        numpy.ndarray, shape (n_candidates,)
            [m]; infinite where a candidate cannot be simulated.

        """
        rows = np.atleast_2d(np.asarray(candidates, dtype=np.float64))
        if self._decoupling is None:
            return np.array([self._single(row) for row in rows])
        modes = self._decoupling(rows)
        op = operators(modes, PERIOD)
        cost = np.zeros(len(rows))
        for track, begin in zip(self.tracks, self._begins, strict=True):
            cost += batch_cost(op, modes.stage, begin, track.commands, track.steps,
                               track.shares, track.targets)
        return np.where(np.isfinite(cost), cost, np.inf)

    def _single(self, row: FloatArray) -> float:
        values = dict(zip(self.free, map(float, row), strict=True))
        try:
            plant = self.model.at(self.parameters.replacing(values))
            errors = [np.abs(track.simulate(plant) - track.targets).sum()
                      for track in self.tracks]
        except LgHuskyError:
            return float('inf')  # outside the bounds: the worst candidate there is
        total = float(np.sum(errors))
        return total if np.isfinite(total) else float('inf')
