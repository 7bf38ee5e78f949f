# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is hidden is named, and what must not matter does not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.diagnose import Case, diagnose
from lg_husky_sim.diagnosis.result import Diagnosis, Verdict
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

PARTS = ('command', 'electrical', 'drivetrain', 'translation', 'rotation', 'sensor')
#: Hidden for the invariances: quick, and seen by one sensor only.
ONE = 'sensor'


def said(recordings: Sequence[Recording], jobs: int = 1) -> Diagnosis:
    """Return what is said of recordings."""
    return diagnose(recordings, load_model(), lambda text, share: None, jobs=jobs).diagnosis


def shifted(recording: Recording, by: float) -> Recording:
    """Return a recording whose clock has another zero."""
    return replace(recording, streams={
        name: TimeSeries(s.times + by, s.values, s.names)
        for name, s in recording.streams.items()})


def thinned(recording: Recording, stream: str) -> Recording:
    """Return a recording with every second reading of a stream."""
    own = recording.streams[stream]
    return replace(recording, streams={
        **recording.streams, stream: TimeSeries(own.times[::2], own.values[::2], own.names)})


@pytest.fixture(scope='module')
def pair(drive: Callable[..., Recording], short: float) -> list[Recording]:
    """Return the two drives with one hidden effect that are diagnosed as they are, too."""
    return [drive('ahead', ONE, 1, share=short), drive('back', ONE, 2, True, short)]


@pytest.mark.parametrize('part', PARTS)
def test_hidden_effect_is_named_with_its_side_and_size(
        part: str, diagnosed: Callable[[str], Case],
        hidden: Mapping[str, tuple[Effect | None, dict[str, float]]]) -> None:
    effect, sizes = hidden[part]
    assert effect is not None
    found = diagnosed(part).diagnosis
    assert found.verdict is Verdict.KNOWN
    assert [(f.effect, f.subsystem) for f in found.findings] == [
        (effect.id, effect.kind.subsystem.value)]
    if effect.side in ('left', 'right'):
        assert found.findings[0].side == effect.side
        assert found.findings[0].elements == {'left': ('J_LW',), 'right': ('J_RW',)}[effect.side]
    for one in found.findings[0].parameters:
        if one.name in sizes:
            assert one.value == pytest.approx(sizes[one.name], rel=0.25)
            assert one.low <= one.value <= one.high


def test_nothing_is_nothing(diagnosed: Callable[[str], Case]) -> None:
    found = diagnosed('nothing').diagnosis
    assert found.verdict is Verdict.NOTHING_MISSING
    assert not found.findings
    values = {e.name: e for e in found.recalibration}
    assert values['wheel_damping'].value == pytest.approx(1.3, rel=0.1)
    assert values['yaw_damping'].value == pytest.approx(14.0, rel=0.1)


def test_order_of_recordings_and_zero_of_their_clocks_change_nothing(
        pair: list[Recording], diagnosed: Callable[[str], Case]) -> None:
    first = diagnosed(ONE).diagnosis.findings[0]
    other = said([shifted(r, 64.0) for r in pair[::-1]]).findings[0]
    assert (other.effect, other.side) == (first.effect, first.side)
    assert other.held_out_gain == pytest.approx(first.held_out_gain, rel=0.02)
    assert other.parameters[0].value == pytest.approx(first.parameters[0].value, rel=0.005)


def test_half_of_the_readings_of_the_gyro_keep_the_name(
        pair: list[Recording], diagnosed: Callable[[str], Case]) -> None:
    first = diagnosed(ONE).diagnosis.findings[0]
    other = said([thinned(r, 'imu') for r in pair]).findings[0]
    assert (other.effect, other.side) == (first.effect, first.side)


def test_number_of_threads_does_not_change_a_bit(
        pair: list[Recording], diagnosed: Callable[[str], Case]) -> None:
    one, two = diagnosed(ONE).diagnosis, said(pair, jobs=2)
    assert [f.held_out_gain for f in one.findings] == [f.held_out_gain for f in two.findings]
    assert one.confidence == two.confidence
    assert one.recalibration == two.recalibration
    assert dict(one.augmented) == dict(two.augmented)
    assert np.isfinite(one.confidence)
