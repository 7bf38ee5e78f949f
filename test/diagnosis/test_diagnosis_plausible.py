# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Wheel rates in another unit are refused before they pass for wheels off the ground."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.plausible import check_wheel_rates
from lg_husky_sim.errors import DiagnosisError
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest


@pytest.fixture
def one(drive: Callable[..., Recording]) -> Recording:
    return drive('ticks', 'nothing', 1)


def with_rates(recording: Recording, factors: FloatArray | float) -> Recording:
    wheels = recording.stream('wheels')
    values: FloatArray = wheels.values * factors
    return replace(recording, streams={**recording.streams,
                                       'wheels': replace(wheels, values=values)})


def data(recording: Recording) -> Observations:
    return observations(segments(recording))


def test_ticks_are_no_radians(one: Recording) -> None:
    with pytest.raises(DiagnosisError, match=(
            r'^recording ticks: wheel left turns at .* rad/s; up to .* rad/s is possible')):
        diagnose([with_rates(one, 500.0)], load_model(), lambda text, share: None)


def test_degrees_are_no_radians(one: Recording) -> None:
    with pytest.raises(DiagnosisError, match='must be in rad/s'):
        check_wheel_rates(data(with_rates(one, 180.0 / np.pi)), load_model())


@pytest.mark.parametrize('factor', [0.0, 1.0, 3.0, 30.0 / np.pi])
def test_what_a_wheel_may_do_is_not_refused(factor: float, one: Recording) -> None:
    check_wheel_rates(data(with_rates(one, factor)), load_model())


@pytest.mark.parametrize(('share', 'refused'), [(0.02, False), (0.3, True)])
def test_a_few_spikes_are_not_refused(share: float, refused: bool, one: Recording) -> None:
    count = one.stream('wheels').times.size
    spikes = np.where(np.arange(count) % round(1.0 / share) == 0, 1e4, 1.0)[:, None]
    spiked = data(with_rates(one, spikes))
    if refused:
        with pytest.raises(DiagnosisError, match='rad/s'):
            check_wheel_rates(spiked, load_model())
    else:
        check_wheel_rates(spiked, load_model())
