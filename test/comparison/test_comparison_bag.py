# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A comparison written for plotting tools: the bag, the layouts, the trajectories."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import lg_husky_sim as lg
import numpy as np
import pytest


@pytest.fixture(scope='module')
def comparison() -> lg.Comparison:
    drive = lg.Husky(mass=60.0).simulate('s_bend')
    return lg.compare(drive, {'paper': lg.Husky(), 'as it is!': lg.Husky(mass=60.0)})


def messages(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Return stamps and messages by topic, read by the library rosbags."""
    from rosbags.highlevel import AnyReader

    found: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([path]) as reader:
        for connection, stamp, raw in reader.messages():
            found.setdefault(connection.topic, []).append(
                (stamp, reader.deserialize(raw, connection.msgtype)))
    return found


def test_the_residual_is_measured_minus_predicted(
        comparison: lg.Comparison, tmp_path: Path) -> None:
    found = messages(comparison.save_bag(tmp_path / 'signals'))
    for channel in ('wheel_left', 'yaw_rate', 'forward'):
        measured, predicted, residual = (
            {stamp: message.data for stamp, message in found[f'/{topic}/{channel}']}
            for topic in ('measured', 'paper', 'residual/paper'))
        assert len(residual) > 100
        for stamp, value in residual.items():
            assert value == pytest.approx(measured[stamp] - predicted[stamp], abs=1e-12)


def test_the_model_that_drove_has_no_residual(comparison: lg.Comparison, tmp_path: Path) -> None:
    found = messages(comparison.save_bag(tmp_path / 'signals'))
    for channel in ('wheel_left', 'yaw_rate', 'forward'):
        values = [message.data for _, message in found[f'/residual/as_it_is/{channel}']]
        assert max(map(abs, values)) < 1e-6
    assert {'/measured/pose', '/paper/pose', '/as_it_is/pose'} <= set(found)


def test_layouts_name_topics_that_are_in_the_bag(
        comparison: lg.Comparison, tmp_path: Path) -> None:
    topics = set(messages(comparison.save_bag(tmp_path / 'signals')))
    layout = json.loads((tmp_path / 'signals.foxglove.json').read_text('utf-8'))
    plotted = {path['value'].removesuffix('.data') for panel in layout['configById'].values()
               for path in panel.get('paths', ())}
    assert plotted
    assert plotted <= topics
    assert set(layout['configById']['3D!paths']['topics']) <= topics

    def panels(part: Any) -> set[str]:
        return {part} if isinstance(part, str) else panels(part['first']) | panels(part['second'])
    assert panels(layout['layout']) == set(layout['configById'])
    curves = [curve.get('name', '') for curve in ElementTree.parse(
        tmp_path / 'signals.plotjuggler.xml').getroot().iter('curve')]
    assert curves
    assert {name.removesuffix('/data') for name in curves} <= topics


def test_trajectories_are_those_of_the_poses(comparison: lg.Comparison, tmp_path: Path) -> None:
    paths = comparison.save_trajectories(tmp_path)
    assert [path.name for path in paths] == [
        's_bend.tum', 's_bend_paper.tum', 's_bend_as_it_is.tum']
    table = np.loadtxt(paths[0])
    pose = comparison.outcomes[0].recording.stream('pose')
    assert table.shape == (len(pose), 8)
    assert np.allclose(table[:, 1:3], pose.values[:, :2], atol=1e-7)
    heading = 2.0 * np.arctan2(table[:, 6], table[:, 7])
    assert np.allclose(heading, pose.column('heading'), atol=1e-7)


def test_stamps_of_a_trajectory_keep_their_nanoseconds(
        comparison: lg.Comparison, tmp_path: Path) -> None:
    path = comparison.save_trajectories(tmp_path)[0]
    recording = comparison.outcomes[0].recording
    lines = [line for line in path.read_text('utf-8').splitlines() if not line.startswith('#')]
    for line, time in zip(lines, recording.stream('pose').times, strict=True):
        seconds, nanoseconds = line.split()[0].split('.')
        assert int(seconds) * 10**9 + int(nanoseconds) == recording.start_ns + round(time * 1e9)


def test_evo_reads_the_trajectories_and_agrees_on_the_error(
        comparison: lg.Comparison, tmp_path: Path) -> None:
    pytest.importorskip('evo', reason='NO EVO: pip install evo, and what reads our trajectories '
                                      'is tested')
    from evo.core import metrics, sync
    from evo.tools.file_interface import read_tum_trajectory_file

    measured, *models = comparison.save_trajectories(tmp_path)
    for path, label in zip(models, comparison.labels, strict=True):
        reference = read_tum_trajectory_file(measured)
        assert reference.check()[0]
        error = metrics.APE(metrics.PoseRelation.translation_part)
        error.process_data(sync.associate_trajectories(
            reference, read_tum_trajectory_file(path)))
        ours = comparison.outcomes[0].errors(label)['position'].rmse
        assert error.get_statistic(metrics.StatisticsType.rmse) == pytest.approx(ours, rel=1e-5)
