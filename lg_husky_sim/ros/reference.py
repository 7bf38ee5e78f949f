# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Tables of topics, services and parameters for the documentation, from the code itself.

``python -m lg_husky_sim.ros.reference docs/ros.md`` writes them between their markers.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
import re
import sys

from lg_husky_sim.ros import control, standard_control
from lg_husky_sim.ros.settings import make_settings, preset_values, Setting, TABLE

PRESETS = ('paper', 'husky_ros1', 'clearpath_jazzy')
#: Setting of the topic, type, direction, when and what.
_TOPICS = (
    ('command_topic', 'geometry_msgs/{command_type}', 'in', 'velocity command'),
    ('initial_pose_topic', 'geometry_msgs/PoseWithCovarianceStamped', 'in',
     'sets the pose of the robot, at rest; with `publish_map_tf` only in the map'),
    ('odometry_topic', 'nav_msgs/Odometry', 'out', 'wheel odometry, every step'),
    ('ground_truth_topic', 'nav_msgs/Odometry', 'out', 'ground truth of the model, every step'),
    ('joint_states_topic', 'sensor_msgs/JointState', 'out',
     'angle, rate and torque of four wheels, `joint_states_rate`'),
    ('imu_topic', 'sensor_msgs/Imu', 'out', 'gyro, accelerometer, orientation, `imu_rate`'),
    ('battery_topic', 'sensor_msgs/BatteryState', 'out',
     'voltage and current once a second, `publish_battery`'),
    ('scan_topic', 'sensor_msgs/LaserScan', 'out', 'laser scan, best effort, `scan`'),
    ('map_topic', 'nav_msgs/OccupancyGrid', 'in', 'map of which the scan is made, `scan: map`'),
)
_FIXED = (
    ('tf', 'tf2_msgs/TFMessage', 'out',
     'odom to base_link, every step, `publish_tf`; map to odom, `publish_map_tf`'),
    ('tf_static', 'tf2_msgs/TFMessage', 'out', 'base_link to the laser, `publish_scan_tf`'),
    ('/clock', 'rosgraph_msgs/Clock', 'out', 'simulated time, every step, `publish_clock`'),
    ('diagnostics', 'diagnostic_msgs/DiagnosticArray', 'out',
     'rate and lateness once a second, `publish_diagnostics`'),
)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    names = list(head)
    lines = [names, ['---'] * len(names), *(list(row) for row in rows)]
    return '\n'.join('| ' + ' | '.join(cell.replace('|', '\\|') for cell in line) + ' |'
                     for line in lines)


def topics_table() -> str:
    """Return the topics under each preset as a Markdown table."""
    rows = []
    settings = {preset: make_settings(preset=preset) for preset in PRESETS}
    for name, kind, way, text in _TOPICS:
        cells = [f'`{getattr(settings[preset], name)}`' for preset in PRESETS]
        shown = kind.format(command_type='Twist[Stamped]')
        rows.append([f'`{name}`', *cells, shown, way, text])
    for topic, kind, way, text in _FIXED:
        rows.append(['', *[f'`{topic}`'] * 3, kind, way, text])
    return _table(['parameter', *PRESETS, 'type', '', 'what'], rows)


def control_table() -> str:
    """Return control topics and services as a Markdown table."""
    rows = [[f'`~/{name}`', 'topic', kind.replace('/msg/', '/'), text]
            for name, kind, text in control.TOPICS]
    rows += [[f'`~/{name}`', 'service', kind.replace('/srv/', '/'), text]
             for name, kind, text in control.SERVICES]
    rows += [[f'`{standard_control.service_name(kind)}`', 'service',
              f'simulation_interfaces/{kind}', 'where that package is installed']
             for kind in standard_control.SERVICES]
    return _table(['name', '', 'type', 'what'], rows)


def _shown(value: object) -> str:
    if value == '':
        return "`''`"
    if isinstance(value, bool):
        return f'`{str(value).lower()}`'
    if isinstance(value, (list, tuple)):
        return '`[' + ', '.join(str(item) for item in value) + ']`'
    return f'`{value}`'


def _default(setting: Setting) -> str:
    values = [preset_values(preset)[setting.name] for preset in PRESETS]
    if setting.name == 'preset' or all(value == values[0] for value in values):
        return _shown(values[0])
    return ' / '.join(_shown(value) for value in values)


def parameters_table() -> str:
    """Return the parameters as a Markdown table."""
    rows = [[f'`{s.name}`', s.kind.__name__ if s.kind is not tuple else 'list',
             _default(s), s.unit, s.allowed(),
             'live' if s.live else '', s.text] for s in TABLE]
    return _table(['name', 'type', 'default (paper / husky_ros1 / clearpath_jazzy)', 'unit',
                   'allowed', '', 'what'], rows)


def filled(text: str) -> str:
    """Return a document with each table between its markers made anew."""
    for name, table in (('topics', topics_table()), ('control', control_table()),
                        ('parameters', parameters_table())):
        pattern = re.compile(f'(<!-- {name} -->\n).*?(<!-- end {name} -->)', re.DOTALL)
        text = pattern.sub(lambda match, table=table: (  # type: ignore[misc]
            f'{match[1]}\n{table}\n\n{match[2]}'), text)
    return text


if __name__ == '__main__':
    document = Path(sys.argv[1])
    document.write_text(filled(document.read_text(encoding='utf-8')), encoding='utf-8')
