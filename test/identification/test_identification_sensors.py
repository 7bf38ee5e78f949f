# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What `identify` says of sensors that contradict each other, and of another robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import json
from pathlib import Path

import lg_husky_sim as lg
from lg_husky_sim.cli.main import run
from lg_husky_sim.recording import write_recording
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest

pytest.importorskip('rosbags')
pytest.importorskip('jinja2')
pytest.importorskip('matplotlib')


@pytest.fixture(scope='module')
def drive() -> lg.Recording:
    return lg.Husky().simulate('obstacle')


def changed(recording: lg.Recording, name: str, change: Callable[[FloatArray], FloatArray]
            ) -> lg.Recording:
    """Return a recording with other values of one stream."""
    series = recording.streams[name]
    return replace(recording, streams={
        **recording.streams, name: replace(series, values=change(series.values))})


def in_degrees(recording: lg.Recording) -> lg.Recording:
    return changed(recording, 'imu', lambda values: values * [np.degrees(1.0), 1.0, 1.0])


def fitted(*recordings: lg.Recording, husky: lg.Husky | None = None, nuisance: tuple[str, ...] = ()
           ) -> lg.Fit:
    return (husky or lg.Husky()).identify(
        list(recordings), free=['command_gain'], nuisance=nuisance, starts=1, progress=False)


def test_a_sound_drive_is_not_warned_of(drive: lg.Recording) -> None:
    assert not any('gyro' in said or 'Husky' in said for said in fitted(drive).warnings)


def test_what_info_says_of_the_sensors_identify_says_too(drive: lg.Recording) -> None:
    degrees = in_degrees(drive)
    fit = fitted(degrees)
    said, = degrees.info().warnings
    assert 'it seems to be in degrees per second' in said
    assert said in fit.warnings
    assert said in str(fit)
    assert said in fit.data()['warnings']


def test_of_several_recordings_the_one_with_the_fault_is_named(drive: lg.Recording) -> None:
    said = [one for one in fitted(drive, replace(in_degrees(drive), name='later')).warnings
            if 'degrees per second' in one]
    assert [one.split(':')[0] for one in said] == ['later']


def test_a_robot_that_is_none_of_the_model_is_called_so(drive: lg.Recording) -> None:
    slow = changed(drive, 'wheels', lambda values: values * 0.55)
    assert any('This is not a Husky' in one for one in fitted(slow).warnings)


def test_what_is_estimated_is_no_fault(drive: lg.Recording) -> None:
    biased = changed(drive, 'imu', lambda values: values + [0.05, 0.0, 0.0])
    assert any('at rest' in one for one in fitted(biased).warnings)
    assert not any('at rest' in one for one in fitted(biased, nuisance=('gyro_bias',)).warnings)
    model = lg.Husky().with_effect('gyro_bias')
    assert not any('at rest' in one for one in fitted(biased, husky=model).warnings)


def test_each_recording_has_its_own_warnings(drive: lg.Recording, tmp_path: Path) -> None:
    bags = [str(write_recording(tmp_path / name, one.streams)) for name, one in (
        ('sound', drive), ('degrees', in_degrees(drive)))]
    out = tmp_path / 'fits'
    assert run(['identify', *bags, '--out', str(out), '--each', '--starts', '1', '--free',
                'command_gain']) == 0
    said = {name: ' '.join(json.loads((out / f'{name}.json').read_text())['warnings'])
            for name in ('sound', 'degrees')}
    assert 'degrees per second' in said['degrees']
    assert 'gyro' not in said['sound']
