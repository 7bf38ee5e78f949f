# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects that begin at a time or a place, and in one of several recordings."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
import pytest

Maker = Callable[..., Plant]
PULL = Effect('yaw_pull', late=True)


def driven(plant: Plant, forward: float = 0.6, x: float = 0.0) -> TimeSeries:
    commands = TimeSeries(np.zeros(1), np.array([[forward, 0.0]]), ('forward', 'yaw'))
    return rollout(plant, commands, 6.0, 0.02, pose=Pose(x, 0.0, 0.0))


def apart(one: TimeSeries, other: TimeSeries) -> FloatArray:
    """Return the difference of the yaw rates over time [rad/s]."""
    gap: FloatArray = np.abs(one.column('yaw_rate') - other.column('yaw_rate'))
    return gap


@pytest.mark.parametrize('start', [0.0, 2.0, 4.5])
def test_at_a_time(robot: Maker, start: float) -> None:
    """Nominal until then, bit for bit; then what the effect makes of that state."""
    plant = robot(PULL, onset=Onset(OnsetKind.TIME, start), pull_moment=5.0)
    run, base = driven(plant), driven(robot())
    before = run.times <= start + 1e-9
    np.testing.assert_allclose(run.values[before], base.values[before], rtol=0, atol=1e-9)
    gap = apart(run, base)
    first = int(before.sum())
    assert gap[first + 5] > 1e-3
    always = driven(robot('yaw_pull', pull_moment=5.0))
    assert run.column('yaw_rate')[-1] == pytest.approx(always.column('yaw_rate')[-1], rel=0.05)


def test_at_a_place(robot: Maker) -> None:
    base = driven(robot())
    above = driven(robot(PULL, onset=Onset(OnsetKind.PLACE_ABOVE, 1.5), pull_moment=5.0))
    changed = apart(above, base) > 1e-6
    first = int(np.argmax(changed))
    assert above.column('x')[first] >= 1.5 > above.column('x')[first - 1]
    below = driven(robot(PULL, onset=Onset(OnsetKind.PLACE_BELOW, -1.5), pull_moment=5.0), -0.6)
    changed = apart(below, driven(robot(), -0.6)) > 1e-6
    first = int(np.argmax(changed))
    assert below.column('x')[first] <= -1.5 < below.column('x')[first - 1]


def test_leaving_the_place_ends_it(robot: Maker) -> None:
    """A pull where x <= 1: it acts at once, and is gone two metres on."""
    plant = robot(Effect('rolling_resistance', late=True), rolling_force=40.0,
                  onset=Onset(OnsetKind.PLACE_BELOW, 1.0))
    run, base = driven(plant), driven(robot())
    inside = int(np.argmax(run.column('x') > 0.8))
    assert run.column('forward')[inside] < 0.98 * base.column('forward')[inside]
    assert run.column('forward')[-1] == pytest.approx(base.column('forward')[-1], rel=1e-4)


def test_recordings_before_and_after_that_of_the_onset(robot: Maker) -> None:
    onset = Onset(OnsetKind.TIME, 3.0, 'rec2')
    plant = robot(PULL, onset=onset, pull_moment=5.0)
    early = plant.in_recording('rec1', ('rec1',))
    own = plant.in_recording('rec2', ('rec1',))
    later = plant.in_recording('rec3', ('rec1',))
    assert own is plant
    base, always = driven(robot()), driven(robot('yaw_pull', pull_moment=5.0))
    # The late regime carries the effort at size zero in neither: exactly the one or the other.
    np.testing.assert_allclose(driven(early).values, base.values, rtol=0, atol=1e-9)
    np.testing.assert_allclose(driven(later).values, always.values, rtol=0, atol=1e-9)
    assert early.onset is None
    assert later.onset is None


def test_an_onset_without_a_recording_is_in_each(robot: Maker) -> None:
    plant = robot(PULL, onset=Onset(OnsetKind.TIME, 3.0))
    assert plant.in_recording('rec1', ('rec1',)) is plant
    nominal = robot()
    assert nominal.in_recording('rec1') is nominal


def test_sensors_change_at_the_onset_too(robot: Maker) -> None:
    plant = robot(Effect('gyro_bias', late=True), onset=Onset(OnsetKind.TIME, 3.0), gyro_bias=0.1)
    truth = driven(plant)
    extra = plant.observe(truth).column('yaw_rate') - truth.column('yaw_rate')
    np.testing.assert_allclose(extra, np.where(truth.times >= 3.0, 0.1, 0.0), atol=1e-12)
    place = robot(Effect('encoder_scale', 'left', late=True), encoder_factor=1.5,
                  onset=Onset(OnsetKind.PLACE_ABOVE, 1.0))
    base = robot().observe(truth)
    ratio = place.observe(truth).column('wheel_left')[5:] / base.column('wheel_left')[5:]
    np.testing.assert_allclose(ratio, np.where(truth.column('x')[5:] >= 1.0, 1.5, 1.0))


def test_two_effects_and_one_of_them_late(robot: Maker) -> None:
    plant = robot('rolling_resistance', PULL, onset=Onset(OnsetKind.TIME, 3.0), pull_moment=5.0)
    early, late = driven(robot('rolling_resistance')), driven(plant)
    np.testing.assert_allclose(late.values[:151], early.values[:151], rtol=0, atol=1e-9)
    assert apart(late, early)[-1] > 0.01


def test_an_effect_that_is_there_may_change(robot: Maker) -> None:
    """The dead time is that of the base until the onset, and another one from then on."""
    late = Effect('command_latency', late=True, again=True)
    plant = robot('command_latency', late, onset=Onset(OnsetKind.TIME, 2.0), latency=0.1,
                  latency_later=0.5)
    assert [one.command.latency for one in plant.sets] == [0.1, 0.5]
    assert late.parameters()[0].name == 'latency_later'
    assert late.renamed == {'latency': 'latency_later'}


def test_what_was_not_there_cannot_be_there_again(robot: Maker) -> None:
    with pytest.raises(ParameterError, match='command_latency is changed at the onset'):
        robot(Effect('command_latency', late=True, again=True), onset=Onset(OnsetKind.TIME, 2.0))


def test_a_model_has_one_onset() -> None:
    early, late = Onset(OnsetKind.TIME, 3.0, 'rec1'), Onset(OnsetKind.PLACE_ABOVE, 2.5)
    model = Structure().with_effect(Effect('yaw_pull', late=True), late)
    assert model.with_effect(Effect('slope', late=True), late).onset == late
    assert model.with_effect(Effect('slope')).onset == late
    with pytest.raises(ParameterError, match='effect slope has the onset time = 3, but the '
                       r'model place_above = 2\.5: there is one in a model'):
        model.with_effect(Effect('slope', late=True), early)
