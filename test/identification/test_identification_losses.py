# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a fitted model predicts worse than the one before is said wherever the fit is."""

from __future__ import annotations

from dataclasses import replace
import json
from math import inf
from pathlib import Path

import lg_husky_sim as lg
from lg_husky_sim.cli.main import run
from lg_husky_sim.identification.result import ChannelFit
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

WORSE = 'Driven by the commands alone, the fitted model predicts worse than the one before: '


def test_a_loss_stands_under_the_headline_in_every_file(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Mass and damping cannot make up for dry scrub, and are wrong for what they can explain."""
    robot = lg.Husky().with_effect('yaw_scrub_coulomb', yaw_coulomb_moment=8.0)
    robot.simulate('s_bend').save(tmp_path / 'drive')
    out = tmp_path / 'fit.yaml'
    assert run(['identify', str(tmp_path / 'drive'), '--free', 'wheel_damping,mass', '--out',
                str(out)]) == 0
    printed = capsys.readouterr().out.splitlines()
    text = out.with_suffix('.txt').read_text(encoding='utf-8').splitlines()
    assert printed[2].startswith(WORSE)
    assert text[2] == printed[2]
    for quantity in ('yaw rate +', 'heading +', 'position +'):
        assert quantity in text[2]
    data = json.loads(out.with_suffix('.json').read_text(encoding='utf-8'))
    assert data['losses'] == ['yaw_rate', 'heading', 'position']
    driven = {one['name']: one for one in data['driven']}
    grown = driven['position']['rms_after'] / driven['position']['rms_before']
    assert f'position +{100.0 * (grown - 1.0):.0f}\u00a0%' in text[2]
    page = out.with_suffix('.html').read_text(encoding='utf-8')
    assert WORSE in page
    assert f'+{100.0 * (grown - 1.0):.0f}\u00a0%' in page


def test_a_loss_that_has_no_share_is_said_in_numbers() -> None:
    fit = lg.Husky().identify(lg.Husky().simulate('spin'), ['wheel_damping'], progress=False)
    driven = (ChannelFit('forward', 'm/s', 9, 0.0, 0.25), ChannelFit('position', 'm', 9, 1.0, inf),
              ChannelFit('yaw_rate', 'rad/s', 9, 0.1, 0.2))
    loss = replace(fit.result, driven=driven).loss
    assert loss.endswith('forward speed from 0 to 0.25 m/s, position beyond all bounds, '
                         'yaw rate +100\u00a0%')


def test_a_fit_says_what_its_intervals_take_as_exact() -> None:
    robot = lg.Husky()
    drive = robot.simulate('spin')
    fit = robot.identify(drive, ['wheel_damping'], progress=False)
    known = [p for p in robot.parameters.entries if 0.0 < p.tolerance < 1.0]
    said = f'The intervals take {len(known)} other parameters of the robot as exact, known to '
    assert fit.result.held.startswith(f'{said}0.2 to 20 % only')
    assert fit.result.held in str(fit).splitlines()
    exact = [replace(p, tolerance=0.0) for p in known]
    model = replace(fit.result.model, parameters=fit.result.model.parameters.with_entries(*exact))
    assert replace(fit.result, model=model).held == ''


def test_a_model_that_fits_better_has_no_loss() -> None:
    fit = lg.Husky().identify(lg.Husky(wheel_damping=1.6).simulate('s_bend'), ['wheel_damping'],
                              progress=False)
    assert fit.result.driven
    assert fit.data()['losses'] == []
    assert WORSE not in str(fit)
    assert fit.warnings == ()


def test_rounding_is_no_loss() -> None:
    fit = lg.Husky().identify(lg.Husky().simulate('s_bend'), progress=False)
    assert fit.result.losses == ()


def test_the_page_says_what_of_an_error_is_scatter_of_the_pose(tmp_path: Path) -> None:
    drive = lg.Husky(wheel_damping=1.6).simulate('s_bend')
    pose = drive.pose
    noise = np.random.default_rng(2).normal(0.0, 0.05, pose.values.shape) * (1.0, 1.0, 0.0)
    noisy = replace(drive, streams={**drive.streams, 'pose': TimeSeries(
        pose.times, pose.values + noise, pose.names)})
    said = []
    for one in (drive, noisy):
        fit = lg.Husky().identify(one, ['wheel_damping'], starts=1, progress=False)
        page = fit.report(tmp_path).read_text(encoding='utf-8')
        said.append('has a scatter of at least' in page)
    assert said == [False, True]
