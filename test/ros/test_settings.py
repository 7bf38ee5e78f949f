# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of parameters: complete, checked, and the same in every file that repeats it."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from lg_husky_sim.api.robots import Husky
from lg_husky_sim.errors import SettingsError
from lg_husky_sim.resources import config_path
from lg_husky_sim.ros.settings import BY_NAME, make_settings, preset_values, Settings, TABLE
from lg_husky_sim.yaml_files import read_yaml
import pytest


def test_table_dataclass_and_presets_name_the_same_parameters() -> None:
    """A parameter cannot be in one and forgotten in another."""
    names = [setting.name for setting in TABLE]
    assert [field.name for field in fields(Settings)] == names
    for preset in BY_NAME['preset'].choices:
        assert set(preset_values(preset)) == set(names)
        assert make_settings(preset=preset).preset == preset


def test_every_topic_follows_the_namespace() -> None:
    """Row 55: with absolute topics two robots drove by one command, or by one click in RViz."""
    for preset in BY_NAME['preset'].choices:
        values = preset_values(preset)
        topics = {name: values[name] for name in values if name.endswith('_topic')}
        assert len(topics) > 7
        assert {name for name, topic in topics.items() if str(topic).startswith('/')} == set()


def test_the_sample_parameter_file_holds_the_defaults() -> None:
    """config/sim_node.yaml changes nothing when it is given to the node."""
    data = read_yaml(config_path('sim_node.yaml'), SettingsError)
    given = data['/**']['ros__parameters']
    assert make_settings(given) == make_settings()
    assert set(given) == set(BY_NAME)


@pytest.mark.parametrize(('values', 'message'), [
    ({'spede': 1.0}, r'parameter spede is unknown; did you mean speed\?'),
    ({'rate': 0.5}, 'rate = 0.5 is not allowed: from 1 to 1000 Hz'),
    ({'rate': float('nan')}, 'rate = nan is not allowed'),
    ({'rate': 'fast'}, "rate = 'fast' is str, not float: from 1 to 1000 Hz"),
    ({'rate': True}, 'rate = True is bool, not float'),
    ({'seed': -1}, 'seed = -1 is not allowed'),
    ({'seed': 1.5}, 'seed = 1.5 is float, not int'),
    ({'command_type': 'Pose'}, 'one of Twist, TwistStamped'),
    ({'joint_names': ['a', 'b', 'c', 'a']}, 'four different names'),
    ({'odometry_covariance': [1.0] * 5}, 'six positive numbers'),
    ({'odometry_covariance': [1.0] * 5 + [0.0]}, 'six positive numbers'),
    ({'imu_rate': 100.0}, 'imu_rate = 100 Hz must be rate = 50 Hz divided by a whole number'),
    ({'max_yaw': 10 ** 400}, r'max_yaw = 10+\.\.\. is not allowed: from 0 to 100 rad/s'),
    ({'imu_rate': 1e-320}, 'imu_rate = .* Hz must be rate = 50 Hz divided by a whole number'),
    ({'seed': 10 ** 400}, r'seed = 10+\.\.\. is not allowed: at least 0'),
    ({'odometry_covariance': [1.0] * 5 + [10 ** 400]}, 'six positive numbers'),
    ({'joint_names': ['a', 'b', 'c', {}]}, 'four different names'),
    ({'preset': {}}, 'preset = {} is dict, not str'),
    ({'preset': 'husky'}, 'one of paper, husky_ros1, clearpath_jazzy'),
])
def test_every_mistake_says_what_is_allowed(values: dict[str, object], message: str) -> None:
    """T17: name, value and range stand in the message."""
    with pytest.raises(SettingsError, match=message):
        make_settings(values)


def test_the_odometry_of_another_robot_assumes_its_wheels(tmp_path: Path) -> None:
    """Those of a preset are a Husky's; what is given goes before both."""
    small = tmp_path / 'small.yaml'
    Husky(mass=6.0, wheel_radius=0.05, track=0.24, turn_ratio=0.18).save(small)
    numbers = make_settings(model=str(small), preset='clearpath_jazzy', wheel_separation=0.25)
    assert (numbers.wheel_radius, numbers.wheel_separation) == (0.05, 0.25)
    assert numbers.wheel_separation_multiplier == pytest.approx(1.5)
    fitted = tmp_path / 'fitted.yaml'
    Husky(wheel_radius=0.16, wheel_damping=0.7).save(fitted)
    for path in (str(fitted), 'nowhere.yaml', ''):
        same = make_settings(model=path)
        assert (same.wheel_radius, same.wheel_separation, same.wheel_separation_multiplier) == (
            0.1651, 0.5708, 1.875)


def test_sensor_rates_become_steps() -> None:
    """A sensor at a tenth of the rate reports every tenth step."""
    settings = make_settings(rate=200.0, imu_rate=100.0, joint_states_rate=20.0)
    assert (settings.every('imu_rate'), settings.every('joint_states_rate')) == (2, 10)
    assert settings.period == 0.005
