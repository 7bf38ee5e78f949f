# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Message classes: defaults, checks, and CDR against the DDS library's own serialiser."""

from __future__ import annotations

from typing import Any

from lg_husky_sim.ros.embedded.idl import dds_type_name, struct_type
from lg_husky_sim.ros.embedded.messages import deserialise, message_class, serialise
import numpy as np
import pytest

NAMES = ('nav_msgs/msg/Odometry', 'sensor_msgs/msg/JointState', 'sensor_msgs/msg/Imu',
         'rcl_interfaces/msg/ParameterEvent', 'rmw_dds_common/msg/ParticipantEntitiesInfo',
         'diagnostic_msgs/msg/DiagnosticArray', 'tf2_msgs/msg/TFMessage')


def made(name: str) -> Any:
    """Return a message of a type."""
    return message_class(name)()


def test_defaults_are_those_of_ros() -> None:
    """A quaternion is a rotation by nothing; numbers are zero; sequences empty."""
    pose = made('geometry_msgs/msg/Pose')
    assert (pose.orientation.w, pose.orientation.x, pose.position.x) == (1.0, 0.0, 0.0)
    imu = made('sensor_msgs/msg/Imu')
    assert imu.angular_velocity_covariance.shape == (9,)
    assert made('sensor_msgs/msg/JointState').name == []
    one, other = (made('std_msgs/msg/Header') for _ in range(2))
    assert one.stamp is not other.stamp


def test_constants_stand_on_the_class() -> None:
    """Constants of the definition are class attributes."""
    battery: Any = message_class('sensor_msgs/msg/BatteryState')
    assert battery.POWER_SUPPLY_STATUS_DISCHARGING == 2


def _fill(message: Any, random: np.random.Generator, depth: int = 0) -> None:
    for field in message._fields:
        value = getattr(message, field)
        if hasattr(value, '_fields'):
            _fill(value, random, depth + 1)
        elif isinstance(value, str):
            setattr(message, field, 'äb' * int(random.integers(0, 5)))
        elif isinstance(value, bool):
            setattr(message, field, bool(random.integers(2)))
        elif isinstance(value, int):
            setattr(message, field, int(random.integers(0, 100)))
        elif isinstance(value, float):
            setattr(message, field, float(random.normal()))
        elif isinstance(value, np.ndarray):
            size = value.size or int(random.integers(0, 6))
            setattr(message, field, random.integers(0, 100, size))
        elif value and hasattr(value[0], '_fields'):
            for item in value:
                _fill(item, random, depth + 1)


def _plain(message: Any, kind: Any) -> Any:
    # The same content in the DDS library's own classes.
    values = {}
    for field in message._fields:
        value = getattr(message, field)
        hint = kind.__annotations__[field]
        if hasattr(value, '_fields'):
            value = _plain(value, hint)
        elif isinstance(value, np.ndarray):
            value = value.tolist()
        elif isinstance(value, list) and value and hasattr(value[0], '_fields'):
            value = [_plain(item, struct_type(item.__msgtype__)) for item in value]
        values[field] = value
    return kind(**values)


@pytest.mark.parametrize('name', NAMES)
def test_bytes_agree_with_the_dds_librarys_own_serialiser(name: str) -> None:
    """A second implementation of CDR, on fifty random messages of each type."""
    random = np.random.default_rng(3)
    for _ in range(50):
        message = message_class(name)()
        _fill(message, random)
        for field, item in (('status', 'diagnostic_msgs/msg/DiagnosticStatus'),
                            ('transforms', 'geometry_msgs/msg/TransformStamped'),
                            ('new_parameters', 'rcl_interfaces/msg/Parameter'),
                            ('node_entities_info_seq', 'rmw_dds_common/msg/NodeEntitiesInfo')):
            if hasattr(message, field):
                items = [message_class(item)() for _ in range(int(random.integers(0, 3)))]
                for one in items:
                    _fill(one, random)
                setattr(message, field, items)
        ours = serialise(message)
        theirs = _plain(message, struct_type(name)).serialize(use_version_2=False)
        size = max(len(ours), len(theirs))
        assert ours.ljust(size, b'\0') == theirs.ljust(size, b'\0')
        assert deserialise(ours, name) == message


def test_big_endian_is_read() -> None:
    """A peer may send either byte order."""
    raw = bytes.fromhex('00000000' '3ff0000000000000')
    assert deserialise(raw, 'std_msgs/msg/Float64').data == 1.0  # type: ignore[attr-defined]


@pytest.mark.parametrize('raw', [b'', b'\0', b'\0\1\0\0', b'\7\7\7\7' + bytes(8),
                                 b'\0\1\0\0' + b'\xff' * 9])
def test_malformed_bytes_are_an_error_and_no_crash(raw: bytes) -> None:
    """Truncated or foreign samples raise, so that a subscription can drop them."""
    from rosbags.serde import SerdeError
    with pytest.raises(SerdeError):
        deserialise(raw, 'std_msgs/msg/String')


def test_wrong_values_name_the_field() -> None:
    """Wrong shapes fail when set, wrong types when sent; both say where."""
    imu = made('sensor_msgs/msg/Imu')
    with pytest.raises(ValueError, match='angular_velocity_covariance takes 9 numbers'):
        imu.angular_velocity_covariance = [0.0] * 8
    number = message_class('std_msgs/msg/Float64')(data='a')
    with pytest.raises(TypeError, match='std_msgs/msg/Float64 holds a value of the wrong type'):
        serialise(number)


def test_dds_type_names() -> None:
    """As rosidl mangles them."""
    assert dds_type_name('nav_msgs/msg/Odometry') == 'nav_msgs::msg::dds_::Odometry_'
