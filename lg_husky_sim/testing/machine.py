# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Tests that look at the clock, on machines whose cores are withheld now and then."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from types import TracebackType

from lg_husky_sim.errors import SettingsError
import pytest

#: A thread on each core that wants to wake every 5 ms, and says by how much it was late.
_WATCHERS = """
import os, threading, time
def watch(core):
    os.sched_setaffinity(0, {core})
    while True:
        before = time.monotonic()
        time.sleep(0.005)
        now = time.monotonic()
        if now - before > 0.007:
            os.write(1, f'{core} {now} {now - before - 0.005}\\n'.encode())
cores = sorted(os.sched_getaffinity(0))
for core in cores[1:]:
    threading.Thread(target=watch, args=(core,), daemon=True).start()
watch(cores[0])
"""


class MachineWatch:
    """
    A process that notices when this machine's cores are withheld (Linux).

    A virtual machine whose host is busy stands still for tenths of a second, and whoever
    measures a live node then measures the host. This process does nothing but wake every 5 ms
    on every core, so that its lateness is the machine's and not the node's.

    Parameters
    ----------
    worst : float
        Longest standstill that still counts as undisturbed [s].
    share : float
        Largest part of the time for which any core may be withheld altogether [-].

    """

    def __init__(self, worst: float = 0.05, share: float = 0.15) -> None:
        """Start it; close it with :meth:`close` or a ``with`` block."""
        self.worst, self.share = worst, share
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the object)
        self._process = subprocess.Popen(  # noqa: S603
            [sys.executable, '-S', '-c', _WATCHERS], stdout=self._log)

    def __enter__(self) -> MachineWatch:
        """Return itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        """End the process."""
        self.close()

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        self._log.close()

    def watches(self) -> bool:
        """Return whether the process lives."""
        return self._process.poll() is None

    def disturbed(self, begun: float, ended: float) -> str:
        """
        Return how the machine disturbed a stretch of time.

        Parameters
        ----------
        begun, ended : float
            By :func:`time.monotonic` [s]; ``ended`` lies in the past by 10 ms or more.

        Returns
        -------
        str
            Empty if it did not.

        Raises
        ------
        SettingsError
            If nobody watches.

        """
        if not self.watches():
            raise SettingsError('nobody watches this machine: that ended, or never began')
        # Not by seeking: reader and writer share one place in the file.
        said = os.pread(self._log.fileno(), os.fstat(self._log.fileno()).st_size, 0)
        whole = said[:said.rfind(b'\n') + 1].decode()
        late: dict[str, list[float]] = {}
        for core, moment, lateness in (line.split() for line in whole.splitlines()):
            since = max(float(moment) - float(lateness), begun)
            until = min(float(moment), ended)
            if until > since:
                late.setdefault(core, []).append(until - since)
        longest = max((max(each) for each in late.values()), default=0.0)
        share = max((sum(each) for each in late.values()), default=0.0) / (ended - begun)
        if longest > self.worst:
            return f'a core stood still for {longest:.2f} s'
        return f'a core was withheld for {share:.0%} of the time' if share > self.share else ''


class PatientClock:
    """
    A plugin of pytest: what fails while the machine was withheld is asked again.

    It needs pytest-rerunfailures to repeat a test. What fails on an undisturbed machine, or every
    time, has failed.

    Parameters
    ----------
    marker : str
        The marker of the tests that look at the clock.
    repeats : int
        How often one is repeated at most.
    pause : float
        Before a repetition [s].

    """

    def __init__(self, marker: str = 'realtime', repeats: int = 4, pause: float = 2.0) -> None:
        """Begin to watch with the first such test."""
        self._marker, self._repeats, self._pause = marker, repeats, pause
        self._watch: MachineWatch | None = None
        self._begun = 0.0

    def disturbed(self) -> bool:
        """Return whether the machine disturbed the test that ended last; no if nobody can tell."""
        if self._watch is None or not self._watch.watches():
            return False
        ended = time.monotonic()
        time.sleep(0.1)
        return bool(self._watch.disturbed(self._begun - 0.5, ended))

    def pytest_collection_modifyitems(
            self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Have tests repeated that fail while the machine is withheld."""
        if config.pluginmanager.hasplugin('rerunfailures'):
            again = pytest.mark.flaky(
                reruns=self._repeats, reruns_delay=self._pause, condition=self.disturbed)
            for item in items:
                if item.get_closest_marker(self._marker):
                    item.add_marker(again)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Note when a test begins, its fixtures included."""
        if item.get_closest_marker(self._marker) and self._watch is None:
            self._watch = MachineWatch()
            time.sleep(0.3)
        self._begun = time.monotonic()

    def pytest_unconfigure(self) -> None:
        """End the watch."""
        if self._watch is not None:
            self._watch.close()
            self._watch = None
