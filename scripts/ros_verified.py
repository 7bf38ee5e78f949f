# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Run the contract tests and the ros2 command line on a real ROS 2, and write what they said.

Usage, with ROS 2 sourced:
``python scripts/ros_verified.py [--embedded PYTHON] [--only WORDS]``. The part of
docs/ros_verified.md between its markers is made anew, for every RMW that is installed; PYTHON is
an interpreter without ROS, for the embedded backend. With WORDS, only the sections with these in
their heading; the others stay as they are. The tests of other stacks print their figures, which
are copied; of a stack that is not installed they say so.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from importlib.metadata import PackageNotFoundError, version
import os
from pathlib import Path
import platform
import re
import shlex
import signal
import subprocess
import sys
import time
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / 'docs' / 'ros_verified.md'
MARKERS = '<!-- made by scripts/ros_verified.py -->', '<!-- end of what is made -->'
RMWS = ('rmw_cyclonedds_cpp', 'rmw_fastrtps_cpp')
PACKAGES = ('rclpy', 'rcl', *RMWS, 'cyclonedds', 'fastrtps', 'sensor_msgs', 'nav_msgs',
            'simulation_interfaces', 'tf2_ros_py', 'rosbag2_py', 'ros2cli', 'rclcpp',
            'robot_localization', 'robot_state_publisher', 'teleop_twist_keyboard', 'twist_mux',
            'nav2_planner', 'nav2_navfn_planner', 'nav2_controller', 'nav2_costmap_2d',
            'nav2_regulated_pure_pursuit_controller', 'nav2_rotation_shim_controller',
            'nav2_behaviors', 'nav2_bt_navigator', 'behaviortree_cpp',
            'nav2_velocity_smoother', 'nav2_collision_monitor')
WHEELS = ('numpy', 'numba', 'rosbags', 'cyclonedds', 'pytest')
#: ROS' own plugins do not know the newest pytest.
PLUGINS = ('-p', 'no:cacheprovider', '-p', 'no:launch_testing', '-p', 'no:launch_ros',
           '-p', 'no:launch_testing_ros_pytest_entrypoint')
PYTEST = ('-m', 'pytest', 'test/ros', '--ignore', 'test/ros/stacks', '-q', *PLUGINS)
STACKS = ('-m', 'pytest', 'test/ros/stacks', '-s', '-q', '-rsfE', *PLUGINS)
#: How a test begins a line that is to be copied.
FIGURE = 'figure: '
#: What is typed beside a node with services in a map; the last ones change it.
COMMANDS = (
    'ros2 node list', 'ros2 topic list -t', 'ros2 topic info -v /scan',
    'ros2 topic echo --once /joint_states --field name',
    'ros2 topic echo --once /scan --field angle_increment',
    'ros2 topic echo --once /tf_static',
    'ros2 param get /sim_node speed', 'ros2 param set /sim_node speed 2.0',
    'ros2 param set /sim_node speed 5000.0', 'ros2 param set /sim_node rate 100.0',
    'ros2 param describe /sim_node command_timeout',
    "ros2 service call /sim_node/pause std_srvs/srv/SetBool '{data: true}'",
    'ros2 service call /sim_node/step std_srvs/srv/Trigger',
    'ros2 service call /sim_node/reset std_srvs/srv/Trigger',
    'ros2 service call /get_simulator_features simulation_interfaces/srv/GetSimulatorFeatures',
    "ros2 service call /step_simulation simulation_interfaces/srv/StepSimulation '{steps: 10}'",
)


def package_versions() -> dict[str, str]:
    """Return the versions of the ROS packages that are installed."""
    found: dict[str, str] = {}
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(':'):
        for name in PACKAGES:
            path = Path(prefix) / 'share' / name / 'package.xml'
            if path.is_file():
                text = ElementTree.parse(path).getroot().findtext('version')  # noqa: S314
                found.setdefault(name, str(text).strip())
    return found


def versions_table(packages: dict[str, str]) -> str:
    """Return what was installed as a Markdown table."""
    rows = [('ROS 2', os.environ.get('ROS_DISTRO', '?')),
            ('Python', platform.python_version()), *packages.items()]
    for name in WHEELS:
        try:
            rows.append((f'{name} (wheel)', version(name)))
        except PackageNotFoundError:
            rows.append((f'{name} (wheel)', 'not installed'))
    return '\n'.join(['| package | version |', '| --- | --- |',
                      *(f'| {name} | {text} |' for name, text in rows)])


def said_by_pytest(python: str, words: tuple[str, ...], environment: dict[str, str]) -> list[str]:
    """Return what pytest says."""
    done = subprocess.run(  # noqa: S603
        [python, *words], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    return done.stdout.strip().splitlines() or [f'no answer, exit code {done.returncode}']


def tested(python: str, environment: dict[str, str]) -> tuple[str, list[str]]:
    """Return the last line of the contract tests, and which of them failed."""
    lines = said_by_pytest(python, PYTEST, environment)
    failed = [re.sub(r' - .*', '', line) for line in lines
              if line.startswith(('FAILED', 'ERROR'))]
    return re.sub(r'^=+ | =+$', '', lines[-1]), failed


def stack(rmw: str) -> str:
    """Return the command of the tests of other stacks, their figures, omissions and the result."""
    lines = said_by_pytest(sys.executable, STACKS, os.environ | {'RMW_IMPLEMENTATION': rmw})
    shown = [line.partition(FIGURE)[2] for line in lines if FIGURE in line]
    shown += [re.sub(r' - .*', '', line) for line in lines
              if line.startswith(('FAILED', 'ERROR', 'SKIPPED'))]
    shown.append(re.sub(r'^=+ | =+$', '', lines[-1]))
    return '\n'.join([f'    python {" ".join(STACKS)}', '', '```', *shown, '```'])


def tests_table(rmws: list[str], embedded: str | None) -> str:
    """Run the contract tests on each backend; return the command and a Markdown table."""
    rows, lost = [], []
    for rmw in rmws:
        said, failed = tested(sys.executable, os.environ | {'RMW_IMPLEMENTATION': rmw})
        rows.append((f'rclpy, {rmw}', said))
        lost += [f'- {rmw}: `{line}`' for line in failed]
    if embedded:
        bare = {name: value for name, value in os.environ.items()
                if not name.startswith(('ROS_', 'AMENT', 'RMW', 'COLCON', 'LD_', 'PYTHON'))}
        said, failed = tested(embedded, bare | {'PYTHONPATH': str(ROOT)})
        rows.append(('embedded', said))
        lost += [f'- embedded: `{line}`' for line in failed]
    table = ['| backend | result |', '| --- | --- |', *(f'| {a} | {b} |' for a, b in rows)]
    return '\n'.join([f'    python {" ".join(PYTEST)}', '', *table,
                      *(['', 'Failed:', '', *lost] if lost else [])])


def answered(command: str, environment: dict[str, str]) -> str:
    """Return what a command says, without what differs each time."""
    try:
        ran = subprocess.run(  # noqa: S603
            shlex.split(command), env=environment, capture_output=True, text=True, timeout=60.0,
            check=False)
    except subprocess.TimeoutExpired:
        return 'no answer in 60 s'
    text = '\n'.join(line for line in (ran.stdout + ran.stderr).splitlines() if line.strip()
                     and not line.startswith(('requester: making', 'waiting for service')))
    return re.sub(r'GID: \S+', 'GID: …', text).strip()


def session(rmw: str, domain: int) -> str:
    """Start a node, type commands beside it, and return both sides."""
    environment = os.environ | {
        'RMW_IMPLEMENTATION': rmw, 'ROS_DOMAIN_ID': str(domain),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
    node = ['-m', 'lg_husky_sim.ros.sim_node', '--ros-args', '--params-file', 'config/nav2.yaml']
    process = subprocess.Popen(  # noqa: S603
        [sys.executable, *node], cwd=ROOT, env=environment, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True)
    try:
        deadline = time.monotonic() + 120.0
        names: list[str] = []
        while '/sim_node' not in names and time.monotonic() < deadline:
            names = answered('ros2 node list', environment).splitlines()
        lines = []
        for command in COMMANDS:
            lines += [f'$ {command}', answered(command, environment)]
    finally:
        process.send_signal(signal.SIGINT)
        try:
            said, _ = process.communicate(timeout=30.0)
        except subprocess.TimeoutExpired:
            process.kill()
            said, _ = process.communicate()
    log = re.sub(r'\[\d+\.\d+\] ', '', said).strip()
    return '\n'.join([
        f'    python {" ".join(node)}', '', '```', log, f'(Ctrl-C: exit code '
        f'{process.returncode})', '```', '', '```', *lines, '```'])


def sections(text: str) -> dict[str, str]:
    """Return what stands below each heading."""
    pieces = [piece.partition('\n') for piece in text.strip().split('\n## ')]
    return {heading.removeprefix('## '): body.strip('\n') for heading, _, body in pieces}


def main() -> int:
    """Run all that there is, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--embedded', help='an interpreter without ROS')
    parser.add_argument('--only', default='', help='words of the headings of what is made anew')
    words = parser.parse_args()
    packages = package_versions()
    rmws = [name for name in RMWS if name in packages]
    if not rmws:
        print('error: no RMW is installed; source the setup file of ROS 2', file=sys.stderr)
        return 1
    missing = [name for name in RMWS if name not in rmws]
    makers: dict[str, Callable[[], str]] = {
        'Versions': lambda: '\n\n'.join([versions_table(packages), *(
            [f'Not installed, and not run here: {", ".join(missing)}.'] if missing else [])]),
        'Contract tests': partial(tests_table, rmws, words.embedded)}
    makers |= {f'Other stacks, {rmw}': partial(stack, rmw) for rmw in rmws}
    makers |= {f'The command line, {rmw}': partial(session, rmw, 60 + place)
               for place, rmw in enumerate(rmws)}
    if not any(words.only in heading for heading in makers):
        print(f'error: --only {words.only!r} is in none of: {", ".join(makers)}', file=sys.stderr)
        return 2
    before, _, rest = PAGE.read_text(encoding='utf-8').partition(MARKERS[0])
    made, _, after = rest.partition(MARKERS[1])
    kept = sections(made)
    parts = [f'## {heading}\n\n{make() if words.only in heading else kept[heading]}'
             for heading, make in makers.items() if words.only in heading or heading in kept]
    PAGE.write_text('\n'.join([f'{before}{MARKERS[0]}', '', '\n\n'.join(parts), '',
                               f'{MARKERS[1]}{after}']), encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main())
