# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings beside models: errors, pictures, page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
import math
from numbers import Real
from pathlib import Path
import tempfile
from typing import Any, TYPE_CHECKING, TypeAlias

from lg_husky_sim import recording as rec
from lg_husky_sim.api.axes import axes_or_new
from lg_husky_sim.api.progress import Report, Shown, shown
from lg_husky_sim.api.recordings import given, listed, PathLike, read_all, Recordings, Topics
from lg_husky_sim.api.robots import as_husky, Husky
from lg_husky_sim.api.tables import page_part, Table
from lg_husky_sim.comparison.metrics import UNITS
from lg_husky_sim.comparison.models import labels_of, NamedPlant, plants_in, recordings_of
from lg_husky_sim.comparison.outcome import (
    as_json,
    closest,
    compare_recording,
    labels,
    RecordingOutcome,
    text_table,
)
from lg_husky_sim.comparison.replay import PERIOD
from lg_husky_sim.errors import CommandError
from lg_husky_sim.folders import result_folder
from lg_husky_sim.husky.model_file import default_model_path
from lg_husky_sim.recording.names import printable
import numpy as np

if TYPE_CHECKING:
    from lg_husky_sim.diagnosis.prediction_errors import Assessment

Model: TypeAlias = PathLike | Husky
Models: TypeAlias = Model | Sequence[Model] | Mapping[str, Model] | None


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """
    Recordings beside the predictions of models.

    Errors are measured minus predicted. Made by :func:`compare`.

    Parameters
    ----------
    outcomes : tuple of RecordingOutcome
        One a recording, with its segments and the predictions in them.
    plants : tuple of NamedPlant
        The models with their labels.
    horizon : float
        Time after which each prediction started anew [s]; 0 only at gaps.
    settings : mapping of str to float
        Parameters that were overridden in every model.

    """

    outcomes: tuple[RecordingOutcome, ...]
    plants: tuple[NamedPlant, ...]
    horizon: float
    settings: Mapping[str, float]

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the models, and of other simulators beside them."""
        return labels(self.outcomes)

    def table(self) -> Table:
        """Return the errors: one row a recording and quantity, one column a model."""
        rows: list[tuple[object, ...]] = []
        for outcome in self.outcomes:
            errors = {name: outcome.errors(name) for name in self.labels}
            name = outcome.recording.name
            for channel, unit in UNITS.items():
                values = [errors[label][channel].rmse if channel in errors[label] else None
                          for label in self.labels]
                if any(value is not None for value in values):
                    rows.append((name, f'{channel} RMS error', unit, *values))
            for place, axis in enumerate('XY'):
                bounds = [outcome.bounds(label)[place] for label in self.labels]
                if any(map(math.isfinite, bounds)):
                    rows.append((name, f'largest |{axis}| error', 'm', *bounds))
        return Table('', ('recording', 'quantity', 'unit', *self.labels), tuple(rows))

    def to_pandas(self) -> Any:
        """Return the errors as a pandas DataFrame, index recording and quantity."""
        return self.table().to_pandas().set_index(['recording', 'quantity'])

    @cached_property
    def what_to_change(self) -> Assessment:
        """How the recordings differ from the closest model, and what to change for it."""
        from lg_husky_sim.diagnosis.prediction_errors import assess

        label = closest(self.outcomes, [named.label for named in self.plants])
        model, = (named.model for named in self.plants if named.label == label)
        return assess([(part.segment, part.predictions[label]) for outcome in self.outcomes
                       for part in outcome.segments], label, model.parameters)

    def data(self) -> dict[str, object]:
        """Return the comparison as plain data, schema ``lg_husky_sim/comparison/1``."""
        return {**as_json(self.outcomes, self.plants, self.horizon, self.settings),
                'what_to_change': self.what_to_change.data()}

    def plot(self, axes: Sequence[Any] | None = None, recording: int = 0) -> Any:
        """
        Draw path, forward speed, right wheel rate and yaw rate of the longest segment.

        Parameters
        ----------
        axes : sequence of four matplotlib Axes, optional
            Where to draw; a new figure if not given.
        recording : int
            Which of the recordings.

        Returns
        -------
        numpy.ndarray of matplotlib Axes, shape (4,)

        """
        from lg_husky_sim.comparison.traces import traces_of
        from lg_husky_sim.reporting.pictures import draw_path, draw_signal
        from lg_husky_sim.reporting.styles import column_styles

        axes = axes_or_new(axes, (2, 2), 'a comparison', (10.0, 6.5))
        outcome = self.outcomes[recording]
        part = max(outcome.segments, key=lambda one: one.segment.duration)
        styles = column_styles(self.labels)
        traces = {one.channel: one for one in traces_of(
            [(part.segment, part.predictions)], self.labels)}
        if 'x' in traces:
            draw_path(axes[0], traces['x'], traces['y'], styles)
        for axis, channel in zip(axes[1:], ('forward', 'wheel_right', 'yaw_rate'), strict=True):
            if channel in traces:
                draw_signal(axis, traces[channel], styles)
            axis.set_xlabel('time [s]')
        axes[0].legend()
        return np.array(list(axes), dtype=object)

    def save(self, folder: PathLike, figures: int = 6, progress: Report | None = None) -> Path:
        """
        Write index.html, compare.json, compare.txt and the pictures.

        Parameters
        ----------
        folder : path-like
            Made, or files of an earlier run in it replaced.
        figures : int
            Number of recordings, from the first, whose signals and path are drawn as PNG too.
        progress : callable, optional
            Called with the word ``drawing`` and how far it is (0 to 1).

        Returns
        -------
        pathlib.Path
            The page.

        """
        from lg_husky_sim.comparison.page import MARKER, PAGE, report_data, write_files
        from lg_husky_sim.reporting.provenance import provenance

        target = Path(folder)
        total = 1 + 2 * min(figures, len(self.outcomes))
        drawn = iter(range(total))

        def each() -> None:
            if progress is not None:
                progress('drawing', (next(drawn, total) + 1) / max(total, 1))
        page = report_data(
            self.outcomes, self.plants, self.horizon, self.settings, provenance(
                [(one.recording.name, one.recording.path) for one in self.outcomes],
                [(named.label, named.path) for named in self.plants]),
            self.what_to_change.advice())
        with result_folder(target, MARKER) as made:
            write_files(made, page, self.data(), f'{self}\n', figures, each)
        return target / PAGE

    def save_bag(self, path: PathLike, *, recording: int = 0, overwrite: bool = False) -> Path:
        """
        Write measured, predicted and residual of a recording as one rosbag2, to be plotted.

        Beside it stand ``PATH.foxglove.json`` and ``PATH.plotjuggler.xml``, layouts for both.

        Parameters
        ----------
        path : path-like
            Folder of the rosbag2.
        recording : int
            Which of the recordings.
        overwrite : bool
            Replace a rosbag2 that is there.

        Returns
        -------
        pathlib.Path
            The folder.

        """
        from lg_husky_sim.comparison.signals_bag import write_comparison_bag
        return write_comparison_bag(Path(path), self.outcomes[recording], overwrite)

    def save_trajectories(self, folder: PathLike) -> tuple[Path, ...]:
        """
        Write measured and predicted trajectories in the TUM format, which evo reads.

        Parameters
        ----------
        folder : path-like
            Gets ``RECORDING.tum`` and ``RECORDING_MODEL.tum`` for each recording with a pose.

        Returns
        -------
        tuple of pathlib.Path

        """
        from lg_husky_sim.comparison.signals_bag import write_trajectories
        return write_trajectories(Path(folder), self.outcomes)

    def report(self, folder: PathLike | None = None) -> Path:
        """Write everything into a folder, a temporary one by default; return the page."""
        return self.save(folder or tempfile.mkdtemp(prefix='lg_husky_compare.'))

    def __str__(self) -> str:
        """Return the errors, and what to change, as text."""
        return f'{text_table(self.outcomes)}\n{self.what_to_change}'

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return page_part('Comparison', ['Errors are measured minus predicted.'], [self.table()], {
            **{one.where: one.sentences for one in self.what_to_change.advice()},
            'Notes': [f'{outcome.recording.name}: {note}' for outcome in self.outcomes
                      for note in outcome.remarks()]})


def compare(recordings: Recordings, models: Models = None, *, rivals: Recordings = (),
            horizon: float = 0.0, settings: Mapping[str, float] | None = None,
            topics: Topics = None, progress: Shown = True) -> Comparison:
    """
    Replay the commands of recordings through models and measure how far they are apart.

    Each segment without a gap starts in the state that the robot was in.

    Parameters
    ----------
    recordings : path-like, Recording, or several of them
        In the order in which they were driven.
    models : Husky or path-like, or several of them, optional
        A mapping gives them labels; the packaged Husky by default.
    rivals : path-like, Recording, or several of them
        Another simulator's recording of the same drive, one for each recording.
    horizon : float
        Start anew from the measured state after so many seconds; 0 only at gaps.
    settings : mapping of str to float, optional
        Physical parameters overridden in every model [SI].
    topics : mapping of str to str, optional
        Topics of the recordings chosen by hand.
    progress : bool or callable
        Shown in terminals and notebooks; False for none.

    Returns
    -------
    Comparison

    Raises
    ------
    CommandError
        If the horizon is shorter than a step of a replay, there is no model, or not one rival for
        each recording.
    RecordingError
        If there is no recording, or one cannot be used.

    """
    horizon = _checked_horizon(horizon)
    recordings, rivals = given(recordings), listed(rivals)
    if rivals and len(rivals) != len(recordings):
        raise CommandError(f'{len(rivals)} rivals for {len(recordings)} recordings: give one '
                           'for each recording, in their order, or none')
    if not isinstance(settings, (Mapping, type(None))):
        raise CommandError(f'settings = {settings!r} is no mapping of parameters to values')
    overridden = dict(settings or {})
    plants = _named(models, overridden)
    with shown(progress) as report:
        beside = read_all(rivals, progress=report)
        read, = rec.named_apart(rec.named_as_in(
            read_all(recordings, topics=topics, progress=report), recordings_of(plants)))
        names = [one.name for one in read]
        outcomes = []
        for place, one in enumerate(read):
            report(f'replaying {one.name}', place / len(read))
            rival = None
            if beside:
                rival = (_rival_label(beside, place, [named.label for named in plants]),
                         beside[place])
            outcomes.append(compare_recording(
                one, plants_in(plants, one.name, names), rival, horizon))
    return Comparison(tuple(outcomes), plants, horizon, overridden)


def _checked_horizon(horizon: object) -> float:
    if not isinstance(horizon, Real) or not (
            horizon == 0.0 or PERIOD <= float(horizon) < math.inf):
        raise CommandError(f'horizon = {horizon!r} s must be 0, or a number of at least '
                           f'{PERIOD:g} s, the step of a replay')
    return float(horizon)


def _named(models: Models, settings: Mapping[str, float]) -> tuple[NamedPlant, ...]:
    if isinstance(models, Mapping):
        chosen = dict(models)
    else:
        several: Sequence[Model | None] = list(models) if isinstance(
            models, Iterable) and not isinstance(models, str) else [models]
        names = labels_of([_path_of(model) for model in several], bool(settings))
        chosen = dict(zip(names, several, strict=True))  # type: ignore[arg-type]
    if not chosen:
        raise CommandError('no model given')
    if not all(isinstance(label, str) and label.strip() for label in chosen):
        raise CommandError(f'labels of models must be words: {", ".join(map(repr, chosen))}')
    found = []
    for label, model in chosen.items():
        husky = Husky(as_husky(model), **settings)
        found.append(NamedPlant(label, str(_path_of(model)), husky.model, husky.plant))
    return tuple(found)


def _path_of(model: Model | None) -> Path:
    # A model that was made in Python has no file; it gets a name all the same.
    if isinstance(model, Husky):
        if model.path:
            return Path(model.path)
        return default_model_path() if model.model == Husky().model else Path('model')
    return default_model_path() if model is None else Path(as_husky(model).path)


def _rival_label(rivals: Sequence[rec.Recording], place: int, taken: Sequence[str]) -> str:
    # One name for all, so that they are pooled, and no model's.
    label = printable('rival' if len(rivals) > 1 else Path(rivals[place].name).stem)
    return f'{label} (rival)' if label in taken else label
