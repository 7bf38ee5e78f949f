# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a running node owes its graph; one node for all tests, targets T1-T5, T9-T15, T18."""

from __future__ import annotations

from collections.abc import Iterator
import itertools
import math
import time
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest

COMMAND = '/husky_velocity_controller/cmd_vel'
PERIOD_NS = 20_000_000


def nanoseconds(message: Any) -> int:
    """Return the header's stamp [ns]."""
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


class Graph:
    """The node under test and everything that it says."""

    def __init__(self, probe: Probe) -> None:
        """Listen first, then start the node."""
        self.probe = probe
        self.odom = probe.listen('nav_msgs/msg/Odometry', '/husky_velocity_controller/odom')
        self.truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth')
        self.joints = probe.listen('sensor_msgs/msg/JointState', '/joint_states')
        self.imu = probe.listen('sensor_msgs/msg/Imu', '/imu_um7/data')
        # The node runs without tf2_msgs, which is not in common_interfaces.
        self.has_tf = api.message_type('tf2_msgs/msg/TFMessage') is not None
        self.tf = probe.listen('tf2_msgs/msg/TFMessage', '/tf', 100) if self.has_tf else []
        self.log = probe.listen('rcl_interfaces/msg/Log', '/rosout', 100)
        self.diagnostics = probe.listen('diagnostic_msgs/msg/DiagnosticArray', '/diagnostics')
        self.battery = probe.listen('sensor_msgs/msg/BatteryState', '/battery_state')
        self.command, self.twist = probe.talk('geometry_msgs/msg/Twist', COMMAND)
        self.pause, self.bool = probe.talk('std_msgs/msg/Bool', '/sim_node/pause')
        self.reset, _ = probe.talk('std_msgs/msg/Bool', '/sim_node/reset')
        self.step, self.uint = probe.talk('std_msgs/msg/UInt32', '/sim_node/step')
        self.speed, self.float = probe.talk('std_msgs/msg/Float64', '/sim_node/speed')
        self.pose, self.pose_type = probe.talk(
            'geometry_msgs/msg/PoseWithCovarianceStamped', '/initialpose')
        self.husky = LiveHusky(probe)

    def ready(self) -> None:
        """Wait until the node hears and is heard."""
        self.husky.ready(self.odom)
        talkers = (self.command, self.pause, self.reset, self.step, self.speed, self.pose)
        assert self.probe.until(lambda: all(t.get_subscription_count() for t in talkers))
        assert self.probe.until(lambda: len(self.odom) > 5)

    def send(self, forward: float, yaw: float, seconds: float = 0.0) -> None:
        """Send a command once, or at 20 Hz for some time."""
        message = self.twist()
        message.linear.x, message.angular.z = forward, yaw
        end = time.monotonic() + seconds
        self.command.publish(message)
        while time.monotonic() < end:
            self.probe.spin(0.05)
            self.command.publish(message)

    def fresh(self, received: list[Any], count: int = 1) -> list[Any]:
        """Return the next messages of a list."""
        received.clear()
        assert self.probe.until(lambda: len(received) >= count), self.husky.node.log()
        return received

    def said(self, text: str) -> bool:
        """Wait for a log line."""
        return self.probe.until(lambda: any(text in line.msg for line in self.log), 5.0)


@pytest.fixture(scope='module')
def graph(probe: Probe) -> Iterator[Graph]:
    """Start one node for the module; its exit code is checked at the end."""
    one = Graph(probe)
    try:
        one.ready()
        yield one
    finally:
        code = one.husky.node.stop()
    assert code == 0, one.husky.node.log()


@pytest.fixture(autouse=True)
def at_rest(graph: Graph) -> None:
    """Begin each test unpaused, at speed 1, at rest in the origin."""
    graph.speed.publish(graph.float(data=1.0))
    graph.pause.publish(graph.bool(data=False))
    graph.reset.publish(graph.bool(data=False))
    graph.log.clear()

    def rests() -> bool:
        last = graph.fresh(graph.truth)[-1]
        return bool(abs(last.twist.twist.linear.x) < 1e-6
                    and last.pose.pose.position.x == 0.0)
    assert graph.probe.until(rests)


def test_odometry_is_steady_and_complete(graph: Graph) -> None:
    """T2: 50 Hz within 2 %, idle as well; frames, child-frame twist, covariances."""
    graph.fresh(graph.odom)
    begun, count = time.monotonic(), len(graph.odom)
    assert graph.probe.until(lambda: len(graph.odom) >= count + 150)
    rate = (len(graph.odom) - count) / (time.monotonic() - begun)
    assert 49.0 <= rate <= 51.0
    stamps = [nanoseconds(m) for m in graph.odom]
    assert all(abs(b - a - PERIOD_NS) <= 1 for a, b in itertools.pairwise(stamps))
    last = graph.odom[-1]
    assert (last.header.frame_id, last.child_frame_id) == ('odom', 'base_link')
    for covariance in (last.pose.covariance, last.twist.covariance):
        assert [covariance[7 * i] for i in range(6)] == [0.001] * 5 + [0.03]
        assert math.fsum(covariance) == pytest.approx(0.035)
    assert abs(time.time() - stamps[-1] * 1e-9) < 0.5


def test_a_command_moves_the_robot_and_silence_lets_it_coast(graph: Graph) -> None:
    """T1, T5: Twist in; after 0.25 s without one, the voltage is zero and the model coasts."""
    graph.send(0.5, 0.0, 1.5)
    moving = graph.fresh(graph.truth)[-1]
    assert moving.twist.twist.linear.x == pytest.approx(0.507, abs=0.01)
    assert moving.pose.pose.position.x > 0.3
    assert abs(moving.pose.pose.position.y) < 1e-9
    graph.truth.clear()
    assert graph.probe.until(lambda: graph.truth and graph.truth[-1].twist.twist.linear.x < 0.01)
    speeds = [m.twist.twist.linear.x for m in graph.truth]
    held = sum(1 for v in speeds if v > 0.5)
    assert 5 <= held <= 20
    falling = [v for v in speeds if 0.02 < v < 0.49]
    assert len(falling) > 10
    assert falling == sorted(falling, reverse=True)


def test_bad_numbers_are_refused_and_harm_nothing(graph: Graph) -> None:
    """T1: NaN and infinity are refused with a throttled warning; the state stays finite."""
    for bad in (math.nan, math.inf, -math.inf):
        for _ in range(20):
            graph.send(bad, 0.0)
            graph.send(0.1, bad)
    assert graph.said('refused: not finite')
    warnings = [m for m in graph.log if 'not finite' in m.msg]
    assert len(warnings) < 5
    last = graph.fresh(graph.truth, 5)[-1]
    assert (last.pose.pose.position.x, last.twist.twist.linear.x) == (0.0, 0.0)
    graph.send(1e308, -1e308, 0.2)
    last = graph.fresh(graph.truth, 5)[-1]
    assert math.isfinite(last.pose.pose.position.x)
    assert abs(last.twist.twist.angular.z) < 50.0


def test_wheel_angles_are_the_integral_of_their_rates(graph: Graph) -> None:
    """T3: four wheels in the preset's order, effort filled, angle = integral of rate."""
    graph.send(0.4, 0.3, 1.5)
    graph.joints.clear()
    graph.send(0.4, 0.3, 0.5)
    for message in graph.joints:
        assert list(message.name) == ['front_left_wheel', 'front_right_wheel',
                                      'rear_left_wheel', 'rear_right_wheel']
        assert message.position[0] == message.position[2]
        assert message.velocity[1] == message.velocity[3]
        assert all(math.isfinite(effort) for effort in message.effort)
    stamps = [nanoseconds(message) * 1e-9 for message in graph.joints]
    for wheel in range(4):
        rates = [message.velocity[wheel] for message in graph.joints]
        # By trapezia, which hold whenever a busy machine lets the command time out as well.
        area = sum(0.5 * (rates[i] + rates[i + 1]) * (stamps[i + 1] - stamps[i])
                   for i in range(len(rates) - 1))
        turned = graph.joints[-1].position[wheel] - graph.joints[0].position[wheel]
        assert turned == pytest.approx(area, rel=2e-3)


def test_imu_reads_gravity_turning_and_centripetal_force(graph: Graph) -> None:
    """T4: gyro z, a_y = v·omega, a_z = +9.81 (REP-145), covariances set."""
    graph.send(0.5, 0.4, 2.0)
    graph.imu.clear()
    graph.truth.clear()
    graph.send(0.5, 0.4, 0.3)
    truth = {nanoseconds(m): m for m in graph.truth}
    pairs = [(m, truth[nanoseconds(m)]) for m in graph.imu if nanoseconds(m) in truth]
    assert len(pairs) > 5
    for message, true in pairs:
        v, w = true.twist.twist.linear.x, true.twist.twist.angular.z
        assert message.header.frame_id == 'imu_link'
        assert message.angular_velocity.z == w
        assert message.linear_acceleration.y == pytest.approx(v * w, rel=1e-12)
        assert message.linear_acceleration.z == 9.81
        assert message.angular_velocity_covariance[8] == pytest.approx(1e-4)
        assert message.linear_acceleration_covariance[0] == pytest.approx(1e-2)
        assert message.orientation.z == true.pose.pose.orientation.z


def test_all_messages_of_a_step_carry_one_stamp(graph: Graph) -> None:
    """T9: every step's odometry, truth, joints, IMU and /tf have the same stamp."""
    graph.probe.spin(0.1)
    lists = (graph.odom, graph.truth, graph.joints, graph.imu)
    for received in lists:
        received.clear()
    graph.tf.clear()
    assert graph.probe.until(lambda: all(len(r) > 30 for r in lists)
                             and (len(graph.tf) > 30 or not graph.has_tf))
    common = [{nanoseconds(m) for m in received} for received in lists]
    if graph.has_tf:
        common.append({nanoseconds(m.transforms[0]) for m in graph.tf})
    shared = set.intersection(*common)
    assert len(shared) > 25
    assert len(set.union(*common)) <= len(shared) + 5
    if graph.has_tf:
        transform = graph.tf[-1].transforms[0]
        assert (transform.header.frame_id, transform.child_frame_id) == ('odom', 'base_link')


def test_wheel_odometry_differs_from_the_truth_by_slip(graph: Graph) -> None:
    """T14: on a turn the controller's odometry (multiplier 1.875) and the truth part."""
    graph.send(0.3, 0.8, 2.0)
    graph.truth.clear()
    graph.odom.clear()
    graph.send(0.3, 0.8, 0.3)
    truth = {nanoseconds(m): m for m in graph.truth}
    wheels, true = next((m, truth[nanoseconds(m)]) for m in reversed(graph.odom)
                        if nanoseconds(m) in truth)
    joint = min(graph.joints, key=lambda m: abs(nanoseconds(m) - nanoseconds(wheels)))
    left, right = joint.velocity[0], joint.velocity[1]
    expected = 0.1651 * (right - left) / (0.5708 * 1.875)
    assert wheels.twist.twist.angular.z == pytest.approx(expected, rel=1e-3)
    assert true.twist.twist.angular.z > 1.01 * wheels.twist.twist.angular.z


def test_pause_step_and_resume_by_topic(graph: Graph) -> None:
    """T11: paused, nothing moves; N steps are N messages; a step while running is refused."""
    graph.pause.publish(graph.bool(data=True))
    graph.probe.spin(0.2)
    graph.truth.clear()
    graph.probe.spin(0.2)
    assert graph.truth == []
    graph.step.publish(graph.uint(data=7))
    assert graph.probe.until(lambda: len(graph.truth) == 7)
    graph.probe.spin(0.1)
    assert len(graph.truth) == 7
    stamps = [nanoseconds(m) for m in graph.truth]
    assert all(abs(b - a - PERIOD_NS) <= 1 for a, b in itertools.pairwise(stamps))
    graph.step.publish(graph.uint(data=0))
    assert graph.said('step = 0 refused')
    graph.pause.publish(graph.bool(data=False))
    assert len(graph.fresh(graph.truth, 3)) >= 3
    graph.step.publish(graph.uint(data=1))
    assert graph.said('not paused')


def test_reset_is_followed_by_odometry_at_once(graph: Graph) -> None:
    """T12: after a reset the odometry goes on within two periods, from the initial pose."""
    graph.send(0.5, 0.5, 0.6)
    before = graph.fresh(graph.odom)[-1]
    assert before.pose.pose.position.x > 0.05
    graph.reset.publish(graph.bool(data=False))
    graph.odom.clear()
    assert graph.probe.until(
        lambda: any(m.pose.pose.position.x < 0.01 for m in graph.odom), 5.0)
    place = next(i for i, m in enumerate(graph.odom) if m.pose.pose.position.x < 0.01)
    previous = graph.odom[place - 1] if place else before
    assert nanoseconds(graph.odom[place]) - nanoseconds(previous) <= 2 * PERIOD_NS + 2
    assert graph.fresh(graph.joints)[-1].position[0] == 0.0


def test_initial_pose_moves_the_robot(graph: Graph) -> None:
    """T13: /initialpose sets pose and odometry; wrong frames and NaN are refused."""
    message = graph.pose_type()
    message.header.frame_id = 'odom'
    message.pose.pose.position.x, message.pose.pose.position.y = 3.0, -2.0
    message.pose.pose.orientation.z = math.sin(0.5)
    message.pose.pose.orientation.w = math.cos(0.5)

    def moved() -> bool:
        # Asked again: a reset of the test before that is still on its way undoes the first.
        graph.pose.publish(message)
        return bool(graph.fresh(graph.odom)[-1].pose.pose.position.x == 3.0)
    assert graph.probe.until(moved)
    last = graph.fresh(graph.truth)[-1].pose.pose
    assert (last.position.x, last.position.y) == (3.0, -2.0)
    assert last.orientation.z == pytest.approx(math.sin(0.5), abs=1e-15)
    message.header.frame_id = 'somewhere'
    message.pose.pose.position.x = 9.0
    graph.pose.publish(message)
    assert graph.said("frame 'somewhere'")
    message.header.frame_id = ''
    message.pose.pose.position.x = math.nan
    graph.pose.publish(message)
    assert graph.said('initial pose refused')
    assert graph.fresh(graph.truth)[-1].pose.pose.position.x == 3.0


def test_a_speed_that_is_not_allowed_is_refused(graph: Graph) -> None:
    """The line names the value and what is allowed."""
    graph.speed.publish(graph.float(data=-1.0))
    assert graph.said('speed = -1.0 is not allowed: from 0 to 1000')


def test_sensor_data_readers_and_reliable_readers_match(graph: Graph) -> None:
    """T15: best-effort readers (rviz2, robot_localization) and reliable ones get everything."""
    best = graph.probe.listen(
        'nav_msgs/msg/Odometry', '/ground_truth', api.qos_profile_sensor_data)
    deep = graph.probe.listen('sensor_msgs/msg/Imu', '/imu_um7/data', api.QoSProfile(
        depth=10, reliability=api.ReliabilityPolicy.RELIABLE))
    assert graph.probe.until(lambda: len(best) > 20 and len(deep) > 20)
    one, message = graph.probe.talk(
        'geometry_msgs/msg/Twist', COMMAND, api.QoSProfile(
            depth=1, reliability=api.ReliabilityPolicy.RELIABLE))
    assert graph.probe.until(lambda: one.get_subscription_count() == 1)
    wanted = message()
    wanted.linear.x = 0.5
    one.publish(wanted)
    assert graph.probe.until(lambda: graph.truth[-1].twist.twist.linear.x > 0.01)


def test_diagnostics_say_rate_and_lateness(graph: Graph) -> None:
    """T18: achieved rate, late steps and real-time factor once a second."""
    graph.diagnostics.clear()
    assert graph.probe.until(lambda: len(graph.diagnostics) >= 3, 10.0)
    status = graph.diagnostics[-1].status[0]
    values = {pair.key: pair.value for pair in status.values}
    assert status.name == 'sim_node: simulation'
    assert float(values['steps per second']) == pytest.approx(50.0, abs=3.0)
    assert float(values['real-time factor']) == pytest.approx(1.0, abs=0.06)
    assert int(values['late steps, all']) >= 0
    assert int(values['steps, all']) > 50


def test_battery_state(graph: Graph) -> None:
    """Battery voltage and current, drawn while driving."""
    graph.battery.clear()
    graph.send(0.0, 1.0, 2.2)
    assert graph.probe.until(lambda: graph.battery)
    last = graph.battery[-1]
    assert last.voltage == pytest.approx(24.0)
    assert last.current < 0.0
    assert math.isnan(last.percentage)
