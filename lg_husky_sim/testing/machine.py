# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Tests that look at the clock, on machines whose cores are withheld now and then."""

from __future__ import annotations

from collections.abc import Generator
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
            os.write(1, f'{now} {now - before - 0.005}\\n'.encode())
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
        Largest part of the time that a core may be withheld altogether [-].

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
        rows = [(float(moment), float(late)) for moment, late in (
            line.split() for line in whole.splitlines())]
        late = [min(late, moment - begun) for moment, late in rows
                if moment > begun and moment - late < ended]
        if late and max(late) > self.worst:
            return f'a core stood still for {max(late):.2f} s'
        if sum(late) > self.share * (ended - begun):
            return f'a core was withheld for {sum(late) / (ended - begun):.0%} of the time'
        return ''


class PatientClock:
    """
    A plugin of pytest: what fails while the machine was withheld is no verdict on the node.

    Such a test runs again (by pytest-rerunfailures where that is installed), and if the machine
    disturbs every time, it is skipped and says so. What fails on an undisturbed machine has
    failed at once.

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
        self._told = ''

    def disturbed(self) -> bool:
        """Return whether the machine disturbed the last failed test."""
        return bool(self._told)

    def pytest_collection_modifyitems(
            self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Have tests repeated that fail while the machine is withheld."""
        if config.pluginmanager.hasplugin('rerunfailures'):
            again = pytest.mark.flaky(
                reruns=self._repeats, reruns_delay=self._pause, condition=self.disturbed)
            for item in items:
                if item.get_closest_marker(self._marker):
                    item.add_marker(again)

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, None, None]:
        """Note when a test begins."""
        if item.get_closest_marker(self._marker) and self._watch is None:
            self._watch = MachineWatch()
            time.sleep(0.3)
        self._begun = time.monotonic()
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
            self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Turn the last failure on a disturbed machine into a skip that names it."""
        report = yield
        if (self._watch is None or report.when != 'call' or not report.failed
                or not item.get_closest_marker(self._marker)):
            return report
        ended = time.monotonic()
        time.sleep(0.1)
        # Where nobody can watch, such as beside Linux, a failure is a failure.
        self._told = self._watch.disturbed(
            self._begun - 0.5, ended) if self._watch.watches() else ''
        # The plugin that repeats counts from 1; without it the first failure is the last.
        tries = getattr(item, 'execution_count', 1)
        if self._told and (tries > self._repeats or not hasattr(item, 'execution_count')):
            path, line, _ = item.location
            why = call.excinfo.exconly() if call.excinfo else ''
            report.outcome = 'skipped'
            report.longrepr = (path, (line or 0) + 1, (
                f'not judged: {self._told} when it failed, {tries} times: {why}'))
        return report

    def pytest_unconfigure(self) -> None:
        """End the watch."""
        if self._watch is not None:
            self._watch.close()
            self._watch = None
