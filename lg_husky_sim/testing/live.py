# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Real nodes in processes of their own, in a domain that nobody else uses."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import signal
import socket
import subprocess
import sys
import tempfile
import time
from typing import Any

from lg_husky_sim.errors import MissingExtraError, SettingsError
from lg_husky_sim.ros import api

#: Domains that are tried; higher ones reach into the ports that Linux hands out by itself.
_DOMAINS = range(10, 100)
#: A socket bound here says that a domain is taken.
_LOCK_PORT = 21_400
#: Longest wait of a probe in one piece [s].
_WAIT = 0.01


@contextmanager
def isolated_domain() -> Iterator[int]:
    """
    Reserve a ROS domain on this machine and keep all traffic on it.

    Yields
    ------
    int
        The domain; ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE are set meanwhile.

    Raises
    ------
    SettingsError
        If all domains are taken.

    """
    names = ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS',
             'ROS_LOCALHOST_ONLY')
    before = {name: os.environ.get(name) for name in names}
    first = os.getpid() % len(_DOMAINS)
    for place in range(len(_DOMAINS)):
        domain = _DOMAINS[(first + place) % len(_DOMAINS)]
        if str(domain) == before['ROS_DOMAIN_ID']:
            # The user's own robot may be there.
            continue
        lock = socket.socket()
        try:
            lock.bind(('127.0.0.1', _LOCK_PORT + domain))
            break
        except OSError:
            lock.close()
    else:
        raise SettingsError('no ROS domain from 10 to 99 is free')
    try:
        for name in names:
            os.environ.pop(name, None)
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        yield domain
    finally:
        lock.close()
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value


class NodeProcess:
    """
    A ``sim_node`` in its own process.

    Parameters
    ----------
    parameters : mapping, optional
        Given with ``-p``.
    arguments : sequence of str
        More after ``--ros-args``, such as remappings.
    environment : mapping, optional
        Variables to add.

    """

    def __init__(self, parameters: Mapping[str, object] | None = None,
                 arguments: Sequence[str] = (), environment: Mapping[str, str] | None = None
                 ) -> None:
        """Start it."""
        words = [sys.executable, '-m', 'lg_husky_sim.ros.sim_node', '--ros-args', *arguments]
        for name, value in (parameters or {}).items():
            text = str(value).lower() if isinstance(value, bool) else str(value)
            words += ['-p', f"{name}:={text or repr('')}"]
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the object)
        self.started = time.monotonic()
        self.process = subprocess.Popen(  # noqa: S603
            words, stdout=self._log, stderr=subprocess.STDOUT,
            env=os.environ | dict(environment or {}))

    def log(self) -> str:
        """Return what the process has said so far."""
        self._log.seek(0)
        return self._log.read().decode(errors='replace')

    def stop(self, number: signal.Signals = signal.SIGINT, timeout: float = 10.0) -> int:
        """
        Send a signal and wait for the end.

        Parameters
        ----------
        number : signal.Signals
            Which.
        timeout : float
            [s]; after it the process is killed.

        Returns
        -------
        int
            Exit code; negative if a signal ended the process.

        """
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()


def _installed(kind: str, topic: str) -> Any:
    """Return a message class; refuse one whose package is not installed."""
    if (found := api.message_type(kind)) is None:
        raise MissingExtraError(f'{topic}: message package {kind.partition("/")[0]} is needed for '
                                f'{kind} and is not installed')
    return found


class Probe:
    """
    A node in the test's process that listens and talks; needs :func:`api.init` before.

    Parameters
    ----------
    name : str

    """

    def __init__(self, name: str = 'probe') -> None:
        """Join the graph."""
        self.node = api.Node(name)
        self._executor = api.SingleThreadedExecutor()
        self._executor.add_node(self.node)

    def listen(self, kind: str, topic: str, qos: Any = 50) -> list[Any]:
        """Return a list that grows with each message of a topic while the probe spins."""
        received: list[Any] = []
        self.node.create_subscription(_installed(kind, topic), topic, received.append, qos)
        return received

    def talk(self, kind: str, topic: str, qos: Any = 10) -> tuple[Any, Any]:
        """Return a publisher and the class of its messages."""
        message = _installed(kind, topic)
        return self.node.create_publisher(message, topic, qos), message

    def spin(self, seconds: float) -> None:
        """Serve callbacks for some time [s]."""
        end = time.monotonic() + seconds
        # Always the same wait: rclpy forgets who is ready when it changes, and then serves the
        # first topics only.
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=_WAIT)

    def until(self, condition: Callable[[], object], timeout: float = 15.0) -> bool:
        """
        Serve callbacks until something is true.

        Parameters
        ----------
        condition : callable
            Called without arguments again and again.
        timeout : float
            Longest wait [s].

        Returns
        -------
        bool
            Whether it became true.

        """
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                return False
            self._executor.spin_once(timeout_sec=_WAIT)
        return True

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.node.destroy_node()


class LiveHusky:
    """
    A live node with a probe beside it.

    Parameters
    ----------
    parameters, arguments, environment
        As for :class:`NodeProcess`.
    probe : Probe

    """

    def __init__(self, probe: Probe, parameters: Mapping[str, object] | None = None,
                 arguments: Sequence[str] = (), environment: Mapping[str, str] | None = None
                 ) -> None:
        """Start the node; :meth:`ready` waits for it."""
        self.probe = probe
        self.node = NodeProcess(parameters, arguments, environment)

    def ready(self, received: list[Any], timeout: float = 30.0) -> None:
        """
        Wait for the first message in a list of :meth:`Probe.listen`.

        Raises
        ------
        SettingsError
            With the node's log, if none comes; the node is ended then.

        """
        def over() -> bool:
            return bool(received) or self.node.process.poll() is not None
        self.probe.until(over, timeout)
        if not received:
            # Whoever fails here has nobody yet who would end it, and others would hear it.
            self.node.stop(signal.SIGTERM)
            raise SettingsError(f'the node did not start: {self.node.log()}')


@contextmanager
def probed_domain() -> Iterator[Probe]:
    """Yield a probe in a domain of its own; everything is torn down at the end."""
    with isolated_domain():
        api.init(args=[])
        try:
            probe = Probe()
            try:
                yield probe
            finally:
                probe.close()
        finally:
            api.try_shutdown()


def write_parameters(path: Path, node: str, values: Mapping[str, object]) -> Path:
    """Write a ROS parameter file for a node and return its path."""
    import yaml
    text = yaml.safe_dump({node: {'ros__parameters': dict(values)}})
    path.write_text(text, encoding='utf-8')
    return path
