# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The live tools on a robot: they stop it, find it, hear it and lose nothing of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import os
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Any

from lg_husky_sim.errors import CommandError, RecordingError
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.ros import api, commands
from lg_husky_sim.ros.commands import ZEROS
from lg_husky_sim.ros.driver import drive
from lg_husky_sim.ros.graph import Endpoint
from lg_husky_sim.ros.player import play
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.ros.tool import Ended, Orderly, Tool
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.testing.live import LiveHusky, Probe, probed_domain
import numpy as np
import pytest

FAST = Manoeuvre('fast', (Step(20.0, 3.0, -4.0),))
COMMAND = '/husky_velocity_controller/cmd_vel'
LOOKING = 'looking for the robot (up to {} s), then for others (3.5 s)\n'
#: A parent that starts a tool and dies without a word.
CRUEL_PARENT = """
import os, subprocess, sys
subprocess.Popen([sys.executable, '-m', 'lg_husky_sim.cli.main', *sys.argv[1:]],
                 stdin=subprocess.DEVNULL)
sys.stdin.readline()
os._exit(9)
"""


@pytest.fixture
def probe() -> Iterator[Probe]:
    """Return a probe in a domain of the test's own: who listens is what these tests ask."""
    with probed_domain() as one:
        yield one


def run(*words: str | Path, **options: Any) -> subprocess.Popen[str]:
    """Start a verb in a process of its own."""
    return subprocess.Popen(
        [sys.executable, '-u', '-m', 'lg_husky_sim.cli.main', *map(str, words)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def speeds(heard: Sequence[Any]) -> list[tuple[float, float]]:
    """Return forward speed and yaw rate of each command."""
    return [(message.linear.x, message.angular.z) for message in heard]


def ended_with_zeros(heard: Sequence[Any]) -> bool:
    """Return whether the robot was moved, and told to stop last."""
    told = speeds(heard)
    return any(one != (0.0, 0.0) for one in told) and told[-ZEROS:] == [(0.0, 0.0)] * ZEROS


@pytest.mark.parametrize('end', ['SIGINT', 'SIGTERM', 'parent'])
def test_a_drive_that_is_ended_stops_the_robot(probe: Probe, tmp_path: Path, end: str) -> None:
    """Row 16: the last commands were 0.8 m/s after Ctrl-C."""
    script = tmp_path / 'fast.yaml'
    script.write_text('schema: lg_husky_sim/commands/1\nrate: 20\nsteps:\n'
                      '  - {duration: 60.0, forward: 0.8, yaw: 0.3}\n', encoding='utf-8')
    heard = probe.listen('geometry_msgs/msg/Twist', COMMAND)
    words = ['drive', str(script), '--preset', 'paper', '--wait', '60']
    if end == 'parent':
        process = subprocess.Popen([sys.executable, '-c', CRUEL_PARENT, *words],
                                   stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    else:
        process = run(*words)
    try:
        assert probe.until(lambda: len(heard) > 10, 90.0), process.poll()
        if end == 'parent':
            assert process.stdin is not None
            process.stdin.write('\n')
            process.stdin.flush()
        else:
            process.send_signal(getattr(signal, end))
        assert probe.until(lambda: ended_with_zeros(heard), 15.0), speeds(heard)[-3:]
        _, said = process.communicate(timeout=15.0)
        count = len(heard)
        probe.spin(0.3)
        assert len(heard) == count
    finally:
        process.kill()
        process.wait()
    assert '%|' not in said  # no bar where nobody watches
    assert f'{COMMAND} moves /probe (Twist); no limit in this preset' in said.splitlines()
    assert 'Traceback' not in said
    if end != 'parent':
        assert process.returncode == 130


def test_commands_stay_within_the_limits_and_an_error_stops_the_robot(probe: Probe) -> None:
    """Row 16: 3 m/s and −4 rad/s become the preset's 1 m/s and −2 rad/s; zero comes last."""
    heard = probe.listen('geometry_msgs/msg/Twist', COMMAND)
    said: list[str] = []
    tool = Tool('lg_husky_driver', Orderly())

    def fail(moment: float) -> None:
        if moment > 0.3:
            raise ZeroDivisionError

    try:
        with pytest.raises(ZeroDivisionError):
            drive(tool, FAST, make_settings(preset='husky_ros1'), say=said.append, progress=fail)
    finally:
        tool.close()
    probe.spin(0.2)
    assert set(speeds(heard)) == {(1.0, -2.0), (0.0, 0.0)}
    assert ended_with_zeros(heard)
    assert said == [f'{COMMAND} moves /probe (Twist); at most 1 m/s, at most 2 rad/s']


def test_playing_that_is_ended_stops_the_robot(probe: Probe, tmp_path: Path) -> None:
    """Row 16: as a drive does, and within the limits of the preset."""
    pytest.importorskip('rosbags')
    from lg_husky_sim.recording import write_recording
    times = np.arange(1200) * np.float64(0.05)
    write_recording(tmp_path / 'bag', {
        'command': TimeSeries(times, np.tile([3.0, 0.3], (1200, 1)), ('forward', 'yaw')),
        'wheels': TimeSeries(times, np.zeros((1200, 2)), ('left', 'right'))})
    heard = probe.listen('geometry_msgs/msg/Twist', COMMAND)
    player = run('play', tmp_path / 'bag', '--preset', 'husky_ros1', '--wait', '60')
    try:
        assert probe.until(lambda: len(heard) > 10, 90.0), player.poll()
        player.send_signal(signal.SIGTERM)
        assert probe.until(lambda: ended_with_zeros(heard), 15.0), speeds(heard)[-3:]
        _, said = player.communicate(timeout=15.0)
    finally:
        player.kill()
        player.wait()
    assert set(speeds(heard)) == {(1.0, 0.3), (0.0, 0.0)}
    assert f'{COMMAND} moves /probe (Twist); at most 1 m/s, at most 2 rad/s' in said.splitlines()


def test_a_recorder_is_no_robot_and_another_type_is_named(probe: Probe, tmp_path: Path) -> None:
    """Who only listens is not moved; Twist and TwistStamped do not hear each other."""
    tool = Tool('lg_husky_recorder', Orderly())
    settings = make_settings(command_topic='/b/cmd_vel')
    tool.node.create_subscription(
        api.message_type('geometry_msgs/msg/Twist'), '/b/cmd_vel', print, 10)
    driver = Tool('lg_husky_driver', Orderly())
    try:
        with pytest.raises(CommandError, match=r'no node subscribes to /b/cmd_vel \(Twist\)'):
            drive(driver, FAST, settings, wait=0.5)
    finally:
        driver.close()
        tool.close()
    stamped = probe.listen('geometry_msgs/msg/TwistStamped', '/c/cmd_vel')
    # From a process of its own: Fast DDS knows a topic of one type only in each, and takes up to
    # 2 s on an idle machine to tell one process of another's ends.
    other = run('drive', 'circle', '--topic', '/c/cmd_vel', '--namespace', '/', '--wait', '6')
    assert probe.until(lambda: other.poll() is not None, 60.0)
    _, said = other.communicate()
    assert other.returncode == 1
    assert '/probe listens to TwistStamped there' in said
    assert not stamped


@pytest.mark.parametrize(('name', 'moved'), [
    ('/lg_husky_recorder', False), ('/husky', True), ('/_NODE_NAME_UNKNOWN_', True)])
def test_who_listens_is_known_by_name_before_anything_moves(
        probe: Probe, monkeypatch: pytest.MonkeyPatch, name: str, moved: bool) -> None:
    """Fast DDS tells of a listener before it tells whose it is: a recorder passed for a robot."""
    heard = probe.listen('geometry_msgs/msg/Twist', '/late/cmd_vel')
    begun = time.monotonic()

    def late(node: api.Node, topic: str) -> tuple[Endpoint, ...]:
        shown = name if time.monotonic() > begun + 1.0 else '/_NODE_NAME_UNKNOWN_'
        return (Endpoint(shown, 'geometry_msgs/msg/Twist', True, False),)
    monkeypatch.setattr(commands, 'listeners', late)
    monkeypatch.setattr(commands, 'NAMES', 2.0)
    said: list[str] = []
    tool = Tool('lg_husky_driver', Orderly())
    try:
        one = commands.Commands(tool, make_settings(command_topic='/late/cmd_vel'))
        if moved:
            one.wait(0.5, said.append)
            assert said == [f'/late/cmd_vel moves {name} (Twist); no limit in this preset']
        else:
            with pytest.raises(CommandError, match='no node subscribes to /late/cmd_vel'):
                one.wait(0.5, said.append)
            assert said == []
    finally:
        tool.close()
    assert not heard


def test_a_robot_that_is_told_of_later_is_named_before_anything_moves(
        probe: Probe, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fast DDS told a drive of a monitor at once and of the robot after 3 s; it moved unnamed."""
    probe.listen('geometry_msgs/msg/Twist', '/two/cmd_vel')
    begun = time.monotonic()

    def late(node: api.Node, topic: str) -> tuple[Endpoint, ...]:
        names = ['/monitor'] + (['/robot'] if time.monotonic() > begun + 1.5 else [])
        return tuple(Endpoint(name, 'geometry_msgs/msg/Twist', True, False) for name in names)
    monkeypatch.setattr(commands, 'listeners', late)
    said: list[str] = []
    tool = Tool('lg_husky_driver', Orderly())
    try:
        commands.Commands(tool, make_settings(command_topic='/two/cmd_vel')).wait(
            0.5, said.append)
    finally:
        tool.close()
    assert said == [
        '/two/cmd_vel moves /monitor (Twist), /robot (Twist); no limit in this preset']


def test_a_tool_that_is_asked_to_end_says_so_once_signals_are_taken(probe: Probe) -> None:
    """Signals and the death of the parent are requests, not the end of the graph."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        # Whoever started the tests may have had a signal ignored, as nohup does.
        before = signal.signal(number, signal.default_int_handler)
        try:
            with Orderly() as orderly:
                orderly.check()
                os.kill(os.getpid(), number)
                with pytest.raises(Ended):
                    orderly.check()
        finally:
            signal.signal(number, before)
        assert api.ok()


def test_a_namespaced_robot_is_found_recorded_and_named_if_there_are_two(
        start: Callable[..., LiveHusky], probe: Probe, tmp_path: Path) -> None:
    """Row 17: /a200_0000 needs no option; of two, each is listed with its own."""
    heard = probe.listen('nav_msgs/msg/Odometry', '/a200_0000/platform/odom')
    husky = start(arguments=('-r', '__ns:=/a200_0000'), preset='clearpath_jazzy')
    husky.ready(heard)
    recorder = run('record', tmp_path / 'bag', '--seconds', '1.5')
    out, said = recorder.communicate(timeout=120.0)
    assert recorder.returncode == 0, said
    assert '/a200_0000/platform/odom' in out
    from lg_husky_sim.recording import read_recording
    assert set(read_recording(tmp_path / 'bag').streams) >= {'wheels', 'imu'}
    start(arguments=('-r', '__ns:=/b')).ready(
        probe.listen('nav_msgs/msg/Odometry', '/b/husky_velocity_controller/odom'))
    two = run('record', tmp_path / 'two')
    said = two.communicate(timeout=120.0)[1]
    assert (two.returncode, said) == (
        1, LOOKING.format(10) + 'error: 2 Huskies are in the graph, choose one: --preset '
        'clearpath_jazzy --namespace /a200_0000; --preset paper --namespace /b\n')
    words = ('drive', 'circle', '--ros-args', '-r', '__ns:=/a200_0000', '-p', 'max_forward:=0.1')
    driver = run(*words, env=os.environ | {'ROS_NAMESPACE': '/b'})
    told = probe.listen('geometry_msgs/msg/TwistStamped', '/a200_0000/platform/cmd_vel')
    try:
        assert probe.until(lambda: told, 30.0)
        driver.send_signal(signal.SIGINT)
        _, said = driver.communicate(timeout=10.0)
    finally:
        driver.kill()
        driver.wait()
    assert '/a200_0000/platform/cmd_vel moves' in said
    assert 'at most 0.1 m/s' in said
    assert max(message.twist.linear.x for message in told) <= 0.1


@pytest.mark.parametrize(('later', 'name'), [(0.5, '/rover'), (99.0, 'another node')])
def test_playing_names_who_else_publishes(
        probe: Probe, monkeypatch: pytest.MonkeyPatch, later: float, name: str) -> None:
    """Fast DDS tells of a publisher before it tells whose it is; ours is no other."""
    probe.listen('sensor_msgs/msg/JointState', '/joint_states')
    tool = Tool('lg_husky_player', Orderly())
    begun, said, kind = time.monotonic(), list[str](), 'sensor_msgs/msg/JointState'

    def publishers(node: api.Node, topic: str) -> tuple[Endpoint, ...]:
        shown = '/rover' if time.monotonic() > begun + later else '/_NODE_NAME_UNKNOWN_'
        return tuple(Endpoint(one, kind, True, False) for one in ('/lg_husky_player', shown))
    monkeypatch.setattr('lg_husky_sim.ros.player.publishers', publishers)
    try:
        play(tool, {'wheels': TimeSeries(np.array([0.0, 0.01]), np.zeros((2, 2)),
                                         ('left', 'right'))}, make_settings(), say=said.append)
    finally:
        tool.close()
    assert said[-1] == f'/joint_states is published by {name} as well: subscribers receive both'


def test_an_unknown_parameter_of_a_tool_is_named(probe: Probe, tmp_path: Path) -> None:
    """What is misspelt would be recorded without; parameters of other nodes end nothing."""
    spoken = run(*f'record {tmp_path}/bag --preset paper --namespace /nobody --seconds 0.5 '
                 '--ros-args -p imu_topics:=/x -p use_sim_time:=false'.split())
    out, said = spoken.communicate(timeout=120.0)
    assert (out + said).count('is ignored') == 1
    assert 'parameter imu_topics is unknown; did you mean imu_topic?; it is ignored' in out + said


def test_a_tool_without_a_robot_says_so(probe: Probe, tmp_path: Path) -> None:
    """Rows 17 and 20: one line with what to do, and nothing is written."""
    lonely = run('record', tmp_path / 'bag', '--wait', '0.5', '--namespace', '/nobody')
    _, said = lonely.communicate(timeout=120.0)
    assert lonely.returncode == 1
    assert said.startswith(
        LOOKING.format(0.5) + 'error: no robot is below /nobody in the graph (backend ')
    assert not (tmp_path / 'bag').exists()
    empty = run('record', tmp_path / 'bag', '--preset', 'husky_ros1', '--namespace', '/nobody',
                '--seconds', '0.5')
    _, said = empty.communicate(timeout=120.0)
    assert empty.returncode == 1
    assert 'error: nothing was received on /nobody/husky_velocity_controller/cmd_vel, ' in said
    assert not (tmp_path / 'bag').exists()


@pytest.mark.realtime
@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_best_effort_publishers_are_recorded_and_kill_9_loses_a_second_at_most(
        probe: Probe, tmp_path: Path, storage: str) -> None:
    """Rows 18 and 19: SensorDataQoS is heard; what a killed recorder leaves can be read."""
    imu, message = probe.talk('sensor_msgs/msg/Imu', f'/{storage}/imu',
                              api.qos_profile_sensor_data)
    recorder = run('record', tmp_path / 'bag', '--preset', 'paper', '--storage', storage,
                   '--ros-args', '-p', f'imu_topic:=/{storage}/imu')
    sent = 0

    def publish(until: float) -> None:
        nonlocal sent
        while time.monotonic() < until:
            one = message()
            one.header.stamp.sec, one.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
            one.angular_velocity.z = float(sent)
            imu.publish(one)
            sent += 1
            probe.spin(0.02)

    try:
        assert probe.until(lambda: imu.get_subscription_count() > 0, 30.0)
        publish(time.monotonic() + 3.0)
    finally:
        recorder.kill()
        recorder.wait()
    from lg_husky_sim.recording import read_recording
    read = read_recording(tmp_path / 'bag')
    rates = read.streams['imu'].column('yaw_rate')
    assert rates[-1] > sent - 1 - 60
    assert len(rates) > 60
    if storage == 'mcap':
        # rosbag2 counts its files.
        assert read.notes[0].removeprefix('bag').removeprefix('_0') == (
            '.mcap is truncated: read as far as it is complete')


def test_the_time_of_a_recording_begins_with_the_first_message(
        probe: Probe, tmp_path: Path) -> None:
    """Fast DDS told a recorder of a running robot after 2 s: one of 2 s heard nothing."""
    imu, message = probe.talk('sensor_msgs/msg/Imu', '/late/imu_um7/data')
    recorder = run('record', tmp_path / 'bag', '--preset', 'paper', '--namespace', '/late',
                   '--seconds', '0.5')
    try:
        assert probe.until(lambda: imu.get_subscription_count() > 0, 30.0)
        probe.spin(1.0)

        def published() -> bool:
            imu.publish(message())
            return recorder.poll() is not None
        assert probe.until(published, 10.0)
        out, said = recorder.communicate()
    finally:
        recorder.kill()
        recorder.wait()
    assert recorder.returncode == 0, said
    assert int(out.partition('  /late/imu_um7/data')[0].rpartition('\n')[2]) > 0


def test_a_recording_of_nothing_is_an_error(probe: Probe, tmp_path: Path) -> None:
    """It lists what is in the graph instead, and leaves no folder."""
    from lg_husky_sim.ros.recorder import record
    probe.talk('std_msgs/msg/Bool', '/something_else')
    tool = Tool('lg_husky_recorder', Orderly())
    try:
        with pytest.raises(RecordingError, match=r'nothing was received on .* /something_else'):
            record(tool, tmp_path / 'bag', make_settings(
                command_topic='n/a', odometry_topic='n/b', ground_truth_topic='n/c',
                joint_states_topic='n/d', imu_topic='n/e', battery_topic='n/f'), seconds=0.4)
    finally:
        tool.close()
    assert list(tmp_path.iterdir()) == []
