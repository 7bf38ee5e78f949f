# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The main job: a live node, a driver that sends a manoeuvre, a recording of what comes out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.manoeuvres import Manoeuvre
from lg_husky_sim.ros import api
from lg_husky_sim.ros.recorder import NAME, recorded_topics, Recorder
from lg_husky_sim.ros.settings import Settings

#: Longest wait for the first odometry [s]; a plant with many effects waits for the kernel to be
#: compiled for the first time, for most of a minute, and on a busy machine for some.
_START = 300.0
#: Recorded after the driver has ended, until the robot has come to rest [s].
_AFTER = 1.0
#: Longest wait for a child process to end by itself [s].
_END = 10.0


@dataclass(frozen=True)
class Demo:
    """
    What happened.

    Parameters
    ----------
    counts : dict
        Messages of each topic.
    first_odometry : float
        From the start of the node's process to its first odometry [s].
    exit_code : int
        Of the node after Ctrl-C.

    """

    counts: dict[str, int]
    first_odometry: float
    exit_code: int


def _end(process: subprocess.Popen[bytes]) -> int:
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        return process.wait(_END)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def run_demo(manoeuvre: Manoeuvre, bag: Path, settings: Settings, model: str = '',
             progress: Callable[[float], object] | None = None) -> Demo:
    """
    Start the node and the driver as processes of their own and record beside them.

    Parameters
    ----------
    manoeuvre : Manoeuvre
        A built-in one.
    bag : Path
        Folder to make.
    settings : Settings
        Of the node.
    model : str
        Model file of the node; empty for the packaged Husky.
    progress : callable, optional
        Receives the seconds since the driver's start.

    Returns
    -------
    Demo

    Raises
    ------
    RecordingError
        If the node does not come up or the driver fails.

    """
    api.init(args=[])
    node = api.Node(NAME)
    executor = api.SingleThreadedExecutor()
    executor.add_node(node)
    recorder = Recorder(node, bag, recorded_topics(settings))
    odometry = node.resolve_topic_name(settings.odometry_topic)
    options = ['-p', f'preset:={settings.preset}', *(['-p', f'model:={model}'] if model else [])]
    start = time.monotonic()
    children = [subprocess.Popen(  # noqa: S603
        [sys.executable, '-m', 'lg_husky_sim.ros.sim_node', '--ros-args', *options])]
    try:
        while recorder.counts[odometry] == 0:
            executor.spin_once(timeout_sec=0.05)
            if children[0].poll() is not None or time.monotonic() - start > _START:
                raise RecordingError(f'no odometry from sim_node within {_START:g} s')
        first = time.monotonic() - start
        children.append(subprocess.Popen(  # noqa: S603
            [sys.executable, '-m', 'lg_husky_sim.cli.main', 'drive', manoeuvre.name, '--preset',
             settings.preset, '--namespace', '/'],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE))
        begun, ended = time.monotonic(), 0.0
        while not ended or time.monotonic() < ended + _AFTER:
            executor.spin_once(timeout_sec=0.05)
            if not ended and children[1].poll() is not None:
                ended = time.monotonic()
            if progress is not None:
                progress(min(time.monotonic() - begun, manoeuvre.duration))
        if children[1].returncode != 0:
            text = (children[1].stderr.read() if children[1].stderr else b'').decode()
            raise RecordingError(f'the driver failed: {text.strip().splitlines()[-1:]}')
        code = _end(children[0])
        recorder.close()
        return Demo(recorder.counts, first, code)
    finally:
        for child in children:
            _end(child)
            if child.stderr is not None:
                child.stderr.close()
        recorder.close(keep=False)
        executor.shutdown()
        node.destroy_node()
        api.try_shutdown()


def isolate(environment: dict[str, str] | os._Environ[str], domain: int) -> None:
    """Keep to this machine, in a domain of our own, unless the user has chosen otherwise."""
    if 'ROS_DOMAIN_ID' not in environment:
        environment['ROS_DOMAIN_ID'] = str(domain)
    if 'ROS_AUTOMATIC_DISCOVERY_RANGE' not in environment:
        environment['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
