# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Mistreat a live node and count what is left of it; exits 1 if anything broke.

    python benchmarks/node_robustness.py
"""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.testing.live import LiveHusky, NodeProcess, Probe, probed_domain
import numpy as np

COMMAND = '/husky_velocity_controller/cmd_vel'
STALLED = """
import signal, sys
from lg_husky_sim.ros import api
api.init(args=[])
node = api.Node('stalled')
node.create_subscription(api.message_type('nav_msgs/msg/Odometry'), '/ground_truth', print,
                         api.QoSProfile(depth=1))
executor = api.SingleThreadedExecutor()
executor.add_node(node)
print('ready', flush=True)
signal.pause()
"""
DYING = """
import os, sys
from lg_husky_sim.ros import api
api.init(args=[])
node = api.Node('dying')
kind = api.message_type('geometry_msgs/msg/Twist')
publisher = node.create_publisher(kind, '/husky_velocity_controller/cmd_vel', 10)
executor = api.SingleThreadedExecutor()
executor.add_node(node)
for _ in range(20):
    publisher.publish(kind())
    executor.spin_once(timeout_sec=0.01)
os._exit(9)
"""


class Trial:
    """One node, watched."""

    def __init__(self, probe: Probe) -> None:
        """Start it."""
        self.probe = probe
        self.truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth', 1000)
        self.command, self.twist = probe.talk('geometry_msgs/msg/Twist', COMMAND)
        self.speed, self.number = probe.talk('std_msgs/msg/Float64', '/sim_node/speed')
        self.pose, self.pose_type = probe.talk(
            'geometry_msgs/msg/PoseWithCovarianceStamped', '/initialpose')
        self.husky = LiveHusky(probe)
        self.husky.ready(self.truth)
        probe.until(lambda: self.command.get_subscription_count()
                    and self.speed.get_subscription_count())
        self.broken: list[str] = []

    def steps(self, seconds: float) -> int:
        """Return how many steps come in a time."""
        self.truth.clear()
        self.probe.spin(seconds)
        return len(self.truth)

    def report(self, name: str, figure: str, well: bool) -> None:
        """Print a line and remember what broke."""
        alive = self.husky.node.process.poll() is None
        finite = all(math.isfinite(m.pose.pose.position.x) for m in self.truth)
        well = well and alive and finite
        print(f'{"ok  " if well else "FAIL"} {name:44s}{figure}', flush=True)
        if not well:
            self.broken.append(name)


def burst(trial: Trial) -> None:
    """Send ten thousand commands a second for three seconds."""
    message = trial.twist()
    message.linear.x = 0.2
    trial.truth.clear()
    begun, sent = time.monotonic(), 0
    while (passed := time.monotonic() - begun) < 3.0:
        while sent < passed * 10_000:
            trial.command.publish(message)
            sent += 1
        trial.probe.spin(0.002)
    during = len(trial.truth) / passed
    after = time.monotonic()

    def behind() -> float:
        stamp = trial.truth[-1].header.stamp
        return time.time() - stamp.sec - stamp.nanosec * 1e-9

    well = trial.probe.until(lambda: behind() < 0.1, 10.0) and during > 30.0
    trial.report('10 kHz of commands', f'{sent} sent in 3 s, odometry {during:.1f} Hz meanwhile, '
                 f'in time again {time.monotonic() - after:.2f} s later', well)


def garbage(trial: Trial) -> None:
    """Send huge, tiny, infinite and undefined numbers."""
    random = np.random.default_rng(5)
    message = trial.twist()
    for _ in range(3000):
        message.linear.x, message.angular.z = (
            float(v) for v in random.choice(
                [math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 0.0, 1.0], 2))
        trial.command.publish(message)
    place = trial.pose_type()
    for frame, x in (('nowhere', 1.0), ('odom', math.nan), ('odom', 1e300)):
        place.header.frame_id = frame
        place.pose.pose.position.x = x
        place.pose.pose.orientation.w = 0.0
        trial.pose.publish(place)
    count = trial.steps(1.0)
    place.pose.pose.position.x, place.pose.pose.orientation.w = 0.0, 1.0
    trial.pose.publish(place)
    trial.report('3000 commands of NaN, inf, 1e308', f'{count} steps in 1 s', count > 40)


def storm(trial: Trial) -> None:
    """Change the speed a thousand times."""
    random = np.random.default_rng(6)
    for _ in range(1000):
        trial.speed.publish(trial.number(data=float(random.choice([0.5, 1.0, 3.0, -1.0]))))
    trial.speed.publish(trial.number(data=1.0))
    trial.probe.spin(0.5)
    count = trial.steps(1.0)
    trial.report('1000 changes of the speed', f'{count} steps in the second after',
                 45 < count < 55)


def stalled_reader(trial: Trial) -> None:
    """Let a reliable reader stop for good in the middle."""
    process = subprocess.Popen([sys.executable, '-c', STALLED], stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGSTOP)
    rates = [trial.steps(2.0) / 2.0 for _ in range(4)]
    process.kill()
    process.wait()
    process.stdout.close()
    trial.report('a reliable reader that stands still for 8 s',
                 f'odometry {min(rates):.1f} to {max(rates):.1f} Hz', min(rates) > 42)


def dying_writers(trial: Trial) -> None:
    """Let publishers of commands crash."""
    for _ in range(5):
        subprocess.run([sys.executable, '-c', DYING], check=False)
    count = trial.steps(1.0)
    trial.report('5 publishers that crash', f'{count} steps in 1 s', count > 40)


def twins(trial: Trial) -> None:
    """Start a second node of the same name, and end it."""
    second = NodeProcess()
    trial.probe.spin(3.0)
    code = second.stop()
    count = trial.steps(1.0)
    trial.report('a second node of the same name', f'{count} steps in 1 s after it, exit {code}',
                 count > 40 and code == 0)


def stopped(trial: Trial) -> None:
    """Stop the node itself for five seconds."""
    trial.truth.clear()
    begun = time.monotonic()
    trial.husky.node.process.send_signal(signal.SIGSTOP)
    trial.probe.spin(5.0)
    trial.husky.node.process.send_signal(signal.SIGCONT)
    trial.probe.spin(3.0)
    expected = (time.monotonic() - begun) * 50.0
    count = len(trial.truth)
    trial.report('the node stopped for 5 s', f'{count} steps, {expected:.0f} periods',
                 abs(count - expected) < 6)


def caught(pid: int, number: signal.Signals) -> bool:
    """Return whether a process has a handler of its own for a signal."""
    text = Path(f'/proc/{pid}/status').read_text(encoding='ascii')
    mask = next(line for line in text.splitlines() if line.startswith('SigCgt'))
    return bool(int(mask.split()[1], 16) >> (number - 1) & 1)


def signals(trial: Trial) -> None:
    """End thirty nodes at moments spread over start and run."""
    codes: dict[int, int] = {}
    for number in range(30):
        node = NodeProcess({'odometry_topic': '/other', 'ground_truth_topic': '/another'})
        # Before main() there is nothing of ours that could take the signal.
        while not caught(node.process.pid, signal.SIGTERM):
            time.sleep(0.005)
        time.sleep(0.08 * number)
        code = node.stop(signal.SIGINT if number % 2 else signal.SIGTERM)
        codes[code] = codes.get(code, 0) + 1
    trial.report('30 nodes ended at any moment', f'exit codes {codes}', set(codes) == {0})


ALL: tuple[Callable[[Trial], None], ...] = (
    burst, garbage, storm, stalled_reader, dying_writers, twins, stopped, signals)


def main() -> int:
    """Run all trials."""
    with probed_domain() as probe:
        print(api.describe_backend())
        trial = Trial(probe)
        for one in ALL:
            one(trial)
        code: Any = trial.husky.node.stop()
        print(f'exit code of the node after all this: {code}')
    return 1 if trial.broken or code != 0 else 0


if __name__ == '__main__':
    sys.exit(main())
