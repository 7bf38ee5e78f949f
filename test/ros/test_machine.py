# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Failures by the clock count when the machine was there, and only then."""

from __future__ import annotations

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.testing.machine import MachineWatch
import pytest

CONFTEST = """
from lg_husky_sim.testing import machine
told = {told}
class Watch(machine.MachineWatch):
    def watches(self):
        return {watches}
    def disturbed(self, begun, ended):
        return told.pop(0) if told else ''
machine.MachineWatch = Watch
def pytest_configure(config):
    config.addinivalue_line('markers', 'realtime: by the clock')
    config.pluginmanager.register(machine.PatientClock(repeats=2, pause=0.0))
"""

TESTS = """
import pytest
runs = []
@pytest.mark.realtime
def test_by_the_clock():
    runs.append(1)
    assert len(runs) >= {passes_at}
def test_of_another_kind():
    assert {other}
"""


@pytest.mark.parametrize(('told', 'passes_at', 'other', 'watches', 'wanted'), [
    (['late'], 2, True, True, '2 passed, 1 rerun'),
    (['late'], 3, True, True, '1 failed, 1 passed, 1 rerun'),
    (['late'], 2, True, False, '1 failed, 1 passed'),
    (['late'] * 3, 9, True, True, '1 failed, 1 passed, 2 rerun'),
    (['late'] * 3, 1, False, True, '1 failed, 1 passed'),
])
def test_failures_on_a_disturbed_machine_are_asked_again(
        told: list[str], passes_at: int, other: bool, watches: bool, wanted: str, tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('pytest_rerunfailures')
    # Row 54: what colcon gives the outer pytest made the one below run all of test/ros.
    monkeypatch.setenv('PYTEST_ADDOPTS', '--collect-only')
    (tmp_path / 'conftest.py').write_text(
        CONFTEST.format(told=told, watches=watches), encoding='utf-8')
    (tmp_path / 'test_it.py').write_text(
        TESTS.format(passes_at=passes_at, other=other), encoding='utf-8')
    ran = subprocess.run(
        # ROS' own plugins do not know the newest pytest.
        [sys.executable, '-m', 'pytest', '-rs', '-p', 'no:cacheprovider', '-p', 'no:xdist',
         '-p', 'no:launch_testing', '-p', 'no:launch_ros', '--rootdir', str(tmp_path),
         str(tmp_path)],
        env={name: value for name, value in os.environ.items() if name != 'PYTEST_ADDOPTS'},
        capture_output=True, text=True, timeout=120.0, check=False)
    assert f'= {wanted} in ' in ran.stdout, ran.stdout
    assert ran.returncode == ('failed' in wanted)


@pytest.mark.realtime
def test_a_standstill_is_noticed_and_belongs_to_its_time() -> None:
    with MachineWatch(worst=0.4, share=1.0) as watch:
        time.sleep(0.5)
        begun = time.monotonic()
        time.sleep(0.5)
        calm = time.monotonic()
        watch._process.send_signal(signal.SIGSTOP)
        time.sleep(0.6)
        watch._process.send_signal(signal.SIGCONT)
        time.sleep(0.3)
        assert watch.disturbed(begun, calm - 0.05) == ''
        assert watch.disturbed(begun, time.monotonic()).startswith('a core stood still for 0.')
        # The one who writes goes on where he was, however often it is read.
        for _ in range(3000):
            watch.disturbed(begun, calm)
        assert watch.disturbed(begun, time.monotonic()).startswith('a core stood still for 0.')
    with pytest.raises(SettingsError, match='nobody watches'):
        watch.disturbed(0.0, 1.0)
