# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What bins read beyond the end of a simulation, where streams are early or means are long."""

from __future__ import annotations

from lg_husky_sim.diagnosis.before_after.base import base_of
from lg_husky_sim.diagnosis.before_after.base_names import OUTPUTS
from lg_husky_sim.diagnosis.before_after.drives import drives
from lg_husky_sim.diagnosis.before_after.means import mean_in_bins
from lg_husky_sim.diagnosis.before_after.prediction import predicted
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest


@pytest.mark.parametrize(('goes_on', 'expected'), [
    (True, [-4.0, 2.0, 24.0]), (False, [0.0, 2.0, 18.0])])
def test_rows_beyond_the_ends_go_on_or_stay(goes_on: bool, expected: list[float]) -> None:
    rows = 2.0 * np.arange(10.0)[:, None, None]
    out = np.empty((3, 1, 1))
    mean_in_bins(rows, 0, 0.0, 1.0, np.array([-3.0, 0.0, 11.0]), np.arange(3), 1.0, goes_on, out)
    assert out[:, 0, 0] == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize('late', [-0.05, 0.0, 0.05])
def test_a_wheel_does_not_stop_where_the_simulation_ends(late: float) -> None:
    """Nor does the robot: the last bins of streams that are early are as those before."""
    def stream(hertz: float, *names: str) -> TimeSeries:
        at = np.arange(0.0, 6.0, 1.0 / hertz)
        return TimeSeries(at, np.zeros((at.size, len(names))), names)
    known = settings()
    (drive,) = drives(Recording('rec1', 'rec1', {
        'command': stream(20.0, 'forward', 'yaw'), 'wheels': stream(50.0, 'left', 'right'),
        'pose': stream(20.0, 'x', 'y', 'heading')}, 0), known.simulation['step'], known.bins,
        0.5, 3.0)
    base = base_of(known, load_model().parameters, False)
    values = base.values(base.start)
    values[[base.names.index(f'{one}_late') for one in ('wheels', 'pose')]] = late, -late
    motion = np.zeros((drive.steps + 1, len(OUTPUTS), 1))
    time = known.simulation['step'] * np.arange(drive.steps + 1)
    for name, rate in (('angle_left', 5.0), ('angle_right', -3.0), ('x', 0.8)):
        motion[:, OUTPUTS.index(name), 0] = rate * time
    found = predicted(base, drive, values[None], motion)
    assert found['wheels'][:, :, 0] == pytest.approx(
        np.tile([5.0, -3.0], (len(found['wheels']), 1)), abs=1e-6)
    between = np.diff(drive.bins['pose'].centres())
    assert found['pose'][:, 0, 0] == pytest.approx(0.8 * between, abs=1e-6)
