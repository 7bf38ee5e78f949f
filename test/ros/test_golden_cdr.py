# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The bytes and type hashes of ROS 2 Jazzy itself, against those of the backend at hand.

Under a sourced ROS 2 this file, run as a script, writes ``golden/jazzy_cdr.json`` from rclpy's
own serialiser and from the installed type descriptions.
"""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

from lg_husky_sim.ros import api
import pytest

GOLDEN = Path(__file__).parent / 'golden' / 'jazzy_cdr.json'
TYPES = (
    'nav_msgs/msg/Odometry', 'sensor_msgs/msg/JointState', 'sensor_msgs/msg/Imu',
    'geometry_msgs/msg/Twist', 'geometry_msgs/msg/TwistStamped', 'tf2_msgs/msg/TFMessage',
    'geometry_msgs/msg/PoseWithCovarianceStamped', 'sensor_msgs/msg/BatteryState',
    'rosgraph_msgs/msg/Clock', 'diagnostic_msgs/msg/DiagnosticArray', 'std_msgs/msg/Bool',
    'std_msgs/msg/String', 'std_msgs/msg/UInt32', 'std_msgs/msg/Float64',
    'rcl_interfaces/msg/Log', 'rcl_interfaces/msg/ParameterEvent',
    'rcl_interfaces/msg/ParameterDescriptor', 'rmw_dds_common/msg/ParticipantEntitiesInfo')
SERVICE_PARTS = tuple(
    f'{name}_{part}' for name in (
        'std_srvs/srv/Trigger', 'std_srvs/srv/SetBool', 'rcl_interfaces/srv/GetParameters',
        'rcl_interfaces/srv/GetParameterTypes', 'rcl_interfaces/srv/SetParameters',
        'rcl_interfaces/srv/SetParametersAtomically', 'rcl_interfaces/srv/ListParameters',
        'rcl_interfaces/srv/DescribeParameters')
    for part in ('Request', 'Response'))


def filled(name: str) -> Any:
    """Return a message whose fields are all different from zero where that matters."""
    message = api.message_type(name)()
    match name.rsplit('/', 1)[1]:
        case 'Odometry':
            message.header.stamp.sec, message.header.stamp.nanosec = 1_700_000_000, 999_999_999
            message.header.frame_id, message.child_frame_id = 'odom', 'base_link'
            message.pose.pose.position.x = 1.25
            message.pose.covariance = [0.5 * i for i in range(36)]
            message.twist.twist.angular.z = -0.125
            message.twist.covariance = [-1.0 * i for i in range(36)]
        case 'JointState':
            message.header.frame_id = 'a'
            message.name = ['front_left_wheel', 'x', '']
            message.position, message.velocity = [1.5, -2.5, 1e300], [0.1]
        case 'Imu':
            message.header.frame_id = 'imu_link'
            message.linear_acceleration.z = 9.81
            message.angular_velocity_covariance = [0.0625] * 9
        case 'TFMessage':
            transform = api.message_type('geometry_msgs/msg/TransformStamped')()
            transform.header.frame_id, transform.child_frame_id = 'odom', 'base_link'
            transform.transform.translation.y = 2.0
            message.transforms = [transform, transform]
        case 'BatteryState':
            message.voltage, message.present = 24.5, True
            message.cell_voltage, message.location = [1.5, 2.5, 3.5], 'bay'
        case 'Twist':
            message.linear.x, message.angular.z = 0.5, -0.25
        case 'TwistStamped':
            message.header.frame_id, message.twist.linear.x = 'base', 0.5
        case 'Clock':
            message.clock.sec, message.clock.nanosec = 12, 34
        case 'DiagnosticArray':
            status = api.message_type('diagnostic_msgs/msg/DiagnosticStatus')()
            status.name, status.message = 'n', 'some text'
            pair = api.message_type('diagnostic_msgs/msg/KeyValue')()
            pair.key, pair.value = 'ab', 'cde'
            status.values = [pair, pair]
            message.status = [status]
        case 'String':
            message.data = 'naïve'
        case 'UInt32':
            message.data = 4_000_000_000
        case 'Float64':
            message.data = -0.1
        case 'Bool':
            message.data = True
        case 'Log':
            message.level, message.name, message.line = 30, 'node', 7
        case 'ParameterDescriptor':
            limits = api.message_type('rcl_interfaces/msg/FloatingPointRange')()
            limits.from_value, limits.to_value = -1.0, 2.0
            message.name, message.floating_point_range = 'speed', [limits]
        case _:
            pass
    return message


@pytest.mark.skipif(api.HAVE_RCLPY, reason='Fast DDS leaves padding bytes as they were')
@pytest.mark.parametrize('name', TYPES)
def test_messages_have_the_bytes_of_ros(name: str) -> None:
    """A filled message serialises to the very bytes of rclpy (padding at the end aside)."""
    golden = bytes.fromhex(json.loads(GOLDEN.read_text(encoding='utf-8'))['cdr'][name])
    ours = api.serialised(filled(name))
    size = max(len(golden), len(ours))
    assert abs(len(golden) - len(ours)) < 4
    assert ours.ljust(size, b'\0') == golden.ljust(size, b'\0')


@pytest.mark.skipif(not api.HAVE_RCLPY, reason='needs the reader of rclpy')
@pytest.mark.parametrize('name', TYPES)
def test_rclpy_reads_the_golden_bytes(name: str) -> None:
    """What the embedded subset sends is what each middleware of ROS 2 reads."""
    from rclpy.serialization import deserialize_message
    golden = bytes.fromhex(json.loads(GOLDEN.read_text(encoding='utf-8'))['cdr'][name])
    read = deserialize_message(golden, api.message_type(name))
    assert str(read) == str(filled(name))


@pytest.mark.skipif(api.HAVE_RCLPY, reason='rclpy takes its hashes from the same files')
@pytest.mark.parametrize('name', TYPES + SERVICE_PARTS)
def test_types_have_the_hashes_of_ros(name: str) -> None:
    """The RIHS01 hash that the graph shows is that of the installed type description."""
    from lg_husky_sim.ros.embedded.definitions import register_service, type_hash
    if '/srv/' in name:
        register_service(name.rsplit('_', 1)[0])
    assert type_hash(name) == json.loads(GOLDEN.read_text(encoding='utf-8'))['hashes'][name]


def write_golden() -> None:
    """Write the file from the ROS 2 that is sourced."""
    packages = importlib.import_module('ament_index_python.packages')
    from rclpy.serialization import serialize_message
    hashes: dict[str, str] = {}
    for name in (*TYPES, *(part.rsplit('_', 1)[0] for part in SERVICE_PARTS)):
        package, middle, kind = name.split('/')
        share = Path(packages.get_package_share_directory(package))
        described = json.loads((share / middle / f'{kind}.json').read_text(encoding='utf-8'))
        hashes |= {row['type_name']: row['hash_string'] for row in described['type_hashes']}
    cdr = {name: bytes(serialize_message(filled(name))).hex() for name in TYPES}
    wanted = {name: hashes[name] for name in (*TYPES, *SERVICE_PARTS)}
    GOLDEN.parent.mkdir(exist_ok=True)
    GOLDEN.write_text(json.dumps({'cdr': cdr, 'hashes': wanted}, indent=1) + '\n',
                      encoding='utf-8')


if __name__ == '__main__':
    write_golden()
