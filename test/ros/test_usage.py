# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`sim_node --help` explains every parameter and starts nothing."""

from __future__ import annotations

import subprocess
import sys

from lg_husky_sim.ros.settings import TABLE
from lg_husky_sim.ros.usage import asked_for_help


def test_help_explains_every_parameter() -> None:
    done = subprocess.run([sys.executable, '-m', 'lg_husky_sim.ros.sim_node', '--help'],
                          text=True, capture_output=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, '')
    for setting in TABLE:
        assert f' {setting.name} = ' in done.stdout
        assert setting.text in done.stdout


def test_help_is_asked_for_outside_of_ros_arguments_only() -> None:
    assert asked_for_help(['-h'])
    assert asked_for_help(['--help', '--ros-args', '-p', 'rate:=50.0'])
    assert not asked_for_help(['--ros-args', '-p', 'rate:=50.0', '-h'])
    assert not asked_for_help([])
