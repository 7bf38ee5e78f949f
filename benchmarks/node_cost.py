# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a step of the live node costs, and where; beside the smallest node that says as much.

Times are processor times, which other work on the machine hardly changes; latencies are not.

    python benchmarks/node_cost.py [--rate 50] [--seconds 20]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
import os
from pathlib import Path
import signal
import statistics
import subprocess
import sys
import time
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.ros.engine import Engine
from lg_husky_sim.ros.outputs import Outputs
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.ros.simulation_node import SimNode
from lg_husky_sim.signals import BodyTwist
from lg_husky_sim.simulation.compiling import compile_here
from lg_husky_sim.testing.live import isolated_domain, Probe

HERE = Path(__file__).resolve().parent


def microseconds(work: Callable[[], object], count: int = 3000) -> float:
    """Return the median processor time of a call [µs] over batches of a hundred."""
    batches = []
    for _ in range(count // 100):
        begun = time.process_time()
        for _ in range(100):
            work()
        batches.append((time.process_time() - begun) / 100.0 * 1e6)
    return statistics.median(batches)


class Silent:
    """Stands for a publisher: takes messages and sends nothing."""

    def publish(self, message: Any) -> None:
        """Do nothing."""


def split() -> dict[str, float]:
    """Return the cost of each part of a step [µs]."""
    # Without machine code on disk, steps would be made in plain Python for a while.
    compile_here()
    settings = make_settings(command_timeout=0.0)
    engine = Engine(settings)
    engine.command(BodyTwist(0.5, 0.4))
    engine.step()
    simulator, state = engine._simulator, engine.state
    physics = microseconds(lambda: simulator.step(state, BodyTwist(0.5, 0.4)))
    whole_engine = microseconds(engine.step)
    api.init(args=[])
    node = api.Node('cost')
    outputs = Outputs(node, settings)
    stamp = 1_700_000_000_000_000_000
    sending = microseconds(lambda: outputs.publish(engine.reading, stamp))
    names = [name for name, value in vars(outputs).items() if hasattr(value, 'publish')]
    kept = {name: getattr(outputs, name) for name in names}
    for name in names:
        setattr(outputs, name, Silent())
    building = microseconds(lambda: outputs.publish(engine.reading, stamp))
    for name, value in kept.items():
        setattr(outputs, name, value)
    node.destroy_node()
    api.shutdown()
    return {'physics': physics, 'odometry, sensors': whole_engine - physics,
            'messages': building, 'serialising, middleware': sending - building}


def waiting() -> dict[str, float]:
    """Return what a wait of the executor costs where nothing has come [µs], by kind of node."""
    api.init(args=[])
    found = {}
    for name, node in (('sim_node', SimNode('cost')), ('node without anything', api.Node('bare'))):
        executor = api.SingleThreadedExecutor()
        executor.add_node(node)
        # rclpy's nodes have their timers as a property.
        timers: Any = node.timers
        for timer in list(timers if api.HAVE_RCLPY else timers()):
            timer.cancel()
        found[name] = microseconds(partial(executor.spin_once, timeout_sec=0.0), 1000)
        executor.shutdown()
        node.destroy_node()
    api.shutdown()
    return found


def cpu_seconds(pid: int) -> float:
    """Return the processor time that a process has used [s]."""
    words = Path(f'/proc/{pid}/stat').read_text(encoding='ascii').rpartition(')')[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf('SC_CLK_TCK')


def live(command: list[str], rate: float, seconds: float) -> dict[str, float]:
    """Run a node; return its processor time a step [µs] and its command latency [ms]."""
    api.init(args=[])
    probe = Probe()
    truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth', 1000)
    joints = probe.listen('sensor_msgs/msg/JointState', '/joint_states', 1000)
    publisher, twist = probe.talk(
        'geometry_msgs/msg/Twist', '/husky_velocity_controller/cmd_vel')
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        if not probe.until(lambda: len(truth) > rate and publisher.get_subscription_count()):
            raise SystemExit(f'{command} does not publish')
        truth.clear()
        begun, used = time.monotonic(), cpu_seconds(process.pid)
        probe.spin(seconds)
        used = cpu_seconds(process.pid) - used
        steps = rate * (time.monotonic() - begun)
        received = len(truth)
        latencies = []
        message = twist()
        for _ in range(200):
            message.linear.x = 0.3 if message.linear.x == 0.0 else 0.0
            before = joints[-1].effort[0]
            publisher.publish(message)
            sent = time.perf_counter()
            rising = message.linear.x > 0.0

            def reacted(before: float = before, rising: bool = rising) -> bool:
                # The torque answers within a step; the speed has the model's own lag.
                now = joints[-1].effort[0]
                return bool(now > before if rising else now < before)

            probe.until(reacted, 2.0)
            latencies.append((time.perf_counter() - sent) * 1e3)
            # Until the model is at rest against the command again.
            probe.spin(0.02 + 0.002 * (len(latencies) % 10))
        process.send_signal(signal.SIGINT)
        process.wait(10.0)
    finally:
        process.kill()
        probe.close()
        api.shutdown()
    latencies.sort()
    return {'cpu': used / steps * 1e6, 'share': used / seconds * 100.0,
            'received': received / steps * 100.0, 'p50': latencies[100], 'p99': latencies[198]}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--rate', type=float, default=50.0)
    parser.add_argument('--seconds', type=float, default=20.0)
    given = parser.parse_args()
    with isolated_domain():
        parts = split()
        whole = sum(parts.values())
        print(api.describe_backend())
        print('cost of a step in one process, six topics')
        for name, value in parts.items():
            print(f'  {name:26s}{value:8.1f} µs {value / whole:7.1%}')
        print(f'  {"all":26s}{whole:8.1f} µs')
        print('a wait of the executor, nothing has come')
        for name, value in waiting().items():
            print(f'  {name:26s}{value:8.1f} µs')
        minimal = live([sys.executable, str(HERE / 'minimal_node.py'), str(given.rate)],
                       given.rate, given.seconds)
        node = live([sys.executable, '-m', 'lg_husky_sim.ros.sim_node', '--ros-args', '-p',
                     f'rate:={given.rate}', '-p', 'command_timeout:=0.0'],
                    given.rate, given.seconds)
    print(f'live at {given.rate:g} Hz for {given.seconds:g} s, one reader')
    print('                        smallest node     sim_node   ratio')
    for key, text in (('cpu', 'processor a step [µs]'), ('share', 'of one core [%]'),
                      ('received', 'steps received [%]'), ('p50', 'latency, median [ms]'),
                      ('p99', 'latency, p99 [ms]')):
        print(f'  {text:24s}{minimal[key]:11.2f}{node[key]:13.2f}{node[key] / minimal[key]:8.2f}')


if __name__ == '__main__':
    main()
