# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Messages to values and back; no node, no clock.

Outgoing messages are made once with all that stays the same (frames, names, covariances) and
filled anew at each step: publishing copies them, and building them costs more than sending.
"""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from lg_husky_sim.ros.api import message_type
from lg_husky_sim.ros.engine import Reading
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.signals import BodyTwist, Pose

_SECOND = 1_000_000_000
#: Variance of what is known exactly; not zero, since filters invert covariances.
_EXACT = 1e-9
#: sensor_msgs/msg/BatteryState: POWER_SUPPLY_STATUS_DISCHARGING.
_DISCHARGING = 2


def twist_from_msg(msg: Any) -> BodyTwist:
    """
    Read a geometry_msgs/msg/Twist; what a skid-steer robot cannot do is dropped.

    Parameters
    ----------
    msg : geometry_msgs.msg.Twist
        As received.

    Returns
    -------
    BodyTwist
        Not checked: it may hold NaN.

    """
    return BodyTwist(float(msg.linear.x), float(msg.angular.z))


def pose_from_msg(msg: Any) -> Pose:
    """
    Read a geometry_msgs/msg/Pose in the plane.

    Parameters
    ----------
    msg : geometry_msgs.msg.Pose
        As received.

    Returns
    -------
    Pose
        Not checked; the quaternion need not be of unit length.

    """
    q = msg.orientation
    heading = math.atan2(2.0 * (q.w * q.z + q.x * q.y),
                         q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z)
    return Pose(float(msg.position.x), float(msg.position.y), heading)


def stamp_nanoseconds(stamp: Any) -> int:
    """Return a builtin_interfaces/msg/Time in nanoseconds."""
    return int(stamp.sec) * _SECOND + int(stamp.nanosec)


def set_stamp(stamp: Any, nanoseconds: int) -> None:
    """Put nanoseconds into a builtin_interfaces/msg/Time."""
    stamp.sec, stamp.nanosec = divmod(nanoseconds, _SECOND)


def set_heading(orientation: Any, heading: float) -> None:
    """Put a heading [rad] into a geometry_msgs/msg/Quaternion."""
    orientation.z = math.sin(0.5 * heading)
    orientation.w = math.cos(0.5 * heading)


def diagonal(values: Sequence[float]) -> list[float]:
    """Return a row-major square matrix with the given diagonal."""
    size = len(values)
    return [values[i] if i == j else 0.0 for i in range(size) for j in range(size)]


def odometry_message(settings: Settings, *, truth: bool) -> Any:
    """
    Return a nav_msgs/msg/Odometry with frames and covariances.

    Parameters
    ----------
    settings : Settings
        Frames and covariances.
    truth : bool
        Whether it will hold the model's truth, which is exact.

    """
    message = message_type('nav_msgs/msg/Odometry')()
    message.header.frame_id = settings.odom_frame
    message.child_frame_id = settings.base_frame
    values = [_EXACT] * 6 if truth else settings.odometry_covariance
    message.pose.covariance = diagonal(values)
    message.twist.covariance = diagonal(values)
    return message


def fill_odometry(message: Any, nanoseconds: int, pose: Pose, twist: BodyTwist) -> None:
    """
    Put pose (in the header's frame) and twist (in the child frame) into an Odometry.

    Parameters
    ----------
    message : nav_msgs.msg.Odometry
        Changed in place.
    nanoseconds : int
        Stamp.
    pose : Pose
        In the frame of the header.
    twist : BodyTwist
        In the child frame.

    """
    set_stamp(message.header.stamp, nanoseconds)
    position = message.pose.pose.position
    position.x, position.y = pose.x, pose.y
    set_heading(message.pose.pose.orientation, pose.heading)
    message.twist.twist.linear.x = twist.forward
    message.twist.twist.angular.z = twist.yaw


def joint_state_message(settings: Settings) -> Any:
    """Return a sensor_msgs/msg/JointState with the wheels' names."""
    message = message_type('sensor_msgs/msg/JointState')()
    message.header.frame_id = settings.base_frame
    message.name = list(settings.joint_names)
    return message


def fill_joint_state(message: Any, nanoseconds: int, reading: Reading) -> None:
    """
    Put the wheels into a JointState: front left, front right, rear left, rear right.

    Parameters
    ----------
    message : sensor_msgs.msg.JointState
        Changed in place.
    nanoseconds : int
        Stamp.
    reading : Reading
        Both wheels of a side turn alike and share its torque.

    """
    set_stamp(message.header.stamp, nanoseconds)
    message.position = [*reading.measured.wheel_angles] * 2
    message.velocity = [*reading.measured.wheel_rates] * 2
    message.effort = [*reading.torques] * 2


def imu_message(settings: Settings) -> Any:
    """Return a sensor_msgs/msg/Imu with its frame and covariances."""
    message = message_type('sensor_msgs/msg/Imu')()
    message.header.frame_id = settings.imu_frame
    message.orientation_covariance = diagonal([settings.orientation_stddev ** 2] * 3)
    message.angular_velocity_covariance = diagonal([settings.gyro_stddev ** 2] * 3)
    message.linear_acceleration_covariance = diagonal([settings.accel_stddev ** 2] * 3)
    return message


def fill_imu(message: Any, nanoseconds: int, reading: Reading) -> None:
    """
    Put gyro, accelerometer and orientation into an Imu (REP-145).

    Parameters
    ----------
    message : sensor_msgs.msg.Imu
        Changed in place.
    nanoseconds : int
        Stamp.
    reading : Reading
        Of the step.

    """
    set_stamp(message.header.stamp, nanoseconds)
    measured = reading.measured
    set_heading(message.orientation, measured.heading)
    message.angular_velocity.z = measured.gyro
    accel = message.linear_acceleration
    accel.x, accel.y, accel.z = measured.accel


def transform_message(parent: str, child: str, count: int = 1) -> Any:
    """Return a TFMessage with a transform between frames, some times, or None without tf2_msgs."""
    kind = message_type('tf2_msgs/msg/TFMessage')
    if kind is None:
        return None
    transforms = [message_type('geometry_msgs/msg/TransformStamped')() for _ in range(count)]
    for transform in transforms:
        transform.header.frame_id = parent
        transform.child_frame_id = child
    return kind(transforms=transforms)


def fill_transform(message: Any, nanoseconds: int, pose: Pose, index: int = 0) -> None:
    """Put the child's pose into one transform of a TFMessage."""
    transform = message.transforms[index]
    set_stamp(transform.header.stamp, nanoseconds)
    place = transform.transform.translation
    place.x, place.y = pose.x, pose.y
    set_heading(transform.transform.rotation, pose.heading)


def scan_message(settings: Settings) -> Any:
    """Return a sensor_msgs/msg/LaserScan with all but stamp and ranges."""
    message = message_type('sensor_msgs/msg/LaserScan')()
    message.header.frame_id = settings.scan_frame
    message.angle_min, message.angle_max = settings.scan_angle_min, settings.scan_angle_max
    message.angle_increment = settings.scan_angle_increment
    message.scan_time = settings.every('scan_rate') * settings.period
    message.range_min, message.range_max = settings.scan_range_min, settings.scan_range_max
    return message


def battery_message(settings: Settings) -> Any:
    """Return a sensor_msgs/msg/BatteryState; what the model does not know is NaN."""
    message = message_type('sensor_msgs/msg/BatteryState')()
    message.header.frame_id = settings.base_frame
    for name in ('temperature', 'charge', 'capacity', 'design_capacity', 'percentage'):
        setattr(message, name, math.nan)
    message.power_supply_status = _DISCHARGING
    message.present = True
    return message


def fill_battery(message: Any, nanoseconds: int, reading: Reading) -> None:
    """Put voltage and current into a BatteryState."""
    set_stamp(message.header.stamp, nanoseconds)
    message.voltage = reading.voltage
    message.current = reading.current
