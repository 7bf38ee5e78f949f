# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a recording holds and is good for, before any fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING

from lg_husky_sim import recording as rec
from lg_husky_sim.api.recordings import PathLike, rate, Recording
from lg_husky_sim.api.robots import as_husky, Husky
from lg_husky_sim.api.sensor_warnings import sensor_warnings
from lg_husky_sim.api.tables import page_part, Table
from lg_husky_sim.diagnosis.sensors.regression import Number
from lg_husky_sim.diagnosis.sensors.relations import Relation, relations
from lg_husky_sim.diagnosis.sensors.robot import differences
from lg_husky_sim.errors import FitError, ParameterError, RecordingError
from lg_husky_sim.identification.confidence import confidence, undetermined
from lg_husky_sim.identification.multistart import refine
from lg_husky_sim.identification.problem import observations
from lg_husky_sim.identification.unknowns import free_names, unknowns_of
from lg_husky_sim.recording.recording import CONTINUOUS
from lg_husky_sim.recording.topics import TYPES
from lg_husky_sim.reporting.words import plus_minus
from lg_husky_sim.resources import config_path
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.yaml_files import read_yaml
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

SCHEMA = 'lg_husky_sim/survey/1'
MOST_DECIMALS = 6
"""Most decimals of a number beside its half width."""


CHECKED = {
    'wheels': 'No wheels (JointState): what the motors turn is not measured, so that slip, wheel '
              'radius and drivetrain cannot be told apart',
    'imu': 'No IMU (Imu): the yaw rate is known from other streams only, and accelerations not at '
           'all',
    'pose': 'No pose (TF, Odometry or PoseStamped): the speed over ground is not measured, so '
            'that slip and wheel radius cannot be told, nor whether the gyro is right'}
"""Measurements, and what cannot be told without each."""
CHOICE = ('; joints whose names do not tell their side are chosen by --topic left_wheels=A,B '
          '--topic right_wheels=C,D')


@cache
def limits() -> dict[str, float]:
    """Return the numbers of ``config/survey.yaml`` by name."""
    data = read_yaml(config_path('survey.yaml'), ParameterError)
    return {name: float(entry['value']) for name, entry in data['limits'].items()}


@dataclass(frozen=True, repr=False)
class Survey:
    """
    What a recording holds and is good for. Made by :meth:`Recording.info`.

    Parameters
    ----------
    name, path : str
    duration : float
        [s].
    streams, segments, excitation, parameters : Table
        Streams found; stretches without a gap; what was driven; which parameters the drive can
        determine, and how well.
    warnings : tuple of str
        What is wrong with the recording, or with the robot for a Husky.
    missing : tuple of str
        What a diagnosis lacks; empty where the recording is enough.
    undetermined : tuple of str
        Which parameters the drive leaves open, alone or together.
    notes : tuple of str
        Repairs of the clock, and what was left out.
    sensors : Table
        What each stream says of the others, without a model of the robot.
    unused : tuple of str
        Topics that serve no role.
    differs : bool
        Whether the robot is not one of the model, or off the ground: a diagnosis would say so,
        and look for no effect.

    """

    name: str
    path: str
    duration: float
    streams: Table
    segments: Table
    excitation: Table
    parameters: Table
    warnings: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    undetermined: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    sensors: Table = field(default=Table('', (), ()))
    unused: tuple[str, ...] = ()
    differs: bool = False

    @property
    def enough(self) -> bool:
        """Whether the recording is enough for a diagnosis."""
        return not self.missing

    @property
    def verdict(self) -> str:
        """Return what the recording is good for, in one sentence."""
        if self.enough and self.differs:
            return 'No diagnosis is possible with this model, from which the robot differs.'
        if self.enough and not self.warnings:
            return 'Enough for a diagnosis.'
        return 'Enough for a diagnosis, with reservations.' if self.enough else (
            'Not enough for a diagnosis.')

    def tables(self) -> tuple[Table, ...]:
        """Return the tables that have rows."""
        return tuple(table for table in (self.streams, self.segments, self.sensors,
                                         self.excitation, self.parameters) if table.rows)

    def points(self) -> dict[str, tuple[str, ...]]:
        """Return the lists by their headings."""
        return {'Warnings': self.warnings, 'Missing for a diagnosis': self.missing,
                'What this drive does not determine': self.undetermined,
                'Repairs and choices': self.notes}

    def data(self) -> dict[str, object]:
        """Return the survey as plain data for JSON."""
        return {'schema': SCHEMA, 'name': self.name, 'path': self.path,
                'duration_s': self.duration, 'enough_for_diagnose': self.enough,
                'streams': self.streams.data(), 'segments': self.segments.data(),
                'sensors': self.sensors.data(),
                'excitation': self.excitation.data(), 'parameters': self.parameters.data(),
                'warnings': list(self.warnings), 'missing': list(self.missing),
                'undetermined': list(self.undetermined), 'notes': list(self.notes),
                'unused_topics': list(self.unused)}

    def heading(self) -> str:
        """Return the verdict and the lists as text, without the tables."""
        parts = [f'{self.name}: {self.duration:.1f} s. {self.verdict}']
        for heading, items in self.points().items():
            if items:
                parts += ['', heading, *(f'  {item}' for item in items)]
        return '\n'.join(parts)

    def __str__(self) -> str:
        """Return the survey as text."""
        return '\n\n'.join([self.heading(), *map(str, self.tables())])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return page_part(f'{self.name}: {self.duration:.1f} s', [self.verdict], self.tables(),
                         self.points())


def survey(recording: Recording, model: Husky | PathLike | None = None) -> Survey:
    """Say what a recording holds; see :meth:`lg_husky_sim.Recording.info`."""
    husky = as_husky(model)
    parts = rec.segments(recording)
    moving, excitation = _excitation(recording)
    parameters, left_open, problem = _parameters(parts, husky)
    related = relations(parts)
    warnings = (*_unmeasured(recording), *_robot_warnings(recording, husky, parts, related),
                *problem)
    used = set(recording.topics.values())
    return Survey(
        recording.name, recording.path, recording.duration, _streams(recording),
        _segments(parts), excitation, parameters, warnings,
        _missing(recording, parts, moving, excitation), left_open, recording.notes,
        sensors=_related(related), unused=tuple(
            f'{topic} ({kind})' for topic, kind in sorted(recording.present.items())
            if topic not in used), differs=bool(differences(related, husky.parameters)))


def _streams(recording: Recording) -> Table:
    rows = []
    for name, series in recording.streams.items():
        steps = np.diff(series.times)
        rows.append((name, recording.topics.get(name, ''), len(series), rate(series),
                     float(steps.max()) if steps.size else None,
                     _rounded(series.times[0]), _rounded(series.times[-1])))
    return Table('Streams', ('stream', 'topic', 'samples', 'rate [Hz]', 'longest gap [s]',
                             'from [s]', 'to [s]'), tuple(rows))


def _rounded(value: float) -> float:
    return round(float(value), 3)


def _segments(parts: Sequence[rec.Segment]) -> Table:
    return Table('Stretches without a gap', ('segment', 'from [s]', 'to [s]', 'length [s]'), tuple(
        (part.index, _rounded(part.start), _rounded(part.end), _rounded(part.duration))
        for part in parts))


def _excitation(recording: Recording) -> tuple[float, Table]:
    """Return the time in motion [s] and how it is shared out among the regimes."""
    title = 'What was driven (changes of the command are in other regimes too)'
    columns = ('regime', 'time [s]', 'share of motion')
    if 'command' not in recording.streams or len(recording.command) < 2:
        return 0.0, Table(title, columns, ())
    series = recording.command
    # A command holds until the next one, but a silence of the sender ends it.
    held = np.minimum(np.diff(series.times, append=series.times[-1]), rec.recording.DEFAULT_GAP)
    forward, yaw = series.column('forward'), series.column('yaw')
    drives = np.abs(forward) > limits()['moving_speed']
    turns = np.abs(yaw) > limits()['turning_rate']
    changes = np.concatenate(([False], np.any(np.diff(series.values, axis=0) != 0.0, axis=1)))
    regimes: dict[str, NDArray[np.bool_]] = {
        'straight ahead': drives & ~turns & (forward > 0.0),
        'turning while driving': drives & turns & (forward > 0.0),
        'turning on the spot': ~drives & turns,
        'reversing': drives & (forward < 0.0),
        'command changing': (drives | turns) & changes,
    }
    total = float(held[drives | turns].sum())
    rows: list[tuple[object, ...]] = [
        (name, _rounded(held[mask].sum()), float(held[mask].sum() / total) if total else 0.0)
        for name, mask in regimes.items()]
    rows.append(('at rest', _rounded(held[~(drives | turns)].sum()), None))
    return total, Table(title, columns, tuple(rows))


def _missing(recording: Recording, parts: Sequence[rec.Segment], moving: float,
             excitation: Table) -> tuple[str, ...]:
    said = []
    if 'command' not in recording.streams:
        said.append('velocity commands (Twist or TwistStamped): without them nothing can be '
                    'replayed')
    if not {'wheels', 'imu', 'pose'} & set(recording.streams):
        said.append('a measurement: wheels (JointState), imu (Imu) or pose (TF or Odometry)')
    if said:
        return tuple(said)
    if not parts:
        return (f'a stretch in which {", ".join(n for n in CONTINUOUS if n in recording.streams)} '
                'all overlap without a gap',)
    if moving < limits()['least_motion']:
        said.append(f'motion: {moving:.1f} s are commanded, {limits()["least_motion"]:g} s are '
                    'the least')
    return tuple(said)


def _unmeasured(recording: Recording) -> tuple[str, ...]:
    lacking = [name for name in CHECKED if name not in recording.streams]
    if len(lacking) == len(CHECKED):
        return ()  # nothing is measured, which is missing for a diagnosis
    joints = any(kind in TYPES['wheels'] for kind in recording.present.values())
    return tuple(CHECKED[name] + CHOICE * (joints and name == 'wheels') for name in lacking)


def _related(related: Sequence[Relation]) -> Table:
    """Return what each stream says of the others, without a model of the robot."""
    return Table('Sensors, two at a time, compared (factor: reference over source)', (
        'quantity', 'source', 'reference', 'factor', 'lag of the source [s]', 'explained'), tuple(
        (one.quantity, one.source, one.reference,
         _number(one.factor, 4) + ' m/rad' * (one.source == 'wheels'), _number(one.late, 2),
         f'{100.0 * max(one.explained, 0.0):.0f} %') for one in related))


def _number(one: Number, digits: int) -> str:
    # In so many decimals, or in as many as it takes for the half width not to read as zero.
    half = 0.5 * (one.high - one.low)
    while half > 0.0 and digits < MOST_DECIMALS and not round(half, digits):
        digits += 1
    return f'{one.value:.{digits}f} ±{half:.{digits}f}'


def _robot_warnings(recording: Recording, husky: Husky, parts: Sequence[rec.Segment],
                    related: Sequence[Relation]
                    ) -> tuple[str, ...]:
    said = list(sensor_warnings(parts, related, husky.model))
    fastest = max((float(np.abs(series.column('forward')).max()) for name, series in
                   recording.streams.items() if name == 'command' and len(series)), default=0.0)
    most = 1.0 / husky.parameters['command_gain']
    if fastest > limits()['overdriven'] * most:
        said.append(f'{fastest:.2f} m/s are commanded, but the model has its whole supply at '
                    f'{most:.2f} m/s (1/command_gain): it may be of another robot')
    said += [*_silences(recording), *_bunches(recording)]
    return tuple(said)


def _bunches(recording: Recording) -> list[str]:
    # Whoever stamps messages when it comes to read them says nothing of when they were sent.
    said = []
    for name in CONTINUOUS:
        series: TimeSeries | None = recording.streams.get(name)
        if series is None or len(series) < 2:
            continue
        steps = np.diff(series.times)
        steps = steps[steps < max(rec.recording.DEFAULT_GAP, float(np.median(steps)))]
        if not steps.size:
            continue
        share = float(np.mean(steps < limits()['bunched_interval'] * float(np.mean(steps))))
        if share > limits()['bunched_share']:
            said.append(f'Stream {name} comes in bunches: {100.0 * share:.0f} % of its stamps '
                        f'follow the one before within {limits()["bunched_interval"]:g} of the '
                        'mean interval; they say when messages were received, not when they '
                        'were sent, and a fit takes them for that')
    return said


def _silences(recording: Recording) -> list[str]:
    # Commands that outlive a sensor, or begin before it, are not compared.
    if 'command' not in recording.streams or not len(recording.command):
        return []
    said = []
    end = float(recording.command.times[-1])
    for name in CONTINUOUS[1:]:
        series: TimeSeries | None = recording.streams.get(name)
        if series is not None and len(series):
            silent = end - float(series.times[-1])
            if silent > max(1.0, 0.05 * recording.duration):
                said.append(f'Stream {name} ends {silent:.1f} s before the commands do')
    return said


def _parameters(parts: Sequence[rec.Segment], husky: Husky
                ) -> tuple[Table, tuple[str, ...], tuple[str, ...]]:
    """Return how well the drive can determine the model's free parameters, without a fit."""
    columns = ('parameter', 'nominal', 'unit', 'expected 95 % half width', 'verdict')
    title = 'Parameters that this drive can determine (before any fit)'
    empty = Table(title, columns, ())
    try:
        model = husky.model
        used = observations(parts)
        unknowns = unknowns_of(model, free_names(model, ()), ())
        problem, solution, _ = refine(used, model, unknowns, {}, lambda word: None, steps=0)
    except (FitError, RecordingError):
        return empty, (), ()  # what is missing is said elsewhere
    sure = confidence(problem, solution)
    rows = []
    values = np.array([solution.values[u.name] for u in sure.unknowns])
    for unknown, value, low, high in zip(sure.unknowns, values, sure.low, sure.high, strict=True):
        half = 0.5 * float(high - low) / max(abs(float(value)), 1e-12)
        entry = husky.parameters.entry(unknown.name)
        rows.append((unknown.name, entry.value, entry.unit, plus_minus(half),
                     'determined' if half < limits()['wide_interval'] else 'hardly determined'))
    return Table(title, columns, tuple(rows)), undetermined(sure, values), ()
