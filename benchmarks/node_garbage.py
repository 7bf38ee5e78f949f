# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Another participant's garbage on every topic and service of a live node; exits 1 if it breaks.

    python benchmarks/node_garbage.py [--count 300] [--seed 1]
    ROS_DOMAIN_ID=42 python benchmarks/node_garbage.py --attach    # to a node that runs there
    … --attach --topics                                            # no services

Three kinds go to each endpoint: fields filled at random with the ends of their ranges, NaN, wrong
texts and names of parameters; bytes of such messages, damaged; and bytes by a writer that lies
about their type. What the middleware itself does not let through is counted. The participant is
the embedded backend (an interpreter without ROS); the node may be any. Afterwards the node must
answer to the control topics, step at its rate with finite numbers, and end with 0.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
import math
import os
from pathlib import Path
import random
import sys
import time
from typing import Any

from cyclonedds.core import DDSException
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from fuzz import damaged_bytes, WORDS
from lg_husky_sim.ros import api
from lg_husky_sim.ros.control import SERVICES, TOPICS
from lg_husky_sim.ros.embedded.context import default_context
from lg_husky_sim.ros.embedded.definitions import store
from lg_husky_sim.ros.embedded.idl import dds_type_name, sample_type
from lg_husky_sim.ros.embedded.messages import Message, message_class, serialise
from lg_husky_sim.ros.embedded.qos import dds_qos, DurabilityPolicy, QoSProfile
from lg_husky_sim.ros.settings import BY_NAME, make_settings
from lg_husky_sim.testing.live import isolated_domain, NodeProcess, Probe

NODE = '/sim_node'
PARAMETERS = ('GetParameters', 'GetParameterTypes', 'SetParameters', 'SetParametersAtomically',
              'ListParameters', 'DescribeParameters')
FLOATS = (math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, -0.0, 0.0, 1.0, -3.0, 0.5)
#: Bytes of a writer that lies are of these lengths at most.
LONGEST = 2000
#: Longest time until the node steps at its rate again [s].
RECOVERED = 30.0


def endpoints(simulated: bool, services: bool) -> Iterator[tuple[str, str, bool]]:
    """Yield name and type of what the node listens to, and whether it is a service."""
    one = make_settings()
    if simulated:
        yield '/clock', 'rosgraph_msgs/msg/Clock', False
        return
    yield f'/{one.command_topic}', f'geometry_msgs/msg/{one.command_type}', False
    yield f'/{one.initial_pose_topic}', 'geometry_msgs/msg/PoseWithCovarianceStamped', False
    yield f'/{one.map_topic}', 'nav_msgs/msg/OccupancyGrid', False
    for name, kind, _ in TOPICS:
        yield f'{NODE}/{name}', kind, False
    if not services:
        return
    for name, kind, _ in SERVICES:
        yield f'{NODE}/{name}', kind, True
    for kind in PARAMETERS:
        name = ''.join(f'_{c.lower()}' if c.isupper() else c for c in kind).lstrip('_')
        yield f'{NODE}/{name}', f'rcl_interfaces/srv/{kind}', True


def number(kind: str, draw: random.Random) -> Any:
    """Return a value of a basic type, often one of the ends of its range."""
    if kind == 'string':
        return draw.choice((*WORDS, *BY_NAME)).encode(errors='ignore').decode()
    if kind == 'bool':
        return draw.random() < 0.5
    if kind.startswith('float'):
        value = draw.choice(FLOATS) if draw.random() < 0.5 else draw.gauss(0.0, 3.0)
        return value if kind == 'float64' or not abs(value) < math.inf else math.copysign(
            min(abs(value), 3e38), value)
    bits = 8 if kind in ('byte', 'char') else int(kind.lstrip('uint'))
    low, high = (0, 2 ** bits - 1) if kind[0] in 'ubc' else (-2 ** (bits - 1), 2 ** (bits - 1) - 1)
    return draw.choice((low, high, 0, 1, draw.randint(low, high), draw.randint(0, 60)))


def drawn(kind: int, rest: Any, draw: random.Random) -> Any:
    """Return a value for a field of a type."""
    if kind == 1:
        return number(rest[0], draw)
    if kind == 2:
        return filled(rest, draw)
    (subkind, subrest), count = rest
    length = count if kind == 3 else draw.choice((0, 1, 2, 7, 50))
    return [drawn(int(subkind), subrest, draw) for _ in range(length)]


def filled(name: str, draw: random.Random) -> Message:
    """Return a message with all fields filled at random."""
    made = message_class(name)
    return made(**{field: drawn(int(kind), rest, draw)
                   for field, (kind, rest) in store().fielddefs[name][1]})


class Sender:
    """
    Writers of one endpoint.

    Parameters
    ----------
    name : str
        Of topic or service.
    kind : str
        Its type.
    service : bool
    tally : Counter
        What became of all messages.

    """

    def __init__(self, name: str, kind: str, service: bool, tally: Counter[str]) -> None:
        """Make the honest writer."""
        self.kind = f'{kind}_Request' if service else kind
        message_class(self.kind)
        self._service, self._tally = service, tally
        self._topic = f'rq{name}Request' if service else f'rt{name}'
        self._quality = dds_qos(QoSProfile(
            depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL if name == '/map'
            else DurabilityPolicy.VOLATILE), '', writer=True)
        context = default_context()
        self._sample: Any = sample_type(self.kind, header=service)
        self.writer: DataWriter[Any] = DataWriter(
            context.participant, context.topic(self._topic, self.kind, header=service),
            self._quality)

    def body(self, draw: random.Random) -> bytes:
        """Return a filled message as CDR, behind a request's identity where there is one."""
        data = serialise(filled(self.kind, draw))
        return data[:4] + (draw.randbytes(16) if self._service else b'') + data[4:]

    def _write(self, writer: DataWriter[Any], sample: Any, what: str) -> None:
        try:
            writer.write(sample)
            self._tally[f'{what}, sent'] += 1
        except DDSException:
            self._tally[f'{what}, not let out by the middleware'] += 1

    def send(self, draw: random.Random, what: str) -> None:
        """Send garbage of one kind."""
        data = self.body(draw)
        if what == 'damaged':
            data = damaged_bytes(data, draw)
        self._write(self.writer, self._sample(data), what)

    def lie(self, draw: random.Random) -> None:
        """Send damaged bytes as octets of a type that has the right name only."""
        data = damaged_bytes(self.body(draw), draw)[4:4 + LONGEST]
        if not data:
            return
        generic: Any = types
        fields = {'octets': generic.array[types.uint8, len(data)]}
        kind: Any = make_idl_struct('Lie', dds_type_name(self.kind), fields)
        writer: DataWriter[Any] = DataWriter(default_context().participant, Topic(
            default_context().participant, self._topic, kind), self._quality)
        end = time.monotonic() + 0.2
        while time.monotonic() < end and not writer.get_matched_subscriptions():
            time.sleep(0.005)
        if writer.get_matched_subscriptions():
            self._write(writer, kind(list(data)), 'of a wrong type')
            time.sleep(0.02)
        else:
            self._tally['of a wrong type, not matched by the middleware'] += 1


def resident(pid: int) -> float:
    """Return a process's memory [MB]."""
    text = Path(f'/proc/{pid}/status').read_text(encoding='ascii')
    return int(next(r for r in text.splitlines() if r.startswith('VmRSS')).split()[1]) / 1024.0


def recovered(probe: Probe, truth: list[Any], simulated: bool) -> tuple[int, float, bool]:
    """
    Put the node in order by its own topics.

    Returns
    -------
    int, float, bool
        Its steps in the first second in which they come at its rate, how long that took [s], and
        whether all numbers of that second are finite.

    """
    begun = time.monotonic()
    if simulated:
        clock, kind = probe.talk('rosgraph_msgs/msg/Clock', '/clock')
    else:
        orders = [(probe.talk(f'std_msgs/msg/{kind}', f'{NODE}/{name}'), value)
                  for name, kind, value in (('load_model', 'String', ''), ('pause', 'Bool', False),
                                            ('speed', 'Float64', 1.0), ('reset', 'Bool', True))]
        for (publisher, made), value in orders:
            probe.until(publisher.get_subscription_count)
            publisher.publish(made(data=value))
            probe.spin(0.3)
    while True:
        truth.clear()
        second = time.monotonic()
        while time.monotonic() - second < 1.0:
            if simulated:
                message, passed = kind(), time.monotonic() - begun
                message.clock.sec, part = int(5.0 + passed), passed % 1.0
                message.clock.nanosec = int(part * 1e9)
                clock.publish(message)
            probe.spin(0.01)
        if 45 <= len(truth) <= 55 or time.monotonic() - begun > RECOVERED:
            break
    finite = all(math.isfinite(value) for message in truth for value in (
        message.pose.pose.position.x, message.pose.pose.position.y,
        message.twist.twist.linear.x, message.twist.twist.angular.z))
    return len(truth), time.monotonic() - begun, finite


def trial(count: int, seed: int, *, simulated: bool, attach: bool, services: bool = True) -> bool:
    """Send garbage to one node and say what is left of it."""
    node = None if attach else NodeProcess(
        {'scan': 'map', 'use_sim_time': simulated}, environment={
            'RMW_IMPLEMENTATION': 'rmw_cyclonedds_cpp'})
    api.init(args=[])
    probe, tally = Probe('garbage'), Counter[str]()
    try:
        truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth', 1000)
        senders = [Sender(name, kind, service, tally)
                   for name, kind, service in endpoints(simulated, services)]
        deaf = [sender.kind for sender in senders if not probe.until(
            sender.writer.get_matched_subscriptions, 30.0)]
        before = resident(node.process.pid) if node else math.nan
        draw = random.Random(seed)
        for _ in range(count):
            for sender in senders:
                sender.send(draw, 'filled at random')
                sender.send(draw, 'damaged')
            probe.spin(0.01)
        for _ in range(max(1, count // 50)):
            for sender in senders:
                sender.lie(draw)
        steps, took, finite = recovered(probe, truth, simulated)
        after = resident(node.process.pid) if node and node.process.poll() is None else math.nan
        code = node.stop() if node else 0
    finally:
        probe.close()
        api.shutdown()
        if node:
            node.stop()
    well = 45 <= steps <= 55 and finite and code == 0
    print(f'{len(senders)} endpoints{" (/clock)" if simulated else ""}'
          f'{f", of which nobody listens to {deaf}" if deaf else ""}:')
    for what, number_of in sorted(tally.items()):
        print(f'  {number_of:7d} {what}')
    print(f'  {"ok  " if well else "FAIL"} {steps} steps a second {took:.1f} s after, '
          f'{"finite" if finite else "not finite"}, exit code {code}, memory {before:.0f} to '
          f'{after:.0f} MB', flush=True)
    if not well and node:
        print(node.log()[-3000:])
    return well


def main() -> int:
    """Run the trials."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--count', type=int, default=300, help='messages of a kind an endpoint')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--attach', action='store_true', help='to the node of ROS_DOMAIN_ID')
    parser.add_argument('--topics', action='store_true', help='no services')
    given = parser.parse_args()
    if api.HAVE_RCLPY:
        parser.error('an interpreter without ROS is needed; the node may be any: --attach')
    if given.attach:
        os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        return int(not trial(given.count, given.seed, simulated=False, attach=True,
                             services=not given.topics))
    with isolated_domain():
        broken = sum(not trial(given.count, given.seed, simulated=simulated, attach=False)
                     for simulated in (False, True))
    return int(broken > 0)


if __name__ == '__main__':
    sys.exit(main())
