# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Tasks on processes and clusters: same results, and no worker outlives the one who asked."""

from __future__ import annotations

import math
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

from lg_husky_sim.errors import BackendError, MissingExtraError
from lg_husky_sim.parallel import map_tasks, run_tasks
import pytest

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = """
import os, signal, time
from lg_husky_sim.parallel import map_tasks

def rest(seconds):
    time.sleep(seconds)
    return os.getpid()

signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    answers = map_tasks(rest, [0.1, 300, 300], jobs=2)
    print(next(answers), flush=True)
    ASK_ON
except KeyboardInterrupt:
    print('interrupted', flush=True)
"""

CLUSTER = """
import math, os, signal, time
import distributed
from lg_husky_sim.parallel import run_tasks

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


@pytest.mark.parametrize('then', ['next(answers)', 'time.sleep(300)'])
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_process_outlives_the_one_who_asked(
        number: signal.Signals, then: str, tmp_path: Path) -> None:
    """
    Asked to stop or killed, while a task would go on for minutes; and without a traceback.

    Ctrl-C goes to the workers too, as in a terminal. The program needs no guard of its main.
    """
    program = tmp_path / 'program.py'
    program.write_text(PROGRAM.replace('ASK_ON', then), encoding='utf-8')
    with subprocess.Popen([sys.executable, str(program)], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, start_new_session=True) as asked:
        assert asked.stdout is not None
        child = Path('/proc') / asked.stdout.readline().strip()
        assert child.exists()
        if number is signal.SIGINT:
            os.killpg(asked.pid, number)
        else:
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
    """Also those of `prove`: no module makes a pool of processes, which would go on."""
    makers = {path.name for path in (ROOT / 'lg_husky_sim').rglob('*.py') if re.search(
        r'(ProcessPoolExecutor|multiprocessing\.(Pool|Process)|Parallel)\(',
        path.read_text(encoding='utf-8'))}
    assert makers == {'parallel.py'}


def die(number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_a_worker_that_is_killed_is_one_line() -> None:
    with pytest.raises(BackendError, match=r'^a worker process was killed, .* fewer than 2 jobs$'):
        run_tasks(die, [1, 2], jobs=2)


def test_outcomes_come_one_by_one_in_threads_too() -> None:
    """The first is there while the last has not begun."""
    begun = []

    def begin(number: int) -> int:
        begun.append(number)
        time.sleep(0.05)
        return number

    found = map_tasks(begin, range(40), jobs=2, threads=True)
    assert next(found) == 0
    assert len(begun) < 10
    assert list(found) == list(range(1, 40))


def test_a_cluster_named_by_the_environment_takes_the_tasks_and_may_lose_a_worker(
        tmp_path: Path) -> None:
    """All answers in order, none made here; tasks of tasks stay on their worker."""
    pytest.importorskip('distributed')
    program = tmp_path / 'program.py'
    program.write_text(CLUSTER, encoding='utf-8')
    ran = subprocess.run([sys.executable, str(program)], capture_output=True, text=True,
                         timeout=300.0, check=False)
    assert ran.stdout == 'True 1 False [[6, 24], [24, 120]]\n', ran.stderr


def test_ray_takes_the_tasks_where_it_is_installed(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Ray's own cluster of two, which it starts by itself."""
    ray = pytest.importorskip('ray')
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        monkeypatch.setenv('LG_HUSKY_BACKEND', f'ray:{ray.get_runtime_context().gcs_address}')
        assert run_tasks(math.factorial, [3, 4, 5]) == [6, 24, 120]
        assert str(os.getpid()) not in run_tasks(os.readlink, ['/proc/self', '/proc/self'])
    finally:
        ray.shutdown()


@pytest.mark.parametrize('address', ['127.0.0.1:9', 'ray://127.0.0.1:9', 'nowhere'])
def test_a_ray_cluster_that_does_not_answer_is_one_line(
        address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('lg_husky_sim.extras.find_spec', lambda name: name)
    monkeypatch.setenv('LG_HUSKY_BACKEND', f'ray:{address}')
    with pytest.raises(BackendError, match=f"^no Ray cluster answers at '{address}'$"):
        run_tasks(math.factorial, [1, 2])


def test_a_cluster_whose_library_is_missing_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('lg_husky_sim.extras.find_spec', lambda name: None)
    for backend, library in (('dask:tcp://x:1', 'distributed'), ('ray:x:1', 'ray')):
        monkeypatch.setenv('LG_HUSKY_BACKEND', backend)
        with pytest.raises(MissingExtraError, match=f'^{library} is needed to use a '):
            run_tasks(math.factorial, [1, 2])


@pytest.mark.parametrize('backend', ['dask', 'dask:', 'spark:x', 'threads'])
def test_a_backend_that_is_none_is_one_line(
        backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('LG_HUSKY_BACKEND', backend)
    with pytest.raises(BackendError, match=f"LG_HUSKY_BACKEND = '{backend}' is not allowed"):
        run_tasks(math.factorial, [1, 2])


def test_processes_are_the_backend_of_who_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('LG_HUSKY_BACKEND', 'processes')
    assert run_tasks(math.factorial, [3, 4], jobs=2) == [6, 24]


def test_tasks_keep_their_order_and_their_errors() -> None:
    done: list[int] = []
    assert run_tasks(math.factorial, [4, 1, 3], jobs=2, progress=lambda: done.append(1)) == [
        24, 1, 6]
    assert len(done) == 3
    with pytest.raises(ValueError, match='negative'):
        run_tasks(math.factorial, [1, -3, 2], jobs=2)
