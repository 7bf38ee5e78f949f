# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A comparison for plotting tools: a bag with layouts for Foxglove and PlotJuggler; TUM files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import json
from pathlib import Path
import re
from xml.etree import ElementTree

from lg_husky_sim.comparison.metrics import measured_channels, pose_rates, predicted_at, UNITS
from lg_husky_sim.comparison.outcome import RecordingOutcome
from lg_husky_sim.folders import check_ours
from lg_husky_sim.recording.tum import check_tum, write_tum
from lg_husky_sim.recording.writer import check_target, write_signals
from lg_husky_sim.signals import TimeSeries
import numpy as np

MEASURED = 'measured'
RESIDUAL = 'residual'
_POSE = ('x', 'y', 'heading')


def write_comparison_bag(path: Path, outcome: RecordingOutcome, overwrite: bool = False) -> Path:
    """
    Write what was measured and predicted, and the difference, as one rosbag2 with two layouts.

    Parameters
    ----------
    path : pathlib.Path
        Folder of the rosbag2; ``path.foxglove.json`` and ``path.plotjuggler.xml`` stand beside it.
    outcome : RecordingOutcome
        A recording with the predictions of all models.
    overwrite : bool
        Replace a rosbag2 that is there.

    Returns
    -------
    pathlib.Path
        The folder. Topics are ``/measured/CHANNEL``, ``/MODEL/CHANNEL`` and
        ``/residual/MODEL/CHANNEL`` (measured minus predicted), all at the stamps of what was
        measured, and ``/measured/pose``, ``/MODEL/pose``.

    Raises
    ------
    RecordingError
        If something is at `path` already.
    SettingsError
        If a file of another origin has the name of a layout.

    """
    check_bag(path, overwrite)
    layouts = _layouts(path)
    signals, poses = comparison_signals(outcome)
    recording = outcome.recording
    write_signals(path, signals, poses, start_ns=recording.start_ns,
                  frame=recording.frames[0] or 'odom', overwrite=overwrite)
    names = tuple(topic_names(outcome).values())
    channels = [name for name in UNITS if f'/{MEASURED}/{name}' in signals]
    layouts[0].write_text(
        json.dumps(foxglove_layout(names, channels), indent=1) + '\n', encoding='utf-8')
    layouts[1].write_text(plotjuggler_layout(names, channels), encoding='utf-8')
    return path


def check_bag(path: Path, overwrite: bool = False) -> None:
    """Check that a bag and its layouts may be written, as :func:`write_comparison_bag` does."""
    check_target(path, overwrite=overwrite)
    if not path.exists():  # beside such a bag, they are the bag's
        for layout in _layouts(path):
            check_ours(layout, '')


def _layouts(path: Path) -> tuple[Path, Path]:
    return beside(path, '.foxglove.json'), beside(path, '.plotjuggler.xml')


def beside(path: Path, ending: str) -> Path:
    """Return the path of a layout beside a bag."""
    return path.with_name(path.name + ending)


def write_trajectories(folder: Path, outcomes: Sequence[RecordingOutcome]) -> tuple[Path, ...]:
    """Write ``RECORDING.tum`` and ``RECORDING_MODEL.tum``, in each recording's frame."""
    check_trajectories(folder, outcomes)
    found = []
    for outcome in outcomes:
        for topic, series in comparison_signals(outcome)[1].items():
            found.append(write_tum(_trajectory(folder, outcome, topic.split('/')[1]), series,
                                   outcome.recording.start_ns))
    return tuple(found)


def check_trajectories(folder: Path, outcomes: Sequence[RecordingOutcome]) -> None:
    """Check that all trajectories may be written, before the first one is."""
    for outcome in outcomes:
        if any('pose' in part.segment.streams for part in outcome.segments):
            for label in (MEASURED, *topic_names(outcome).values()):
                check_tum(_trajectory(folder, outcome, label))


def _trajectory(folder: Path, outcome: RecordingOutcome, label: str) -> Path:
    stem = _ros_name(outcome.recording.name)
    return folder / (f'{stem}.tum' if label == MEASURED else f'{stem}_{label}.tum')


def topic_names(outcome: RecordingOutcome) -> dict[str, str]:
    """Return the labels of models and rivals with a name for topics each, all different."""
    labels = dict.fromkeys(label for part in outcome.segments for label in part.predictions)
    names: dict[str, str] = {}
    for label in labels:
        name = _ros_name(label)
        while name in (*names.values(), MEASURED, RESIDUAL):
            name += '_'
        names[label] = name
    return names


def _ros_name(text: str) -> str:
    name = re.sub(r'[^A-Za-z0-9_]+', '_', text).strip('_') or 'model'
    return name if name[0].isalpha() else f'm_{name}'


def comparison_signals(outcome: RecordingOutcome
                       ) -> tuple[dict[str, TimeSeries], dict[str, TimeSeries]]:
    """
    Return the signals of a comparison by topic, and the poses.

    Parameters
    ----------
    outcome : RecordingOutcome
        A recording with the predictions of all models.

    Returns
    -------
    signals, poses : dict of str to TimeSeries

    """
    names = topic_names(outcome)
    signals: dict[str, list[TimeSeries]] = {}
    poses: dict[str, list[TimeSeries]] = {}
    for part in outcome.segments:
        for channel, own in measured_channels(part.segment).items():
            if own.values.shape[1] != 1 or channel not in UNITS:
                continue
            signals.setdefault(f'/{MEASURED}/{channel}', []).append(own)
            for label, prediction in part.predictions.items():
                if channel not in prediction.names:
                    continue
                # What was measured as a derivative of the pose is predicted as one, too.
                derived = channel == 'forward' or (
                    channel == 'yaw_rate' and 'imu' not in part.segment.streams)
                source = pose_rates(part.segment, prediction) if derived else prediction
                values = predicted_at(source, channel, own.times)
                for topic, column in (
                        (f'/{names[label]}/{channel}', values),
                        (f'/{RESIDUAL}/{names[label]}/{channel}', own.values[:, 0] - values)):
                    good = np.isfinite(column)
                    signals.setdefault(topic, []).append(TimeSeries(
                        own.times[good], column[good, None], (channel,)))
        pose = part.segment.streams.get('pose')
        if pose is not None:
            poses.setdefault(f'/{MEASURED}/pose', []).append(pose)
            for label, prediction in part.predictions.items():
                columns = np.column_stack([predicted_at(prediction, name, pose.times)
                                           for name in _POSE])
                good = np.all(np.isfinite(columns), axis=1)
                poses.setdefault(f'/{names[label]}/pose', []).append(TimeSeries(
                    pose.times[good], columns[good], _POSE))
    return ({topic: _joined(parts) for topic, parts in signals.items()},
            {topic: _joined(parts) for topic, parts in poses.items()})


def _joined(parts: Sequence[TimeSeries]) -> TimeSeries:
    return TimeSeries(np.concatenate([part.times for part in parts]),
                      np.concatenate([part.values for part in parts]), parts[0].names)


def foxglove_layout(names: Sequence[str], channels: Sequence[str]) -> Mapping[str, object]:
    """Return a layout of Foxglove: two plots a channel, above each other, and the paths."""
    def plot(title: str, topics: Sequence[str]) -> dict[str, object]:
        return {'title': title, 'xAxisVal': 'timestamp', 'showLegend': True, 'paths': [
            {'value': f'{topic}.data', 'enabled': True, 'timestampMethod': 'receiveTime'}
            for topic in topics]}

    panels: dict[str, object] = {}
    order = []
    for channel in channels:
        panels[f'Plot!{channel}'] = plot(
            f'{channel} [{UNITS[channel]}]', [f'/{name}/{channel}' for name in (MEASURED, *names)])
        panels[f'Plot!{channel}_residual'] = plot(
            f'{channel}: measured minus predicted [{UNITS[channel]}]',
            [f'/{RESIDUAL}/{name}/{channel}' for name in names])
        order += [f'Plot!{channel}', f'Plot!{channel}_residual']
    panels['3D!paths'] = {'layers': {'grid': {
        'layerId': 'foxglove.Grid', 'visible': True, 'size': 20, 'divisions': 20}},
        'topics': {f'/{name}/pose': {'visible': True} for name in (MEASURED, *names)}}
    layout: object = '3D!paths'
    for count, panel in enumerate(reversed(order), start=1):
        layout = {'direction': 'column', 'first': panel, 'second': layout,
                  'splitPercentage': 100.0 / (count + 1)}
    return {'configById': panels, 'globalVariables': {}, 'userNodes': {}, 'layout': layout}


def plotjuggler_layout(names: Sequence[str], channels: Sequence[str]) -> str:
    """Return a layout of PlotJuggler: a tab for each channel, signals above residuals."""
    root = ElementTree.Element('root')
    tabs = ElementTree.SubElement(root, 'tabbed_widget', {
        'name': 'Main Window', 'parent': 'main_window'})
    for channel in channels:
        tab = ElementTree.SubElement(tabs, 'Tab', tab_name=f'{channel} [{UNITS[channel]}]',
                                     containers='1')
        container = ElementTree.SubElement(tab, 'Container')
        splitter = ElementTree.SubElement(container, 'DockSplitter', orientation='-',
                                          sizes='0.5;0.5', count='2')
        for title, topics in (
                (channel, [f'/{name}/{channel}' for name in (MEASURED, *names)]),
                ('measured minus predicted',
                 [f'/{RESIDUAL}/{name}/{channel}' for name in names])):
            area = ElementTree.SubElement(splitter, 'DockArea', name=title)
            plot = ElementTree.SubElement(area, 'plot', mode='TimeSeries', style='Lines')
            for topic in topics:
                ElementTree.SubElement(plot, 'curve', name=f'{topic}/data')
    ElementTree.indent(root)
    return "<?xml version='1.0' encoding='UTF-8'?>\n" + ElementTree.tostring(
        root, encoding='unicode') + '\n'
