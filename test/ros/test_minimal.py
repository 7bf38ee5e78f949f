# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The node runs with ROS, common_interfaces, numpy, scipy and PyYAML, and nothing else."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
import subprocess
import sys
from xml.etree import ElementTree

from lg_husky_sim.testing.live import isolated_domain
import pytest

ROOT = Path(__file__).resolve().parents[2]
#: What other parts of the package use. The embedded backend, which stands in for ROS, needs two.
OTHERS = ['click', 'control', 'dask', 'deap', 'distributed', 'hypothesis', 'jinja2', 'matplotlib',
          'mujoco', 'numba', 'pandas', 'plotly', 'pytest', 'sympy', 'tqdm',
          *([] if find_spec('rclpy') is None else ['cyclonedds', 'rosbags'])]
PROGRAM = f"""
import sys
sys.modules.update(dict.fromkeys({OTHERS!r}))
from lg_husky_sim.ros import api
from lg_husky_sim.ros.simulation_node import SimNode
from lg_husky_sim.signals import BodyTwist
api.init(args=['x'])
node = SimNode('minimal')
node.engine.command(BodyTwist(0.5, 0.1))
for _ in range(10):
    node.engine.step()
print(node.reading.step, node.reading.twist.forward > 0.0)
node.destroy_node()
api.try_shutdown()
"""


@pytest.mark.skipif(find_spec('rclpy') is None and find_spec('cyclonedds') is None,
                    reason='neither ROS nor the embedded backend is installed')
def test_the_node_runs_without_anything_optional(tmp_path: Path) -> None:
    """Point 2: what a robot's computer must have."""
    with isolated_domain():
        done = subprocess.run([sys.executable, '-c', PROGRAM], text=True, capture_output=True,
                              timeout=120.0, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == '10 True\n'


def test_the_command_line_says_in_a_line_what_it_lacks() -> None:
    """Row 58: where rosdep was not run, lg_husky ended in a traceback."""
    done = subprocess.run(
        [sys.executable, '-c', "import sys; sys.modules['click'] = None\n"
         'from lg_husky_sim.cli.main import main; main()'], text=True, capture_output=True,
        timeout=60.0, check=False)
    assert (done.returncode, done.stdout) == (1, '')
    assert done.stderr == (
        'error: click is needed for lg_husky and is not installed: pip install click, or with ROS '
        'sudo apt install python3-click\n')


def test_package_xml_has_what_reads_and_writes_bags() -> None:
    """Row 20: with ROS, rosbag2_py is the backend; rosdep has no key for rosbags."""
    manifest = ElementTree.parse(ROOT / 'package.xml').getroot()
    declared = {element.text for element in manifest.iter('exec_depend')}
    assert {'rosbag2_py', 'rosbag2_storage_mcap', 'rosidl_runtime_py'} <= declared
