# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The simulator with its looks: node, robot_state_publisher and, if wanted, RViz.

    ros2 launch lg_husky_sim sim.launch.py preset:=clearpath_jazzy namespace:=a200 rviz:=true
"""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = (
    ('preset', 'paper', 'paper, husky_ros1 or clearpath_jazzy'),
    ('namespace', '', 'namespace of all nodes'),
    ('model', '', 'model file; empty: the packaged Husky'),
    ('parameters', '', 'file of parameters for sim_node, such as config/nav2.yaml'),
    ('use_sim_time', 'false', 'true: all nodes take their time from /clock'),
    ('state_publisher', 'auto', 'robot_state_publisher with the packaged URDF: true, false, or '
     'auto: if it is installed'),
    ('rviz', 'false', 'start RViz with the packaged layout'),
)
#: Each robot has transforms of its own, as Clearpath has it.
OWN_TRANSFORMS = [('/tf', 'tf'), ('/tf_static', 'tf_static')]


def _installed(package: str) -> bool:
    try:
        get_package_share_directory(package)
    except PackageNotFoundError:
        return False
    return True


def _needed(package: str, argument: str) -> None:
    # Before anything is started: launch leaves running what it has started when it fails.
    if not _installed(package):
        message = (f'{argument} needs the package {package}: sudo apt install ros-jazzy-'
                   f'{package.replace("_", "-")}')
        raise RuntimeError(message)


def _start(context: LaunchContext) -> list[LogInfo | Node]:
    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    for name, allowed in (('state_publisher', ('auto', 'true', 'false')),
                          ('rviz', ('true', 'false')), ('use_sim_time', ('true', 'false'))):
        if value(name) not in allowed:
            message = f'{name}:={value(name)} is not allowed: {", ".join(allowed)}'
            raise RuntimeError(message)
    if value('rviz') == 'true':
        _needed('rviz2', 'rviz:=true')
    if value('state_publisher') == 'true':
        _needed('robot_state_publisher', 'state_publisher:=true')
    share = Path(get_package_share_directory('lg_husky_sim'))
    namespace, preset = value('namespace'), value('preset')
    # Without the argument, what a launch file around this one sets for all nodes is in force.
    timed: dict[str, object] = {'use_sim_time': True} if value('use_sim_time') == 'true' else {}
    # tf must show the base, or nothing can be drawn.
    own = {'preset': preset, 'publish_tf': True, **timed}
    if value('model'):
        own['model'] = value('model')
    parameters: list[object] = [own]
    if value('parameters'):
        if not Path(value('parameters')).is_file():
            message = f'parameters:={value("parameters")}: no such file'
            raise RuntimeError(message)
        parameters.append(value('parameters'))
    actions: list[LogInfo | Node] = [
        Node(package='lg_husky_sim', executable='sim_node', namespace=namespace,
             parameters=parameters, output='screen')]
    if value('state_publisher') == 'auto' and not _installed('robot_state_publisher'):
        actions.append(LogInfo(msg='robot_state_publisher is not installed: no wheels on tf'))
    elif value('state_publisher') != 'false':
        urdf = (share / 'urdf' / 'husky.urdf').read_text(encoding='utf-8')
        remappings = list(OWN_TRANSFORMS)
        if preset == 'clearpath_jazzy':
            for side in ('front_left', 'front_right', 'rear_left', 'rear_right'):
                joint = f'joint name="{side}_wheel'
                urdf = urdf.replace(f'{joint}"', f'{joint}_joint"')
            urdf = urdf.replace('imu_link', 'imu_0_link')
            remappings.append(('joint_states', 'platform/joint_states'))
        actions.append(Node(
            package='robot_state_publisher', executable='robot_state_publisher',
            namespace=namespace, parameters=[{'robot_description': urdf, **timed}],
            remappings=remappings))
    if value('rviz') == 'true':
        actions.append(Node(
            package='rviz2', executable='rviz2', namespace=namespace, remappings=OWN_TRANSFORMS,
            arguments=['-d', str(share / 'config' / 'husky.rviz')],
            parameters=[timed] if timed else None))
    return actions


def generate_launch_description() -> LaunchDescription:
    """Return the nodes that the arguments ask for."""
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=text)
          for name, default, text in ARGUMENTS),
        OpaqueFunction(function=_start)])
