# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Programs of other ROS packages, unmodified, beside the node; without a package, a loud skip."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
import os
from pathlib import Path
import signal
import subprocess
import time
from typing import Any

import pytest

#: How long a program and all that it started may take to end [s].
PATIENCE = 15.0


def find_program(package: str, name: str) -> Path:
    """Return a program of a ROS package; skip the test where it is not installed."""
    reason = f'{package} is not installed: what is claimed of it is not tested here'
    if find_spec('rclpy') is None or find_spec('ament_index_python') is None or (
            not os.environ.get('AMENT_PREFIX_PATH')):
        pytest.skip(reason)
    packages = import_module('ament_index_python.packages')
    try:
        prefix = packages.get_package_prefix(package)
    except packages.PackageNotFoundError:
        pytest.skip(reason)
    return Path(prefix) / 'lib' / package / name


@pytest.fixture
def program() -> Callable[[str, str], Path]:
    """Return the finder of programs, as fixtures are all that tests get from here."""
    return find_program


def members(group: int) -> list[int]:
    """Return the processes of a group that still run; who is dead and not reaped does not."""
    found = []
    for stat in Path('/proc').glob('[0-9]*/stat'):
        try:
            # After the name, which may have spaces and brackets: state, parent, group.
            state, _, of = stat.read_text().rpartition(')')[2].split()[:3]
        except (FileNotFoundError, ProcessLookupError):
            # It ended between the two.
            continue
        if int(of) == group and state != 'Z':
            found.append(int(stat.parent.name))
    return found


def tell(group: int, number: int) -> None:
    """Send a signal to each process of a group that still runs."""
    for one in members(group):
        try:
            os.kill(one, number)
        except ProcessLookupError:
            # It ended meanwhile.
            continue


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Return a starter of programs that are ended with the test; what they said is printed."""
    running: list[tuple[subprocess.Popen[bytes], Path]] = []

    def start(path: Path, *words: str | Path, **options: Any) -> subprocess.Popen[bytes]:
        log = tmp_path / f'{len(running)}_{path.name}.log'
        with log.open('wb') as file:
            running.append((subprocess.Popen(
                [path, *words], stdout=file, stderr=file, start_new_session=True,
                **options), log))
        return running[-1][0]

    yield start
    for process, _ in reversed(running):
        # To its children as well, as Ctrl-C in a terminal; `launch` leaves them to that. Also
        # where the program itself is gone: what it had started may have outlived it.
        tell(process.pid, signal.SIGINT)
    for process, log in running:
        end = time.monotonic() + PATIENCE
        while (late := members(process.pid)) and time.monotonic() < end:
            time.sleep(0.05)
        tell(process.pid, signal.SIGKILL)
        process.wait()
        print(f'--- {log.name}{", killed" if late else ""}\n'
              f'{log.read_text(errors="replace")[-4000:]}')
