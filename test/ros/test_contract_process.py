# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that are started, told and ended in many ways: T1, T7-T10, T16, T17, clean exits."""

from __future__ import annotations

from collections.abc import Callable
import itertools
import json
import math
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Any

from lg_husky_sim import Husky
from lg_husky_sim.jit import compiled
from lg_husky_sim.ros import api
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.testing.live import LiveHusky, NodeProcess, Probe, write_parameters
import pytest

Start = Callable[..., LiveHusky]


def stamp(message: Any) -> int:
    """Return the header's stamp [ns]."""
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


def caught(node: NodeProcess, number: signal.Signals) -> bool:
    """Return whether main() has begun: the process has a handler of its own for a signal."""
    status = Path(f'/proc/{node.process.pid}/status').read_text(encoding='ascii')
    mask = next(line for line in status.splitlines() if line.startswith('SigCgt'))
    return bool(int(mask.split()[1], 16) >> (number - 1) & 1)


def children(process: int) -> list[Path]:
    """Return the /proc folders of a process's children."""
    words = (path.read_text() for path in Path(f'/proc/{process}/task').glob('*/children'))
    return [Path('/proc', word) for text in words for word in text.split()]


@pytest.mark.parametrize('end', [signal.SIGINT, signal.SIGKILL])
def test_the_node_runs_while_its_kernel_is_compiled_and_takes_the_compiler_along(
        probe: Probe, start: Start, tmp_path: Path, end: signal.Signals) -> None:
    """On a new installation the robot moves after seconds; no compiler outlives the node."""
    odom = probe.listen('nav_msgs/msg/Odometry', '/cold/odom')
    husky = start(environment={'NUMBA_CACHE_DIR': str(tmp_path)}, odometry_topic='/cold/odom')
    husky.ready(odom, 60.0)
    first = time.monotonic()
    assert probe.until(lambda: len(odom) >= 10)
    assert time.monotonic() - first < 1.5
    compilers = children(husky.node.process.pid)
    if compiled():
        assert 'the kernel is compiled in the background' in husky.node.log()
        assert len(compilers) == 1
    assert husky.node.stop(end) == (0 if end == signal.SIGINT else -9)
    assert probe.until(lambda: not any(one.exists() for one in compilers)), compilers


def test_clearpath_preset_takes_stamped_commands_and_ignores_stale_ones(
        probe: Probe, start: Start) -> None:
    """T1, T7: the Jazzy robot's names, types, frames and covariances together."""
    odom = probe.listen('nav_msgs/msg/Odometry', '/a200/platform/odom')
    joints = probe.listen('sensor_msgs/msg/JointState', '/a200/platform/joint_states')
    imu = probe.listen('sensor_msgs/msg/Imu', '/a200/sensors/imu_0/data')
    log = probe.listen('rcl_interfaces/msg/Log', '/rosout', 100)
    command, kind = probe.talk('geometry_msgs/msg/TwistStamped', '/a200/platform/cmd_vel')
    husky = start(('-r', '__ns:=/a200'), preset='clearpath_jazzy')
    husky.ready(odom)
    assert probe.until(lambda: joints and imu and command.get_subscription_count())
    assert joints[-1].name[3] == 'rear_right_wheel_joint'
    assert imu[-1].header.frame_id == 'imu_0_link'
    assert odom[-1].pose.covariance[35] == 0.01

    def send(age: float, stamped: bool = True) -> None:
        message = kind()
        if stamped:
            now = probe.node.get_clock().now().nanoseconds - round(age * 1e9)
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 10**9)
        message.twist.linear.x = 0.5
        command.publish(message)

    for _ in range(5):
        send(5.0)
        probe.spin(0.05)
    assert probe.until(lambda: any('command ignored' in m.msg for m in log), 5.0)
    assert odom[-1].twist.twist.linear.x == 0.0
    send(0.0, stamped=False)
    assert probe.until(lambda: odom[-1].twist.twist.linear.x > 0.05, 5.0)
    assert probe.until(lambda: odom[-1].twist.twist.linear.x < 0.01, 5.0)
    send(-2.0)
    assert probe.until(lambda: odom[-1].twist.twist.linear.x > 0.05, 5.0)


def test_three_robots_share_a_graph_without_crosstalk(probe: Probe, start: Start) -> None:
    """T8: a command to one namespace moves that robot only."""
    names = ('red', 'green', 'blue')
    truth = {name: probe.listen('nav_msgs/msg/Odometry', f'/{name}/ground_truth')
             for name in names}
    command, kind = probe.talk('geometry_msgs/msg/TwistStamped', '/green/platform/cmd_vel')
    huskies = [start(('-r', f'__ns:=/{name}'), preset='clearpath_jazzy',
                     initial_y=float(place)) for place, name in enumerate(names)]
    for husky, name in zip(huskies, names, strict=True):
        husky.ready(truth[name])
    assert probe.until(lambda: command.get_subscription_count() == 1 and all(
        len(truth[name]) > 3 for name in names))
    message = kind()
    message.twist.linear.x = 0.5

    def moved() -> bool:
        command.publish(message)
        probe.spin(0.05)
        return bool(truth['green'][-1].pose.pose.position.x > 0.1)
    assert probe.until(moved)
    probe.spin(0.2)
    for name in ('red', 'blue'):
        assert all(m.pose.pose.position.x == 0.0 for m in truth[name])
    assert [truth[name][-1].pose.pose.position.y for name in names] == [0.0, 1.0, 2.0]
    assert [husky.node.stop() for husky in huskies] == [0, 0, 0]


def test_clock_and_identical_trajectory_at_every_speed(probe: Probe, start: Start) -> None:
    """T9, T10: /clock is monotone, once a step; 1x, 20x and free running agree to the bit."""
    clock = probe.listen('rosgraph_msgs/msg/Clock', '/clock', 5000)
    joints = probe.listen('sensor_msgs/msg/JointState', '/joint_states', 5000)
    command, kind = probe.talk('geometry_msgs/msg/Twist', '/husky_velocity_controller/cmd_vel')
    pause, boolean = probe.talk('std_msgs/msg/Bool', '/sim_node/pause')
    reset, _ = probe.talk('std_msgs/msg/Bool', '/sim_node/reset')
    speed, number = probe.talk('std_msgs/msg/Float64', '/sim_node/speed')
    husky = start(publish_clock=True, start_paused=True, command_timeout=0.0)
    talkers = (command, pause, reset, speed)
    # Not by a message: the only one before the first step may come before readers are matched.
    assert probe.until(lambda: all(t.get_subscription_count() for t in talkers), 30.0), (
        husky.node.log())
    drives = []
    for factor in (1.0, 20.0, 0.0):
        pause.publish(boolean(data=True))
        probe.spin(0.2)
        joints.clear()

        def rewound() -> bool:
            # Again: the one message of a reset is lost where our reader is not matched yet.
            reset.publish(boolean(data=True))
            probe.spin(0.1)
            return bool(joints and stamp(joints[-1]) == 0)
        assert probe.until(rewound)
        # At first the stamp is 0 anyway: a reset that came after the command would undo it.
        probe.spin(0.5)
        message = kind()
        message.linear.x, message.angular.z = 0.6, 0.7
        command.publish(message)
        speed.publish(number(data=factor))
        probe.spin(0.3)
        joints.clear()
        clock.clear()
        pause.publish(boolean(data=False))
        assert probe.until(lambda: joints and stamp(joints[-1]) >= 2_000_000_000)
        times = [m.clock.sec * 10**9 + m.clock.nanosec for m in clock]
        assert len(times) > 40
        assert all(b > a for a, b in itertools.pairwise(times))
        drives.append({stamp(m): (tuple(m.position), tuple(m.velocity)) for m in joints})
    pause.publish(boolean(data=True))
    common = set(drives[0]) & set(drives[1]) & set(drives[2])
    assert len([s for s in common if s <= 2_000_000_000]) > 50
    for moment in common:
        assert drives[0][moment] == drives[1][moment] == drives[2][moment]
    assert all(s % 20_000_000 == 0 for s in drives[0])


def test_a_parameter_file_and_the_command_line(probe: Probe, start: Start, tmp_path: Path) -> None:
    """Files and -p are taken, whole numbers count as decimals, the command line wins (row 57)."""
    path = write_parameters(tmp_path / 'p.yaml', '/**', {
        'robot_description': '<robot/>', 'rate': 25, 'initial_x': 4.0, 'odom_frame': 'world',
        'ground_truth_topic': '/from_file'})
    truth = probe.listen('nav_msgs/msg/Odometry', '/from_file')
    husky = start(('--params-file', str(path)), initial_x=5)
    husky.ready(truth)
    assert probe.until(lambda: len(truth) > 5)
    assert truth[-1].header.frame_id == 'world'
    assert truth[-1].pose.pose.position.x == 5.0
    assert stamp(truth[-1]) - stamp(truth[-2]) == pytest.approx(40_000_000, abs=1)


MISTAKES = (
    (['--', '--rate', '3'], "unknown argument '--rate': parameters go after --ros-args -p"),
    (['--', 'rate:=3'], "unknown argument 'rate:=3'"),
    (['--rate', '3'], "unknown ROS argument '--rate'"),
    (['-p', 'rate:=5000.0'], 'rate = 5000.0 is not allowed: from 1 to 1000 Hz'),
    (['-p', 'rate:=.nan'], 'rate = nan is not allowed: from 1 to 1000 Hz'),
    (['-p', 'preset:=rover'], 'one of paper, husky_ros1, clearpath_jazzy'),
    (['-p', 'joint_names:=[a, b]'], 'of four different names'),
    (['-p', 'model:=/no/such/file.yaml'], "model = '/no/such/file.yaml' cannot be used"),
    (['-p', 'imu_rate:=30.0'], 'imu_rate = 30 Hz must be rate = 50 Hz divided by'),
    (['-p', 'publish_tf:=1'], 'publish_tf = 1 is int, not bool'),
    (['-p', 'ground_truth_topic:=odom', '-p', 'odometry_topic:=/odom'],
     'odometry_topic and ground_truth_topic are both /odom: each needs a topic of its own'),
    (['-r', '/husky_velocity_controller/cmd_vel:=joint_states'],
     'joint_states_topic and command_topic are both /joint_states'),
    (['--params-file', '/no/such.yaml'], '/no/such.yaml'),
)


def test_mistakes_end_with_one_line_and_exit_code_one(probe: Probe) -> None:
    """T17: the message names the thing, its value and what is allowed; no traceback."""
    program = ('import json, sys\n'
               'from lg_husky_sim.ros.sim_node import main\n'
               'for words in json.loads(sys.argv[1]):\n'
               "    print('exit', main(['sim_node', '--ros-args', *words]), flush=True)")
    told = subprocess.run(
        [sys.executable, '-c', program, json.dumps([words for words, _ in MISTAKES])],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60.0, check=True)
    parts = told.stdout.split('exit 1\n')
    assert len(parts) == len(MISTAKES) + 1
    for part, (_, text) in zip(parts, MISTAKES, strict=False):
        lines = [line for line in part.splitlines() if line.startswith('error: ')]
        assert len(lines) == 1
        assert text in lines[0]
        assert '.c:' not in lines[0], 'the source of rcl is nothing to a user'
        assert 'Traceback' not in part


def test_a_mistake_ends_the_process_with_exit_code_one(probe: Probe) -> None:
    """The exit code reaches the shell."""
    node = NodeProcess({'speed': -2.0})
    assert node.process.wait(30.0) == 1


@pytest.mark.parametrize(('number', 'after'), [
    (signal.SIGINT, 0.0), (signal.SIGTERM, 0.1), (signal.SIGINT, 0.5), (signal.SIGTERM, 2.0)])
def test_signals_end_the_node_cleanly_at_any_moment(
        probe: Probe, number: signal.Signals, after: float) -> None:
    """Ctrl-C and SIGTERM while importing, starting and running: exit code 0, no traceback."""
    node = NodeProcess()
    assert probe.until(lambda: caught(node, signal.SIGTERM))
    time.sleep(after)
    assert node.stop(number) == 0, node.log()
    assert 'Traceback' not in node.log()


def test_a_stopped_process_loses_and_invents_no_step(probe: Probe, start: Start) -> None:
    """T18: after a second's stop every step is made up: stamps stay a period apart."""
    truth = probe.listen('nav_msgs/msg/Odometry', '/steady', 1000)
    husky = start(ground_truth_topic='/steady')
    husky.ready(truth)
    assert probe.until(lambda: len(truth) > 30)
    truth.clear()
    begun = time.monotonic()
    husky.node.process.send_signal(signal.SIGSTOP)
    probe.spin(1.0)
    husky.node.process.send_signal(signal.SIGCONT)

    def made_up() -> bool:
        return len(truth) == pytest.approx((time.monotonic() - begun) * 50.0, abs=4)
    # A loaded machine needs longer; none is too many at any time after.
    assert probe.until(made_up, 30.0), len(truth)
    probe.spin(1.0)
    assert len(truth) < (time.monotonic() - begun) * 50.0 + 4
    stamps = [stamp(m) for m in truth]
    assert all(b - a in range(19_999_999, 20_000_002)
               for a, b in itertools.pairwise(stamps))


@pytest.mark.parametrize('speed', [0.2, 5.0])
def test_speed_changes_live(probe: Probe, start: Start, speed: float) -> None:
    """T10: the factor changes the steps per second, and wall-clock stamps follow."""
    truth = probe.listen('nav_msgs/msg/Odometry', '/paced', 5000)
    # Slow enough for a loaded machine also at five times the speed.
    husky = start(ground_truth_topic='/paced', rate=10.0)
    husky.ready(truth)
    factor, kind = probe.talk('std_msgs/msg/Float64', '/sim_node/speed')
    assert probe.until(factor.get_subscription_count)
    factor.publish(kind(data=speed))
    probe.spin(0.5)
    truth.clear()
    begun = time.monotonic()

    def kept() -> bool:
        # What is late is made up.
        passed = time.monotonic() - begun
        return passed >= 2.0 and len(truth) == pytest.approx(10.0 * speed * passed, rel=0.1)
    assert probe.until(kept, 30.0), len(truth) / (time.monotonic() - begun)
    stamps = [stamp(message) for message in truth]
    assert abs(time.time() - stamps[-1] * 1e-9) < 0.1 / speed + 0.5
    assert [b - a for a, b in itertools.pairwise(stamps)] == pytest.approx(
        [100_000_000 / speed] * (len(stamps) - 1), abs=1.0)


def test_the_first_log_line_names_the_backend(probe: Probe, start: Start) -> None:
    """A user sees at once which middleware, domain and range the node is in."""
    odom = probe.listen('nav_msgs/msg/Odometry', '/named/odom')
    husky = start(odometry_topic='/named/odom')
    husky.ready(odom)
    line = next(x for x in husky.node.log().splitlines() if '[INFO]' in x)
    assert 'rclpy over rmw_' in line if api.HAVE_RCLPY else 'embedded DDS' in line
    assert 'discovery range LOCALHOST' in line


@pytest.mark.parametrize('given', [True, False])
def test_the_log_names_the_model_that_runs(
        probe: Probe, start: Start, tmp_path: Path, given: bool) -> None:
    """With a model file the log said `running with preset paper`, and nothing of the file."""
    from lg_husky_sim import Husky
    path, topic = tmp_path / 'mine.yaml', f'/named_{given}/odom'
    Husky().save(str(path))
    husky = start(odometry_topic=topic, **({'model': path} if given else {}))
    husky.ready(probe.listen('nav_msgs/msg/Odometry', topic))
    assert probe.until(lambda: 'running with' in husky.node.log())
    said = f'preset paper and model {path} at' if given else 'preset paper at'
    assert f'running with {said} 50 Hz, ' in husky.node.log()


def test_a_changed_model_file_runs_on_without_a_jump(
        probe: Probe, start: Start, tmp_path: Path) -> None:
    """A model file is loaded live: the pose goes on, the behaviour changes; bad files do not."""
    from lg_husky_sim.husky.model_file import default_model_path
    slow = tmp_path / 'slow.yaml'
    text = default_model_path().read_text(encoding='utf-8')
    place = text.index('  command_gain:')
    value = text[text.index('value: ', place):].split()[1]
    gain = float(value)
    slow.write_text(text[:place] + text[place:].replace(
        f'value: {value}', f'value: {0.8 * gain}', 1), encoding='utf-8')
    truth = probe.listen('nav_msgs/msg/Odometry', '/swap', 100)
    log = probe.listen('rcl_interfaces/msg/Log', '/rosout', 100)
    command, kind = probe.talk('geometry_msgs/msg/Twist', '/swap_cmd')
    load, string = probe.talk('std_msgs/msg/String', '/sim_node/load_model')
    husky = start(ground_truth_topic='/swap', command_topic='/swap_cmd', command_timeout=0.0)
    husky.ready(truth)
    assert probe.until(
        lambda: command.get_subscription_count() and load.get_subscription_count())
    message = kind()
    message.linear.x = 0.5
    command.publish(message)
    assert probe.until(lambda: truth[-1].twist.twist.linear.x > 0.5065)
    truth.clear()
    load.publish(string(data=str(tmp_path / 'none.yaml')))
    assert probe.until(lambda: any('cannot be used' in m.msg for m in log), 5.0)
    load.publish(string(data=str(slow)))
    assert probe.until(lambda: truth and truth[-1].twist.twist.linear.x < 0.81 * 0.5065)
    drive = [(stamp(m) * 1e-9, m.pose.pose.position.x, m.twist.twist.linear.x) for m in truth]
    assert len(drive) > 5
    for (t0, x0, v0), (t1, x1, v1) in itertools.pairwise(drive):
        # No further in a step than at the larger of its speeds, no less than at the smaller.
        assert (t1 - t0) * min(v0, v1) - 1e-6 <= x1 - x0 <= (t1 - t0) * max(v0, v1) + 1e-6
    assert math.isclose(truth[-1].twist.twist.linear.x, 0.8 * 0.5065, rel_tol=0.02)


@pytest.mark.parametrize('ratio', [1.04, 1.0, 1.0 / 1.04])
def test_a_model_of_uneven_sides_drives_a_curve(
        probe: Probe, start: Start, tmp_path: Path, ratio: float) -> None:
    """A node that is started with such a file goes to its weaker side, told to go straight on."""
    path = tmp_path / 'uneven.yaml'
    Husky().replacing(side_gain_ratio=ratio).save(str(path))
    truth = probe.listen('nav_msgs/msg/Odometry', '/uneven', 100)
    command, kind = probe.talk('geometry_msgs/msg/Twist', '/uneven_cmd')
    husky = start(model=str(path), ground_truth_topic='/uneven', command_topic='/uneven_cmd',
                  command_timeout=0.0, speed=4.0)
    husky.ready(truth)
    assert probe.until(lambda: command.get_subscription_count())
    message = kind()
    message.linear.x = 1.0
    command.publish(message)
    assert probe.until(lambda: truth[-1].pose.pose.position.x > 4.0)
    pose = truth[-1].pose.pose
    heading = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
    # 0.215 rad after 5.8 m by the simulation at 0.96 m/s; more of it the later it is looked at.
    assert (heading, pose.position.y) == (
        (0.0, 0.0) if ratio == 1.0 else (pytest.approx(-math.copysign(
            0.215 / 5.8, ratio - 1.0) * pose.position.x, rel=0.15),
            pytest.approx(0.5 * heading * pose.position.x, rel=0.15)))


def test_settings_of_the_presets_differ_together() -> None:
    """T7: names, types, limits, frames and covariances change with the preset."""
    paper, ros1, jazzy = (make_settings(preset=p) for p in (
        'paper', 'husky_ros1', 'clearpath_jazzy'))
    assert (paper.imu_topic, ros1.imu_topic, jazzy.imu_topic) == (
        'imu_um7/data', 'imu/data', 'sensors/imu_0/data')
    assert (ros1.max_yaw, jazzy.max_yaw, paper.max_yaw) == (2.0, 1.0, 0.0)
    assert (ros1.command_timeout, jazzy.command_timeout) == (0.25, 0.5)
    assert (ros1.wheel_separation, jazzy.wheel_separation) == (0.5708, 0.555)
    assert jazzy.command_type == 'TwistStamped'
    assert ros1.odometry_covariance[5] == 0.03
    assert jazzy.odometry_covariance[5] == 0.01
