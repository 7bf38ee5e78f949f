# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A Husky in the test's own process that moves only when told to."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.ros.engine import Engine, Reading
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.signals import BodyTwist, TimeSeries

#: Columns of a drive.
COLUMNS = ('x', 'y', 'heading', 'forward', 'yaw', 'wheel_x', 'wheel_y', 'wheel_heading')
Controller = Callable[[Reading], BodyTwist]


class LockStepHusky:
    """
    The node's engine without node, clock and middleware.

    Parameters
    ----------
    **settings
        Any parameter of the node, such as ``preset`` or ``rate``.

    Raises
    ------
    SettingsError
        If a parameter is unknown or its value not allowed.

    """

    def __init__(self, **settings: object) -> None:
        """Stand at the initial pose."""
        self.settings = make_settings(settings)
        self.engine = Engine(self.settings)

    @property
    def reading(self) -> Reading:
        """Return what the node would have published last."""
        return self.engine.reading

    def step(self, command: BodyTwist | None = None) -> Reading:
        """
        Advance by one period.

        Parameters
        ----------
        command : BodyTwist, optional
            A command that arrives now; without, the last one holds until its timeout.

        Returns
        -------
        Reading

        """
        if command is not None:
            self.engine.command(command)
        return self.engine.step()

    def drive(self, controller: Controller | BodyTwist, seconds: float) -> TimeSeries:
        """
        Let a controller drive for some simulated time.

        Parameters
        ----------
        controller : callable or BodyTwist
            Called with the last reading before each step, or a constant command.
        seconds : float
            Simulated time [s].

        Returns
        -------
        TimeSeries
            :data:`COLUMNS` at the end of each step: truth and wheel odometry.

        """
        times: list[float] = []
        rows: list[tuple[float, ...]] = []
        for _ in range(round(seconds * self.settings.rate)):
            command = controller if isinstance(controller, BodyTwist) else controller(
                self.reading)
            reading = self.step(command)
            times.append(reading.time)
            pose, wheels = reading.pose, reading.wheel_pose
            rows.append((pose.x, pose.y, pose.heading, reading.twist.forward, reading.twist.yaw,
                         wheels.x, wheels.y, wheels.heading))
        return TimeSeries(times, rows, COLUMNS)  # type: ignore[arg-type]
