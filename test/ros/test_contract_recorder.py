# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When what a recorder hears was said, and how little of its time it looks around."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
import time

from click.testing import CliRunner
from lg_husky_sim.cli.main import cli
from lg_husky_sim.recording.clock import SKEW_NS
from lg_husky_sim.ros import api
from lg_husky_sim.ros.graph import Endpoint
from lg_husky_sim.ros.recorder import moment, Recorder, SAME_CLOCK, SHARE
from lg_husky_sim.testing.live import Probe
import pytest

pytestmark = pytest.mark.skipif(not any(map(find_spec, ('rosbags', 'rosbag2_py'))),
                                reason='nothing is installed that writes bags')


def test_a_taken_name_is_told_before_a_robot_is_looked_for(tmp_path: Path) -> None:
    # By way of the group: a verb keeps the help option that it had first.
    done = CliRunner().invoke(cli, ['record', str(tmp_path), '--wait', '0'])
    assert str(done.exception) == f'{tmp_path} exists already; choose another name or remove it'


@pytest.fixture
def tapped(probe: Probe, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[
        tuple[Recorder, list[tuple[str, int]]]]:
    """Return a recorder on the probe's node, and topic and time of what it writes."""
    recorder = Recorder(probe.node, tmp_path / 'bag', {
        '/told': 'geometry_msgs/msg/Twist', '/felt': 'sensor_msgs/msg/Imu'})
    written: list[tuple[str, int]] = []
    monkeypatch.setattr(recorder._writer, 'write', lambda *words: written.append(words[:2]))
    yield recorder, written
    recorder.close()


def test_commands_are_logged_as_they_were_sent(
        probe: Probe, tapped: tuple[Recorder, list[tuple[str, int]]]) -> None:
    """Commands of 20 Hz were logged in bursts every 0.3 s, and no fit to them was right."""
    _, written = tapped
    speakers = [probe.talk('geometry_msgs/msg/Twist', '/told'),
                probe.talk('sensor_msgs/msg/Imu', '/felt')]
    assert probe.until(lambda: all(one.get_subscription_count() for one, _ in speakers))
    sent: list[tuple[int, int]] = []
    for _ in range(5):
        begun = time.time_ns()
        for speaker, message in speakers:
            speaker.publish(message())
        sent.append((begun, time.time_ns()))
        time.sleep(0.02)
    heard = time.time_ns()
    assert probe.until(lambda: len(written) == 10)
    told, felt = ([when for topic, when in written if topic == name]
                  for name in ('/told', '/felt'))
    assert all(low <= when <= high for when, (low, high) in zip(told, sent, strict=True))
    # What has a header of its own is logged when it comes.
    assert min(felt) >= heard


def test_the_clock_of_another_machine_does_not_stamp() -> None:
    """Nor what was said before the recorder came, nor a middleware that does not tell."""
    now, limit = 10**18, round(SAME_CLOCK * 1e9)
    assert limit == SKEW_NS
    for sent in (now - limit, now - 1, now + limit):
        assert moment(sent, now) == sent
    for sent in (now - limit - 1, now + limit + 1, 0, -2**63):
        assert moment(sent, now) == now


def test_looks_take_a_small_share_of_the_time(
        probe: Probe, monkeypatch: pytest.MonkeyPatch,
        tapped: tuple[Recorder, list[tuple[str, int]]]) -> None:
    """One took 0.2 s of every 0.1 s with 100 publishers more in the graph."""
    looks, spent = list[str](), 0.0

    def publishers(node: api.Node, topic: str) -> tuple[Endpoint, ...]:
        nonlocal spent
        looks.append(topic)
        begun = time.thread_time()
        while time.thread_time() < begun + 0.01:
            pass
        spent += time.thread_time() - begun
        return (Endpoint('/robot', 'geometry_msgs/msg/Twist', topic == '/felt', False),)
    monkeypatch.setattr('lg_husky_sim.ros.recorder.publishers', publishers)
    begun = time.monotonic()
    assert probe.until(lambda: len(looks) >= 6)
    assert spent < 2.0 * SHARE * (time.monotonic() - begun)
    assert looks == ['/told', '/felt'] * 3
