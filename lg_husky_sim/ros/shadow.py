# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A model that gets a robot's commands, and how far it is off."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
import math

from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.ros.engine import limited
from lg_husky_sim.ros.sensors import sensor_model
from lg_husky_sim.ros.settings import make_settings, Settings
from lg_husky_sim.signals import BodyTwist, Pose, TimeSeries
from lg_husky_sim.simulation import Simulator, SimulatorState
from lg_husky_sim.simulation.starting import commanded_until
import numpy as np

#: Step of the models, and age from which a running error forgets [s].
PERIOD = 0.01
MEMORY = 10.0
#: Silence after which the models begin anew, from what is measured [s].
SILENCE = 1.0
#: Past states that are kept [s]: more than any stamp is late or any message on its way.
_PAST = 2.0
#: Quantities that are compared, and their unit.
QUANTITIES = {'wheel_rate': 'rad/s', 'yaw_rate': 'rad/s'}


@dataclass
class RunningError:
    """
    Root mean square of errors: over all of them, and of the last seconds.

    Parameters
    ----------
    memory : float
        Time constant of forgetting [s].

    """

    memory: float = MEMORY
    total: float = 0.0
    count: int = 0
    recent: float = 0.0
    weight: float = 0.0
    last: float = -math.inf

    def add(self, moment: float, error: float) -> None:
        """Take in one error [unit of the quantity] at a moment [s]."""
        decay = math.exp(-max(moment - self.last, 0.0) / self.memory)
        self.last = moment
        self.recent = self.recent * decay + error * error
        self.weight = self.weight * decay + 1.0
        self.total += error * error
        self.count += 1

    @property
    def now(self) -> float:
        """Root mean square of the last seconds; NaN before the first error."""
        return math.sqrt(self.recent / self.weight) if self.weight else math.nan

    @property
    def overall(self) -> float:
        """Root mean square of all errors; NaN before the first one."""
        return math.sqrt(self.total / self.count) if self.count else math.nan


@dataclass(eq=False)
class Shadow:
    """
    A model that gets the robot's commands.

    Parameters
    ----------
    plant : Plant
        An effect with an onset in time is taken to have begun; one that begins at a place
        begins there.
    settings : Settings, optional
        Of the robot: its limits of speed and acceleration, and the time after which it forgets
        a command; by default those of the paper, which has none.

    """

    plant: Plant
    settings: Settings = field(default_factory=lambda: make_settings(command_timeout=0.0))
    errors: dict[str, RunningError] = field(
        default_factory=lambda: {name: RunningError() for name in QUANTITIES})

    def __post_init__(self) -> None:
        """Make the simulator."""
        onset = self.plant.onset
        if onset is not None and onset.kind.value == 'time':
            self.plant = Plant((self.plant.sets[-1],), self.plant.states)
        self._simulator = Simulator(self.plant, PERIOD)
        # Compiling takes seconds; better now than while the robot drives.
        self._simulator.step(self._simulator.initial(), BodyTwist(0.0, 0.0))
        self._state: SimulatorState | None = None
        #: Time; wheel rates, yaw rate and wheel angles, these without what was corrected so far.
        self._past: deque[tuple[float, tuple[float, ...]]] = deque(maxlen=round(_PAST / PERIOD))
        self._turned = (0.0, 0.0)
        self._command = BodyTwist(0.0, 0.0)
        #: What goes to the model, behind the robot's limits.
        self._applied = BodyTwist(0.0, 0.0)
        self._since = 0.0
        self._pose = Pose()
        #: What the model read last, to be shown beside what was measured.
        self.readings: dict[str, tuple[float, ...]] = {}

    def restart(self) -> None:
        """Begin anew with what is measured next."""
        self._state = None
        self._past.clear()

    def command(self, moment: float, command: BodyTwist) -> None:
        """Advance to a moment [s], then obey another command."""
        self._advance(moment)
        self._command, self._since = command, moment

    def _advance(self, moment: float) -> SimulatorState | None:
        state = self._state
        if state is None or moment - state.time >= SILENCE:
            self.restart()
            return None
        while state.time + PERIOD <= moment:
            old = 0.0 < self.settings.command_timeout < state.time - self._since
            self._applied = BodyTwist(0.0, 0.0) if old else limited(
                self._applied, self._command, self.settings, PERIOD)
            state = self._simulator.step(state, self._applied)
            self._remember(state)
        self._state = state
        return state

    def _remember(self, state: SimulatorState) -> None:
        left, right = state.wheel_angles
        self._past.append((state.time, (*state.wheel_rates, state.twist.yaw,
                                        left - self._turned[0], right - self._turned[1])))

    def _sensed(self, moment: float, late: float) -> tuple[float, ...] | None:
        # Wheel rates, yaw rate and wheel angles of a moment that is past, linear between steps;
        # None where it is too long ago.
        wanted = moment - late
        if not self._past or wanted < self._past[0][0] - PERIOD:
            return None
        back = min(max((self._past[-1][0] - wanted) / PERIOD, 0.0), len(self._past) - 1.0)
        whole = int(back)
        near = self._past[-1 - whole][1]
        far = self._past[-2 - whole][1] if back > whole else near
        share = back - whole
        *rates, left, right = ((1.0 - share) * a + share * b
                               for a, b in zip(near, far, strict=True))
        return (*rates, left + self._turned[0], right + self._turned[1])

    def place(self, pose: Pose, *, correct: bool = False) -> None:
        """
        Take in where the robot is.

        Parameters
        ----------
        pose : Pose
            The model begins there when it begins (again).
        correct : bool
            Put a model that runs there as well: slopes and places are those of the world.

        """
        self._pose = pose
        if correct and self._state is not None:
            flat = np.array(self._state.flat)
            n = self._state.n
            flat[n + 3:n + 6] = pose.heading, pose.x, pose.y
            flat.setflags(write=False)
            self._state = replace(self._state, flat=flat)

    def _turn(self, left: float, right: float) -> None:
        # Wheel angles are known: what depends on them stays in phase.
        if self._state is not None:
            self._turned = self._turned[0] + left, self._turned[1] + right
            flat = np.array(self._state.flat)
            flat[self._state.n] += left
            flat[self._state.n + 1] += right
            flat.setflags(write=False)
            self._state = replace(self._state, flat=flat)

    def wheels(self, moment: float, left: float, right: float,
               angles: tuple[float, float] | None = None) -> None:
        """
        Compare with measured wheel rates.

        Parameters
        ----------
        moment : float
            Stamp [s].
        left, right : float
            [rad/s]
        angles : tuple of float, optional
            Left and right [rad], where they are measured.

        """
        # What is on its way for long may be older than the newest state, not than all.
        state = self._advance(moment) if self._state is not None and (
            moment >= self._state.time - _PAST) else None
        if state is None:
            self._begin(moment, left, right, angles)
            return
        sensors = sensor_model(self.plant, state)
        sensed = self._sensed(moment, sensors.delay_wheels)
        if sensed is None:
            return
        factors = sensors.encoder_left, sensors.encoder_right
        self.readings['wheel_rate'] = (factors[0] * sensed[0], factors[1] * sensed[1])
        for value, expected in zip((left, right), self.readings['wheel_rate'], strict=True):
            self.errors['wheel_rate'].add(moment, value - expected)
        if angles is not None and all(map(math.isfinite, angles)):
            self._turn(angles[0] / factors[0] - sensed[3], angles[1] / factors[1] - sensed[4])

    def _begin(self, moment: float, left: float, right: float,
               angles: tuple[float, float] | None) -> None:
        # A robot that moves already rolls, and follows what it was told last.
        sensors = self.plant.sets[0].sensors
        factors = sensors.encoder_left, sensors.encoder_right
        rates = left / factors[0], right / factors[1]
        twist = self._simulator.rolling(*rates)
        last = TimeSeries(np.array([self._since]), np.array(
            [[self._command.forward, self._command.yaw]]), ('forward', 'yaw'))
        known = angles is not None and all(map(math.isfinite, angles))
        self._past.clear()
        self._state = self._simulator.initial(
            self._pose, twist, time=moment - sensors.delay_wheels, wheel_rates=rates,
            wheel_angles=(angles[0] / factors[0], angles[1] / factors[1])
            if known and angles is not None else (0.0, 0.0),
            command=commanded_until(moment, last, twist, rates, self.settings.command_timeout))
        self._applied = twist
        self._turned = (0.0, 0.0)
        self._remember(self._state)

    def gyro(self, moment: float, rate: float) -> None:
        """Compare with a measured yaw rate [rad/s]."""
        state = self._advance(moment)
        if state is None:
            return
        sensors = sensor_model(self.plant, state)
        sensed = self._sensed(moment, sensors.delay_imu)
        if sensed is not None:
            expected = sensors.gyro_factor * sensed[2] + sensors.gyro_bias
            self.readings['yaw_rate'] = (expected,)
            self.errors['yaw_rate'].add(moment, rate - expected)
