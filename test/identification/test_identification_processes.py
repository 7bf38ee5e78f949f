# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Processes that share the work end with the one who asked, however he ends."""

from __future__ import annotations

from pathlib import Path
import re
import signal
import subprocess
import sys
import time

import pytest

PROGRAM = """
import os, signal, time
from lg_husky_sim.processes import processes
if __name__ == '__main__':
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with processes(2) as pool:
            print(pool.submit(os.getpid).result(), flush=True)
            pool.submit(time.sleep, 300).result()
    except KeyboardInterrupt:
        print('interrupted', flush=True)
"""

CLUSTER = """
import math, os, signal, time
import distributed
from lg_husky_sim.identification.executor import run_tasks

def slow(number):
    time.sleep(0.3)
    return number * number, os.getpid()

def nested(number):
    return run_tasks(math.factorial, [number, number + 1])

def lose_one():
    if not lost:
        lost.append(next(iter(cluster.workers.values())).pid)
        os.kill(lost[0], signal.SIGKILL)

if __name__ == '__main__':
    lost = []
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None
                                  ) as cluster:
        os.environ['LG_HUSKY_BACKEND'] = f'dask:{cluster.scheduler_address}'
        answers = run_tasks(slow, list(range(12)), progress=lose_one)
        print([square for square, _ in answers] == [k * k for k in range(12)], len(lost),
              os.getpid() in {pid for _, pid in answers}, run_tasks(nested, [3, 4]))
"""


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_process_outlives_the_one_who_asked(number: signal.Signals, tmp_path: Path) -> None:
    """Asked to stop or killed, while a task would go on for minutes; and without a traceback."""
    program = tmp_path / 'program.py'
    program.write_text(PROGRAM, encoding='utf-8')
    with subprocess.Popen([sys.executable, str(program)], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True) as asked:
        assert asked.stdout is not None
        child = Path('/proc') / asked.stdout.readline().strip()
        assert child.exists()
        asked.send_signal(number)
        said, errors = asked.communicate(timeout=60.0)
        for _ in range(300):
            if not child.exists():
                break
            time.sleep(0.1)
        assert not child.exists()
    assert said == 'interrupted\n' * (number is signal.SIGINT)
    assert 'Traceback' not in errors


def test_all_processes_of_the_package_are_of_this_kind() -> None:
    """Also those of `prove`: no other module makes a pool, whose processes would go on."""
    package = Path(__file__).resolve().parents[2] / 'lg_husky_sim'
    makers = {path.name for path in package.rglob('*.py') if re.search(
        r'(ProcessPoolExecutor|multiprocessing\.(Pool|Process))\(',
        path.read_text(encoding='utf-8'))}
    assert makers == {'processes.py'}


def test_a_cluster_named_by_the_environment_takes_the_tasks_and_may_lose_a_worker(
        tmp_path: Path) -> None:
    """All answers in order, none made here; tasks of tasks stay on their worker."""
    pytest.importorskip('distributed')
    program = tmp_path / 'program.py'
    program.write_text(CLUSTER, encoding='utf-8')
    ran = subprocess.run([sys.executable, str(program)], capture_output=True, text=True,
                         timeout=300.0, check=False)
    assert ran.stdout == 'True 1 False [[6, 24], [24, 120]]\n', ran.stderr
