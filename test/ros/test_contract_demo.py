# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The main job in small: node, driver, recorder, picture, summary; and their bad input."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from lg_husky_sim.errors import CommandError, RecordingError
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.ros.commands import ZEROS
from lg_husky_sim.ros.driver import drive
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.ros.tool import Orderly, Tool
from lg_husky_sim.testing.live import LiveHusky, Probe
import numpy as np
import pytest

SHORT = Manoeuvre('short', (Step(0.2, 0.0, 0.0), Step(1.2, 0.5, 0.3), Step(0.6, 0.0, 0.0)))


@pytest.mark.realtime
@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_driven_recording_can_be_read_and_summed_up(
        probe: Probe, start: Callable[..., LiveHusky], tmp_path: Path, storage: str) -> None:
    """What the node sends during a drive ends in a bag that our reader and report take."""
    from lg_husky_sim.recording import read_recording
    from lg_husky_sim.ros.demo_report import read_drive, summary_lines
    from lg_husky_sim.ros.recorder import recorded_topics, Recorder
    settings = make_settings()
    recorder = Recorder(probe.node, tmp_path / 'bag', recorded_topics(settings), storage)
    husky = start()
    assert probe.until(lambda: recorder.counts[f'/{settings.odometry_topic}'] > 5)
    seen: list[float] = []
    tool = Tool('lg_husky_driver', Orderly())
    assert drive(tool, SHORT, settings, progress=seen.append) == len(SHORT.commands())
    tool.close()
    # Nobody served the recorder meanwhile; it has a backlog.
    assert probe.until(lambda: recorder.counts[f'/{settings.command_topic}'] == len(
        SHORT.commands()) + ZEROS)
    probe.spin(0.5)
    assert husky.node.stop() == 0
    served = -1
    while served != sum(recorder.counts.values()):
        served = sum(recorder.counts.values())
        probe.spin(0.3)
    recorder.close()
    assert seen == sorted(seen)
    recording = read_recording(tmp_path / 'bag')
    command = recording.streams['command']
    assert np.max(command.column('forward')) == 0.5
    assert np.max(np.abs(recording.streams['imu'].column('yaw_rate'))) > 0.2
    assert set(recording.streams) >= {'command', 'wheels', 'imu', 'pose'}
    told = read_drive(tmp_path / 'bag', f'/{settings.command_topic}', '/ground_truth',
                      f'/{settings.odometry_topic}')
    lines = summary_lines(told)
    assert any('steps, 50.0' in line for line in lines)
    assert told.truth[-1, 1] > 0.2
    # Both come with every step; discovery may begin to see one of them a step earlier.
    begin = max(told.wheels[0, 0], told.truth[0, 0])
    end = min(told.wheels[-1, 0], told.truth[-1, 0])
    both = [rows[(rows[:, 0] >= begin) & (rows[:, 0] <= end)] for rows in (
        told.wheels, told.truth)]
    np.testing.assert_array_equal(both[0][:, 0], both[1][:, 0])
    assert len(both[0]) > 50
    assert max(len(told.wheels), len(told.truth)) - len(both[0]) <= 10
    with pytest.raises(RecordingError, match='exists already'):
        Recorder(probe.node, tmp_path / 'bag', {})
    with pytest.raises(RecordingError, match="storage 'zip' is unknown"):
        Recorder(probe.node, tmp_path / 'other', {}, 'zip')


def test_the_picture_shows_both_odometries(tmp_path: Path) -> None:
    """The picture is a PNG with truth, wheel odometry and command."""
    pytest.importorskip('matplotlib')
    from lg_husky_sim.ros.demo_report import draw_path, draw_speed, Drive, save_picture
    from matplotlib.figure import Figure
    times = np.linspace(0.0, 5.0, 50)
    body = np.column_stack([times, times, times**2, 0.1 * times, times, 0.2 * times])
    one = Drive(body[:, :3], body, 0.9 * body)
    axes = Figure().subplots(2)
    draw_path(axes[0], one)
    draw_speed(axes[1], one, 1, 'yaw rate [rad/s]')
    assert [line.get_label() for line in axes[0].get_lines()] == [
        'model (ground truth)', 'wheel odometry', 'start']
    assert np.array_equal(axes[1].get_lines()[1].get_ydata(), body[:, 5])
    save_picture(one, tmp_path / 'p.png', 'title')
    assert (tmp_path / 'p.png').read_bytes().startswith(b'\x89PNG')


def test_a_driver_without_listener_says_so(probe: Probe) -> None:
    """Nobody listens: one line that names topic, type and what may be wrong."""
    settings = make_settings(command_topic='/nobody/cmd_vel')
    with pytest.raises(CommandError, match=r'no node subscribes to /nobody/cmd_vel \(Twist\)'):
        drive(Tool('lg_husky_driver', Orderly()), SHORT, settings, wait=0.2)


def test_a_failed_recording_leaves_nothing(probe: Probe, tmp_path: Path) -> None:
    """A recording that is thrown away leaves neither bag nor scratch folder."""
    from lg_husky_sim.ros.recorder import Recorder
    recorder = Recorder(probe.node, tmp_path / 'bag', {'/x': 'std_msgs/msg/Bool'})
    recorder.close(keep=False)
    recorder.close()
    assert list(tmp_path.iterdir()) == []
