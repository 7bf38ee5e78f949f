# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The robot without its middleware: commands in, one reading a step out; knows no clock."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import NamedTuple

from lg_husky_sim.errors import LgHuskyError, SettingsError
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model, ModelFile
from lg_husky_sim.ros.sensors import Measured, sensor_model, Sensors
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.ros.wheel_odometry import WheelOdometry
from lg_husky_sim.signals import BodyTwist, Pose
from lg_husky_sim.simulation import Simulator, SimulatorState
import numpy as np

#: Place of the simulated time in the flat state, after the states (see the kernel's layout).
TIME = 6
#: Largest command that is handed on [m/s, rad/s]; the voltage is saturated long before.
LARGEST = 1e6


class Reading(NamedTuple):
    """
    All that is published of one step.

    Parameters
    ----------
    step : int
        Steps since the start or the last reset of time.
    time : float
        Simulated time [s].
    pose, twist : Pose, BodyTwist
        Truth.
    wheel_pose, wheel_twist : Pose, BodyTwist
        Wheel odometry.
    measured : Measured
        Encoders and IMU.
    torques : tuple of float
        Of one wheel of the left and of the right side [N·m].
    voltage, current : float
        Battery [V], [A]; the current is negative while discharging.

    """

    step: int
    time: float
    pose: Pose
    twist: BodyTwist
    wheel_pose: Pose
    wheel_twist: BodyTwist
    measured: Measured
    torques: tuple[float, float]
    voltage: float
    current: float


def read_model(path: str) -> ModelFile:
    """
    Load a model file; an empty path is the packaged Husky.

    Raises
    ------
    SettingsError
        With the path and the reason, if it cannot be used.

    """
    try:
        return load_model(path or None)
    except (LgHuskyError, OSError) as error:
        raise SettingsError(f'model = {path!r} cannot be used: {error}') from error


def _approach(now: float, wanted: float, largest: float, change: float) -> float:
    if largest > 0.0:
        wanted = max(-largest, min(largest, wanted))
    if change > 0.0:
        wanted = now + max(-change, min(change, wanted - now))
    return wanted


def limited(last: BodyTwist, wanted: BodyTwist, settings: Settings, period: float) -> BodyTwist:
    """
    Apply the limits of speed and acceleration.

    Parameters
    ----------
    last : BodyTwist
        What went to the motors in the step before.
    wanted : BodyTwist
        What is commanded.
    settings : Settings
        Limits of zero are off.
    period : float
        Time since the step before [s].

    """
    return BodyTwist(
        _approach(last.forward, wanted.forward, settings.max_forward,
                  settings.max_forward_acceleration * period),
        _approach(last.yaw, wanted.yaw, settings.max_yaw, settings.max_yaw_acceleration * period))


class Engine:
    """
    A robot that is stepped.

    Parameters
    ----------
    settings : Settings

    Raises
    ------
    SettingsError
        If the model file cannot be used.

    """

    def __init__(self, settings: Settings) -> None:
        """Load the model and stand at the initial pose."""
        self.settings = settings
        self.total = 0
        self._use(read_model(settings.model))
        self._begin(self._initial_pose(), 0)

    def _use(self, model: ModelFile) -> None:
        try:
            plant = compile_model(model.structure).at(model.parameters)
            self._simulator = Simulator(plant, self.settings.period)
        except LgHuskyError as error:
            raise SettingsError(f'model = {self.settings.model!r} cannot be used: {error}'
                                ) from error
        values = model.parameters
        self._torque = 0.5 * values['torque_constant'] * values['gear_ratio']
        self._supply = values['supply_voltage']

    def _initial_pose(self) -> Pose:
        one = self.settings
        return Pose(one.initial_x, one.initial_y, one.initial_heading)

    def _begin(self, pose: Pose, step: int, twist: BodyTwist | None = None) -> None:
        one = self.settings
        self.step_count = step
        self._command = BodyTwist()
        self._held = 0
        self._applied = BodyTwist()
        self._odometry = WheelOdometry(
            one.wheel_radius, one.wheel_separation * one.wheel_separation_multiplier,
            one.odometry_window, pose)
        if step == 0:
            self._sensors = Sensors(one)
        self._sensors.forget()
        self._angles = (0.0, 0.0)
        self.state = self._simulator.initial(pose, twist, time=step * one.period)
        self.reading = self._read()

    def command(self, twist: BodyTwist) -> bool:
        """
        Take a new command.

        Parameters
        ----------
        twist : BodyTwist
            What arrived.

        Returns
        -------
        bool
            False if it holds NaN or infinity; the command before then stays.

        """
        if not (math.isfinite(twist.forward) and math.isfinite(twist.yaw)):
            return False
        self._command = BodyTwist(max(-LARGEST, min(LARGEST, twist.forward)),
                                  max(-LARGEST, min(LARGEST, twist.yaw)))
        self._held = 0
        return True

    @property
    def timed_out(self) -> bool:
        """Whether the last command is older than the timeout."""
        timeout = self.settings.command_timeout
        return timeout > 0.0 and self._held * self.settings.period > timeout - 1e-9

    def step(self) -> Reading:
        """Advance by one period and return what is to be published."""
        if self.timed_out:
            self._applied = BodyTwist()
        else:
            self._applied = limited(
                self._applied, self._command, self.settings, self.settings.period)
        before: SimulatorState = self.state
        self.state = self._simulator.step(before, self._applied)
        self._held += 1
        self.step_count += 1
        self.total += 1
        self.reading = self._read()
        return self.reading

    def _read(self) -> Reading:
        state, one = self.state, self.settings
        measured = self._sensors.read(state, self._simulator.plant, one)
        left, right = self._angles
        self._angles = measured.wheel_angles
        self._odometry.update(self._angles[0] - left, self._angles[1] - right, one.period)
        left, right = state.currents
        v_left, v_right = state.voltages
        power = v_left * left + v_right * right
        voltage = sensor_model(self._simulator.plant, state).battery_voltage(
            self._supply, power, state.time)
        return Reading(
            self.step_count, self.step_count * one.period, state.pose, state.twist,
            self._odometry.pose, self._odometry.twist, measured,
            (self._torque * left, self._torque * right), voltage,
            # Not −0.0 at rest.
            0.0 - power / voltage)

    def reset(self, pose: Pose | None = None, *, time: bool = False,
              twist: BodyTwist | None = None) -> Reading:
        """
        Begin anew somewhere, as after a start.

        Parameters
        ----------
        pose : Pose, optional
            The initial pose of the settings if not given.
        time : bool
            Whether simulated time and the sensors' noise start anew as well.
        twist : BodyTwist, optional
            Motion to begin with; at rest if not given.

        """
        self._begin(pose or self._initial_pose(), 0 if time else self.step_count, twist)
        return self.reading

    def rewind(self) -> None:
        """Begin simulated time anew and leave the robot as it is."""
        state = self.state
        flat = np.array(state.flat)
        flat[state.n + TIME] = 0.0
        flat.setflags(write=False)
        self.state = replace(state, flat=flat)
        self.step_count = 0
        self.reading = self.reading._replace(step=0, time=0.0)

    def configure(self, settings: Settings) -> None:
        """
        Take live settings; a changed model file is loaded and goes on without a jump.

        Raises
        ------
        SettingsError
            If the model file cannot be used; the old one then stays.

        """
        before = self.settings
        self.settings = settings
        if settings.model != before.model:
            try:
                self._use(read_model(settings.model))
            except SettingsError:
                self.settings = before
                raise
            self.state = self._simulator.adopt(self.state)
