# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Picture and summary of a recorded drive of the live node."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TYPE_CHECKING

from lg_husky_sim.signals import FloatArray
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class Drive:
    """
    What a bag of the live node holds.

    Parameters
    ----------
    command : numpy.ndarray, shape (n, 3)
        Time [s], forward [m/s], yaw [rad/s].
    truth, wheels : numpy.ndarray, shape (n, 6)
        Time [s], x, y [m], heading [rad], forward [m/s], yaw rate [rad/s] of ground truth and
        wheel odometry.

    """

    command: FloatArray
    truth: FloatArray
    wheels: FloatArray


def read_drive(bag: Path, command: str, truth: str, wheels: str) -> Drive:
    """
    Read commands and both odometries from a bag of the live node.

    Parameters
    ----------
    bag : Path
        Folder of a rosbag2.
    command, truth, wheels : str
        Full names of the topics.

    Returns
    -------
    Drive
        Times since the first truth; those of the commands are when they arrived.

    """
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import get_typestore, Stores
    rows: dict[str, list[tuple[float, ...]]] = {command: [], truth: [], wheels: []}
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        chosen = [c for c in reader.connections if c.topic in rows]
        for connection, stamp, raw in reader.messages(chosen):
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.topic == command:
                twist = getattr(message, 'twist', message)
                rows[command].append((stamp * 1e-9, twist.linear.x, twist.angular.z))
                continue
            header, pose, twist = message.header.stamp, message.pose.pose, message.twist.twist
            heading = 2.0 * np.arctan2(pose.orientation.z, pose.orientation.w)
            rows[connection.topic].append((
                header.sec + header.nanosec * 1e-9, pose.position.x, pose.position.y, heading,
                twist.linear.x, twist.angular.z))
    arrays = {topic: np.array(values).reshape(len(values), 3 if topic == command else 6)
              for topic, values in rows.items()}
    start = arrays[truth][0, 0]
    for topic in rows:
        arrays[topic][:, 0] -= start
    for topic in (truth, wheels):
        arrays[topic][:, 3] = np.unwrap(arrays[topic][:, 3], period=2.0 * np.pi)
    return Drive(arrays[command], arrays[truth], arrays[wheels])


def draw_path(axes: Axes, drive: Drive) -> None:
    """Draw where the robot went, and where its wheels say it went."""
    axes.plot(drive.truth[:, 1], drive.truth[:, 2], label='model (ground truth)', lw=2.0)
    axes.plot(drive.wheels[:, 1], drive.wheels[:, 2], '--', label='wheel odometry')
    axes.plot(drive.truth[0, 1], drive.truth[0, 2], 'o', color='black', ms=5, label='start')
    axes.set(xlabel='x [m]', ylabel='y [m]', title='Trajectory', aspect='equal')
    axes.grid(alpha=0.3)
    axes.legend(loc='best', fontsize=8)


def draw_speed(axes: Axes, drive: Drive, column: int, label: str) -> None:
    """
    Draw one component of the velocity over the commanded one.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Drawn into.
    drive : Drive
        What to draw.
    column : int
        0 forward, 1 yaw.
    label : str
        Of the ordinate.

    """
    axes.step(drive.command[:, 0], drive.command[:, 1 + column], where='post', color='0.6',
              label='command')
    axes.plot(drive.truth[:, 0], drive.truth[:, 4 + column], label='model (ground truth)')
    axes.plot(drive.wheels[:, 0], drive.wheels[:, 4 + column], '--', label='wheel odometry')
    axes.set(xlabel='time [s]', ylabel=label)
    axes.grid(alpha=0.3)
    axes.legend(loc='best', fontsize=8)


def save_picture(drive: Drive, path: Path, title: str) -> None:
    """Write trajectory and velocities as a PNG."""
    from matplotlib.figure import Figure
    figure = Figure(figsize=(10.0, 5.0), layout='constrained')
    figure.suptitle(title)
    grid = figure.add_gridspec(2, 2)
    draw_path(figure.add_subplot(grid[:, 0]), drive)
    draw_speed(figure.add_subplot(grid[0, 1]), drive, 0, 'forward [m/s]')
    draw_speed(figure.add_subplot(grid[1, 1]), drive, 1, 'yaw rate [rad/s]')
    figure.savefig(path, dpi=120)


def summary_lines(drive: Drive) -> list[str]:
    """Return what a reader wants to know of a drive."""
    truth, wheels = drive.truth, drive.wheels
    way = float(np.sum(np.hypot(np.diff(truth[:, 1]), np.diff(truth[:, 2]))))
    # The node says where it stands as soon as it can, and starts its clockwork a little later.
    gaps = np.diff(truth[1:, 0])
    off = float(np.hypot(truth[-1, 1] - wheels[-1, 1], truth[-1, 2] - wheels[-1, 2]))
    return [
        f'drive            {truth[-1, 0] - truth[0, 0]:.2f} s, {way:.2f} m',
        f'stamps           {len(truth) - 1} steps, {1.0 / np.mean(gaps):.3f} Hz, largest gap '
        f'{1e3 * np.max(gaps):.2f} ms',
        f'turned           {truth[-1, 3] - truth[0, 3]:.4f} rad',
        f'end (truth)      x {truth[-1, 1]:.4f} m, y {truth[-1, 2]:.4f} m',
        f'end (wheels)     x {wheels[-1, 1]:.4f} m, y {wheels[-1, 2]:.4f} m: {off:.4f} m off',
        f'largest speed    {np.max(np.abs(truth[:, 4])):.4f} m/s, '
        f'{np.max(np.abs(truth[:, 5])):.4f} rad/s',
    ]
