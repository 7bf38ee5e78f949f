# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The simulator with its looks: node, robot_state_publisher and, if wanted, RViz.

    ros2 launch lg_husky_sim sim.launch.py preset:=clearpath_jazzy namespace:=a200 rviz:=true
"""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = (
    ('preset', 'paper', 'paper, husky_ros1 or clearpath_jazzy'),
    ('namespace', '', 'namespace of all nodes'),
    ('model', '', 'model file; empty: the packaged Husky'),
    ('state_publisher', 'true', 'start robot_state_publisher with the packaged URDF'),
    ('rviz', 'false', 'start RViz with the packaged layout'),
)


def _start(context: LaunchContext) -> list[Node]:
    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    share = Path(get_package_share_directory('lg_husky_sim'))
    namespace, preset = value('namespace'), value('preset')
    # /tf must show the base, or nothing can be drawn.
    parameters: dict[str, object] = {'preset': preset, 'publish_tf': True}
    if value('model'):
        parameters['model'] = value('model')
    nodes = [Node(package='lg_husky_sim', executable='sim_node', namespace=namespace,
                  parameters=[parameters], output='screen')]
    if value('state_publisher') == 'true':
        urdf = (share / 'urdf' / 'husky.urdf').read_text(encoding='utf-8')
        remappings = []
        if preset == 'clearpath_jazzy':
            for side in ('front_left', 'front_right', 'rear_left', 'rear_right'):
                joint = f'joint name="{side}_wheel'
                urdf = urdf.replace(f'{joint}"', f'{joint}_joint"')
            urdf = urdf.replace('imu_link', 'imu_0_link')
            remappings.append(('joint_states', 'platform/joint_states'))
        else:
            remappings.append(('joint_states', '/joint_states'))
        nodes.append(Node(
            package='robot_state_publisher', executable='robot_state_publisher',
            namespace=namespace, parameters=[{'robot_description': urdf}],
            remappings=remappings))
    if value('rviz') == 'true':
        nodes.append(Node(
            package='rviz2', executable='rviz2', namespace=namespace,
            arguments=['-d', str(share / 'config' / 'husky.rviz')]))
    return nodes


def generate_launch_description() -> LaunchDescription:
    """Return the nodes that the arguments ask for."""
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=text)
          for name, default, text in ARGUMENTS),
        OpaqueFunction(function=_start)])
