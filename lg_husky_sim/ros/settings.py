# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The node's parameters: one table, and the frozen settings made from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
import difflib
from functools import lru_cache
import math
from typing import Any

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.resources import config_path
from lg_husky_sim.ros.pacing import SLOWEST
from lg_husky_sim.ros.wheel_odometry import assumed_for
from lg_husky_sim.yaml_files import read_yaml, shown

SCHEMA = 'lg_husky_sim/presets/1'
#: Preset of a node that is not told otherwise.
DEFAULT_PRESET = 'paper'
_HUGE = 1e9
#: Whole numbers beyond it do not fit into a float.
_LARGEST = 1e300


@dataclass(frozen=True)
class Setting:
    """
    One parameter of the node; its default stands in ``config/presets.yaml``.

    Parameters
    ----------
    name : str
    kind : type
        bool, int, float, str, or tuple for four names or six numbers.
    text : str
        What it does.
    unit : str
    low, high : float
        Allowed range of a number, both ends included.
    choices : tuple of str
        Allowed texts; empty if any will do.
    live : bool
        Whether it may change while the node runs.

    """

    name: str
    kind: type
    text: str
    unit: str = ''
    low: float = -_HUGE
    high: float = _HUGE
    choices: tuple[str, ...] = ()
    live: bool = False

    def allowed(self) -> str:
        """Return the range in words."""
        if self.choices:
            return 'one of ' + ', '.join(self.choices)
        if self.kind in (int, float):
            unit = f' {self.unit}' if self.unit else ''
            if self.high >= _HUGE:
                return f'at least {self.low:g}{unit}' if self.low > -_HUGE else 'any number'
            return f'from {self.low:g} to {self.high:g}{unit}'
        return {bool: 'true or false', str: 'text'}.get(self.kind, 'a list')

    def checked(self, value: object) -> Any:
        """
        Return the value in the setting's type.

        Raises
        ------
        SettingsError
            If it has another type or is out of range.

        """
        problem = SettingsError(f'{self.name} = {shown(value)} is not allowed: {self.allowed()}')
        if self.kind is tuple:
            return self._checked_list(value, problem)
        if self.kind is float and type(value) is int:
            value = float(value) if abs(value) <= _LARGEST else math.inf
        if type(value) is not self.kind:
            raise SettingsError(
                f'{self.name} = {shown(value)} is {type(value).__name__}, not '
                f'{self.kind.__name__}: {self.allowed()}')
        if isinstance(value, (int, float)) and not isinstance(value, bool) and not (
                self.low <= value <= self.high):
            raise problem
        if self.choices and value not in self.choices:
            raise problem
        return value

    def _checked_list(self, value: object, problem: SettingsError) -> tuple[Any, ...]:
        items = tuple(value) if isinstance(value, (list, tuple)) else ()
        if self.name == 'joint_names':
            if len(items) != 4 or not all(
                    isinstance(item, str) and item for item in items) or len(set(items)) != 4:
                raise SettingsError(f'{problem} of four different names: front left, front '
                                    'right, rear left, rear right')
            return items
        if len(items) != 6 or not all(
                type(item) in (int, float) and 0.0 < item <= _LARGEST
                for item in items):
            raise SettingsError(f'{problem} of six positive numbers')
        return tuple(float(item) for item in items)


TABLE: tuple[Setting, ...] = (
    Setting('preset', str, 'names, types, limits and covariances of a robot, all together',
            choices=('paper', 'husky_ros1', 'clearpath_jazzy')),
    Setting('model', str, 'model file with parameters and effects; empty: the packaged Husky',
            live=True),
    Setting('rate', float, 'steps and odometry messages per simulated second', 'Hz', 1.0, 1000.0),
    Setting('speed', float, 'simulated seconds per second; 0: as fast as possible', '', 0.0,
            1000.0, live=True),
    Setting('start_paused', bool, 'wait for the first resume or step'),
    Setting('publish_clock', bool, 'publish /clock and stamp everything in simulated time'),
    Setting('seed', int, "seed of the sensors' noise", '', 0, 2**31 - 1),
    Setting('initial_x', float, 'x of the base at start and after a reset', 'm', -1e6, 1e6),
    Setting('initial_y', float, 'y of the base at start and after a reset', 'm', -1e6, 1e6),
    Setting('initial_heading', float, 'heading at start and after a reset', 'rad', -1e3, 1e3),
    Setting('command_topic', str, 'velocity command'),
    Setting('command_type', str, 'its type', choices=('Twist', 'TwistStamped')),
    Setting('command_timeout', float, 'age after which a command counts as zero; 0: never', 's',
            0.0, 3600.0, live=True),
    Setting('max_forward', float, 'limit of the commanded speed; 0: none', 'm/s', 0.0, 100.0,
            live=True),
    Setting('max_forward_acceleration', float, 'limit of the commanded acceleration; 0: '
                                               'none', 'm/s²', 0.0,
            1000.0, live=True),
    Setting('max_yaw', float, 'limit of the commanded yaw rate; 0: none', 'rad/s', 0.0, 100.0,
            live=True),
    Setting('max_yaw_acceleration', float, 'limit of the commanded yaw acceleration; 0: '
                                           'none', 'rad/s²', 0.0, 1000.0,
            live=True),
    Setting('wheel_radius', float, 'wheel radius that the wheel odometry assumes; by default that '
            'of the model, where it is of another robot than the Husky', 'm', 0.001, 10.0),
    Setting('wheel_separation', float, 'track that the wheel odometry assumes; likewise', 'm',
            0.001, 10.0),
    Setting('wheel_separation_multiplier', float, 'factor on wheel_separation, as a skid-steer '
            'robot slips; likewise, twice turn_ratio over track', '', 0.01, 100.0),
    Setting('odometry_window', int, "wheel velocities averaged in the odometry's twist", 'steps',
            1, 1000),
    Setting('odometry_topic', str, "wheel odometry, as the robot's controller computes it"),
    Setting('ground_truth_topic', str, 'pose and velocity of the model'),
    Setting('joint_states_topic', str, 'angles, rates and torques of the four wheels'),
    Setting('imu_topic', str, 'gyro, accelerometer and orientation'),
    Setting('battery_topic', str, 'battery voltage and current'),
    Setting('initial_pose_topic', str, 'sets the pose of the robot'),
    Setting('odom_frame', str, 'frame of poses'),
    Setting('base_frame', str, 'frame of the robot'),
    Setting('imu_frame', str, 'frame of the IMU'),
    Setting('publish_tf', bool, 'publish odom_frame to base_frame on tf'),
    Setting('tf_source', str, 'source of tf: the ground truth, or the wheel odometry',
            choices=('ground_truth', 'wheels')),
    Setting('publish_battery', bool, "publish the battery's state once a second"),
    Setting('publish_diagnostics', bool, 'publish rate and lateness on diagnostics every second'),
    Setting('joint_names', tuple, 'front left, front right, rear left, rear right'),
    Setting('odometry_covariance', tuple, 'diagonal of pose and twist: x y z roll pitch yaw'),
    Setting('joint_states_rate', float, 'messages per simulated second; 0: as rate', 'Hz', 0.0,
            1000.0),
    Setting('imu_rate', float, 'messages per simulated second; 0: as rate', 'Hz', 0.0, 1000.0),
    Setting('sensor_noise', bool, 'draw noise with the standard deviations below', live=True),
    Setting('gyro_stddev', float, 'noise of the gyro; its square is the covariance', 'rad/s',
            1e-9, 10.0, live=True),
    Setting('accel_stddev', float, 'noise of the accelerometer; likewise', 'm/s²', 1e-9, 100.0,
            live=True),
    Setting('orientation_stddev', float, 'noise of the heading in the IMU; likewise', 'rad', 1e-9,
            10.0, live=True),
    Setting('encoder_stddev', float, 'noise of the wheel rates', 'rad/s', 0.0, 100.0, live=True),
    Setting('gyro_bias', float, 'added to the gyro', 'rad/s', -10.0, 10.0, live=True),
    Setting('accel_bias', float, "added to the accelerometer's x", 'm/s²', -100.0, 100.0,
            live=True),
    Setting('encoder_ticks', int, 'ticks of a wheel turn to which angles are rounded; 0: none', '',
            0, 10_000_000, live=True),
    Setting('gyro_resolution', float, 'step of the gyro; 0: none', 'rad/s', 0.0, 10.0, live=True),
    Setting('accel_resolution', float, 'step of the accelerometer; 0: none', 'm/s²', 0.0, 100.0,
            live=True),
    Setting('imu_latency', float, 'delay of the IMU messages', 's', 0.0, 10.0),
    Setting('encoder_latency', float, 'delay of the JointState messages', 's', 0.0,
            10.0),
    Setting('imu_x', float, "IMU ahead of the base's origin", 'm', -10.0, 10.0),
    Setting('imu_y', float, "IMU to the left of the base's origin", 'm', -10.0, 10.0),
    Setting('gravity', float, 'what the accelerometer reads on z', 'm/s²', 0.0, 100.0),
    Setting('publish_map_tf', bool, 'publish map_frame to odom_frame on tf, as a localisation '
            'that knows the truth; initial_pose_topic then corrects it'),
    Setting('map_frame', str, 'frame of the map'),
    Setting('scan', str, 'publish a laser scan, empty or of the map',
            choices=('none', 'free', 'map')),
    Setting('map_file', str, 'YAML file of a map with a PGM image; empty: map_topic'),
    Setting('map_topic', str, 'map of which the scan is made'),
    Setting('map_occupied', int, 'occupancy from which a cell counts as occupied', '%', 1, 100),
    Setting('scan_topic', str, 'laser scan'),
    Setting('scan_frame', str, 'frame of the laser'),
    Setting('publish_scan_tf', bool, 'publish base_frame to scan_frame on tf_static'),
    Setting('scan_rate', float, 'scans per simulated second; 0: as rate', 'Hz', 0.0, 1000.0),
    Setting('scan_x', float, "laser ahead of the base's origin", 'm', -10.0, 10.0),
    Setting('scan_y', float, "laser to the left of the base's origin", 'm', -10.0, 10.0),
    Setting('scan_heading', float, 'heading of the laser relative to the base', 'rad', -10.0,
            10.0),
    Setting('scan_angle_min', float, 'angle of the first ray', 'rad', -10.0, 10.0),
    Setting('scan_angle_max', float, 'no ray is at or beyond this angle', 'rad', -10.0, 10.0),
    Setting('scan_angle_increment', float, 'angle between rays', 'rad', 1e-4, 10.0),
    Setting('scan_range_min', float, 'shortest range', 'm', 0.0, 1000.0),
    Setting('scan_range_max', float, 'longest range', 'm', 0.1, 1000.0),
    Setting('scan_stddev', float, 'noise of ranges, drawn where sensor_noise is set', 'm', 0.0,
            10.0, live=True),
    Setting('scan_use_inf', bool, 'no return reads infinity, not scan_range_max - 0.1'),
)
BY_NAME = {setting.name: setting for setting in TABLE}


@dataclass(frozen=True)
class Settings:
    """What :data:`TABLE` describes; units and ranges stand there."""

    preset: str
    model: str
    rate: float
    speed: float
    start_paused: bool
    publish_clock: bool
    seed: int
    initial_x: float
    initial_y: float
    initial_heading: float
    command_topic: str
    command_type: str
    command_timeout: float
    max_forward: float
    max_forward_acceleration: float
    max_yaw: float
    max_yaw_acceleration: float
    wheel_radius: float
    wheel_separation: float
    wheel_separation_multiplier: float
    odometry_window: int
    odometry_topic: str
    ground_truth_topic: str
    joint_states_topic: str
    imu_topic: str
    battery_topic: str
    initial_pose_topic: str
    odom_frame: str
    base_frame: str
    imu_frame: str
    publish_tf: bool
    tf_source: str
    publish_battery: bool
    publish_diagnostics: bool
    joint_names: tuple[str, str, str, str]
    odometry_covariance: tuple[float, ...]
    joint_states_rate: float
    imu_rate: float
    sensor_noise: bool
    gyro_stddev: float
    accel_stddev: float
    orientation_stddev: float
    encoder_stddev: float
    gyro_bias: float
    accel_bias: float
    encoder_ticks: int
    gyro_resolution: float
    accel_resolution: float
    imu_latency: float
    encoder_latency: float
    imu_x: float
    imu_y: float
    gravity: float
    publish_map_tf: bool
    map_frame: str
    scan: str
    map_file: str
    map_topic: str
    map_occupied: int
    scan_topic: str
    scan_frame: str
    publish_scan_tf: bool
    scan_rate: float
    scan_x: float
    scan_y: float
    scan_heading: float
    scan_angle_min: float
    scan_angle_max: float
    scan_angle_increment: float
    scan_range_min: float
    scan_range_max: float
    scan_stddev: float
    scan_use_inf: bool

    def __post_init__(self) -> None:
        """Check every value, and those that hang together."""
        for field in fields(self):
            value = BY_NAME[field.name].checked(getattr(self, field.name))
            object.__setattr__(self, field.name, value)
        if 0.0 < self.speed < SLOWEST:
            raise SettingsError(f'speed = {self.speed:g} is not allowed: 0, or from {SLOWEST:g}')
        for name in ('joint_states_rate', 'imu_rate', *(
                ['scan_rate'] if self.scan != 'none' else [])):
            self.every(name)
        for low, high in (('scan_angle_min', 'scan_angle_max'),
                          ('scan_range_min', 'scan_range_max')):
            if getattr(self, low) >= getattr(self, high):
                raise SettingsError(f'{low} = {getattr(self, low):g} must be below {high} = '
                                    f'{getattr(self, high):g}')

    @property
    def period(self) -> float:
        """Length of a step [s]."""
        return 1.0 / self.rate

    def every(self, name: str) -> int:
        """
        Return after how many steps a sensor reports.

        Raises
        ------
        SettingsError
            If the sensor's rate does not divide the node's.

        """
        own: float = getattr(self, name)
        if own == 0.0:
            return 1
        ratio = self.rate / own
        if not 1.0 - 1e-9 <= ratio < _HUGE or abs(ratio - round(ratio)) > 1e-9 * ratio:
            raise SettingsError(f'{name} = {own:g} Hz must be rate = {self.rate:g} Hz divided by '
                                'a whole number')
        return round(ratio)


@lru_cache(maxsize=1)
def _presets() -> tuple[dict[str, Any], dict[str, Any]]:
    data = read_yaml(config_path('presets.yaml'), SettingsError)
    if data.get('schema') != SCHEMA:
        raise SettingsError(f'presets.yaml has schema {data.get("schema")!r}, not {SCHEMA!r}')
    return data['common'], data['presets']


def preset_values(preset: str = DEFAULT_PRESET) -> dict[str, Any]:
    """
    Return all defaults under a preset.

    Raises
    ------
    SettingsError
        If there is no such preset.

    """
    BY_NAME['preset'].checked(preset)
    common, presets = _presets()
    values: dict[str, Any] = {'preset': preset, **common, **presets[preset]}
    return values


def check_names(names: Mapping[str, object] | set[str]) -> None:
    """
    Refuse names that are no settings.

    Raises
    ------
    SettingsError
        With the nearest names there are.

    """
    for name in sorted(set(names) - set(BY_NAME)):
        raise SettingsError(unknown(name))


def unknown(name: str) -> str:
    """Return that a name is no setting, with the nearest one there is."""
    near = difflib.get_close_matches(name, BY_NAME, n=1, cutoff=0.5)
    return f'parameter {name} is unknown' + (f'; did you mean {near[0]}?' if near else '')


def make_settings(values: Mapping[str, object] | None = None, **more: object) -> Settings:
    """
    Return the settings of a preset with some values changed.

    Parameters
    ----------
    values : mapping, optional
        By name; ``preset`` among them chooses the defaults of the others.
    **more
        The same as keywords.

    Raises
    ------
    SettingsError
        If a name is unknown, or a value not allowed.

    """
    given = {**(values or {}), **more}
    check_names(given)
    preset = given.get('preset', DEFAULT_PRESET)
    values = preset_values(BY_NAME['preset'].checked(preset))
    return Settings(**(values | assumed_for(given.get('model')) | given))
