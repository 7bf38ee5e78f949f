# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""One concealed case: draw it, drive it, publish its bags, seal its answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
import hashlib
import math
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import CommandError
from lg_husky_sim.proof import catalogue, effects, manoeuvres, robots, sensors, world
from lg_husky_sim.proof.bags import write_bag
from lg_husky_sim.proof.hidden import Change, Setting
from lg_husky_sim.proof.integrate import COLUMNS, Gate, integrate
from lg_husky_sim.proof.motion import (
    demand_of,
    gates,
    Hidden,
    LEAST_TRACE,
    Pose,
    run,
    visibility,
)
from lg_husky_sim.proof.sealing import seal
import numpy as np

KINDS = ('clean', 'single', 'pair', 'outside')
WORLDS = ('g1', 'g2', 'g3')
_ROBOTS = {'g1': robots.open_loop_robot, 'g2': robots.engine_robot,
           'g3': robots.closed_loop_robot}


class NoTraceError(Exception):
    """The drives that were drawn cannot show the effect that they should."""


@dataclass(frozen=True)
class Spec:
    """
    What to draw.

    Attributes
    ----------
    seed
        Everything else follows from it.
    kind
        'clean', 'single', 'pair' or 'outside'.
    world
        'g1' (open-loop, fine-step), 'g2' (rigid-body engine) or 'g3' (brush tyres and
        speed loop); 'g2' and 'g3' come with baseline recordings.
    drive
        'paper', 'full' or 'drive-like'.
    effects
        Names; empty: drawn.
    severity
        'weak', 'medium', 'strong'; empty: drawn.
    onset
        'none', 'time' or 'place'; empty: drawn.

    """

    seed: int
    kind: str = 'single'
    world: str = 'g1'
    drive: str = 'paper'
    effects: tuple[str, ...] = ()
    severity: str = ''
    onset: str = ''

    def __post_init__(self) -> None:
        for name, value, allowed in (
                ('kind', self.kind, KINDS), ('world', self.world, WORLDS),
                ('drive', self.drive, manoeuvres.SETS),
                ('severity', self.severity, ('', *catalogue.SEVERITIES)),
                ('onset', self.onset, ('', 'none', 'time', 'place'))):
            if value not in allowed:
                raise CommandError(f'{name} = {value!r} is none of {", ".join(allowed)}')


def _others(first: str, names: list[str]) -> list[str]:
    """Names that may join `first` in a pair: of another subsystem."""
    same = catalogue.subsystem(first)
    return [name for name in names if catalogue.subsystem(name) != same]


def choose(spec: Spec, rng: np.random.Generator) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names and severities of the effects of a case."""
    names = sorted(catalogue.SUBSYSTEM)
    names = [name for name in names if name not in catalogue.absent_from(spec.world)]
    if spec.kind == 'clean':
        chosen: tuple[str, ...] = ()
    elif spec.effects:
        chosen = spec.effects
    elif spec.kind == 'outside':
        chosen = (str(rng.choice(sorted(catalogue.OUTSIDE))),)
    else:
        if spec.kind == 'pair':
            # Pairs hold all along, and ground that is the same all along has not changed.
            names = [name for name in names if name != 'terrain_change']
        first = str(rng.choice(names))
        chosen = (first,)
        if spec.kind == 'pair':
            chosen = (first, str(rng.choice(_others(first, names))))
    levels = ('medium', 'strong') if spec.kind in ('pair', 'outside') \
        or spec.world != 'g1' else catalogue.SEVERITIES
    severity = tuple(spec.severity or str(rng.choice(levels)) for _ in chosen)
    return chosen, severity


def _onset(spec: Spec, chosen: tuple[str, ...], rng: np.random.Generator) -> str:
    draw = float(rng.random())
    if not chosen or len(chosen) > 1 or spec.world == 'g2':
        return 'none'
    name = chosen[0]
    if spec.onset:
        return spec.onset
    if name in catalogue.WHOLE_ONLY or name in catalogue.OUTSIDE:
        return 'none'
    if name == 'terrain_change':
        return 'time' if draw < 0.5 else 'place'
    if name in catalogue.OF_THE_FLOOR and draw < 0.2:
        return 'place'
    return 'time' if draw > 0.8 else 'none'


def _setting(robot: robots.Robot, fields: Mapping[str, float],
             drives: tuple[manoeuvres.Manoeuvre, ...], level: int,
             heavy: bool) -> Setting:
    commands = np.concatenate([drive.commands for drive in drives])
    volts = world.NOMINAL_SUPPLY * robot.command.gain * (
        np.abs(commands[:, 0]) + world.TURN_RATIO * np.abs(commands[:, 1]))
    loads = [_load(robot, drive) for drive in drives]
    steepest = max(float((np.abs(np.diff(drive.commands, axis=0)).max(axis=1)
                          / np.diff(drive.times)).max()) for drive in drives)
    return Setting(
        fields, float(np.abs(commands[:, 0]).max()), float(np.abs(commands[:, 1]).max()),
        float(min(volts.max(), world.NOMINAL_SUPPLY)), level, steepest,
        max(max(load[0] for load in loads), 10.0), max(load[1] for load in loads),
        heavy)


def _load(robot: robots.Robot, drive: manoeuvres.Manoeuvre) -> tuple[float, float]:
    """Return the integral of i² [A²·s] and the largest |i| [A] without any effect."""
    vector = world.vector(robot.fields)
    table = integrate(vector, vector, Gate(), demand_of(robot.fields, robot.command, drive, None),
                      np.zeros((2, 5)))
    currents = table[:, COLUMNS.index('current_left'):COLUMNS.index('current_right') + 1]
    period = float(table[1, 0] - table[0, 0])
    return float((currents ** 2).sum(axis=0).max() * period), float(np.abs(currents).max())


def conceal(spec: Spec, robot: robots.Robot, drives: tuple[manoeuvres.Manoeuvre, ...],
            rng: np.random.Generator) -> tuple[Hidden, list[dict[str, Any]], list[Change]]:
    """Return the robot with its effects, what the answer says of them, and their changes."""
    names, severities = choose(spec, rng)
    fields = dict(robot.fields)
    command: dict[str, Any] = {}
    senses: dict[str, Any] = {}
    wind = 0.0
    told, changes = [], []
    for name, severity in zip(names, severities, strict=True):
        level = catalogue.SEVERITIES.index(severity)
        setting = _setting(robot, fields, drives, level, heavy=spec.world != 'g1')
        change = effects.build(name, setting, rng)
        changes.append(change)
        fields.update(change.fields)
        command.update(_commanded(robot, fields, change))
        senses.update(change.senses)
        wind += change.gusts
        told.append({'effect': name, 'severity': severity, 'side': change.side,
                     'subsystem': catalogue.subsystem(name),
                     'known': name in catalogue.SUBSYSTEM,
                     'parameters': dict(change.parameters)})
    onset = _onset(spec, names, rng)
    which = int(rng.integers(len(drives)))
    time = float(rng.uniform(0.3, 0.65)) * drives[which].duration
    if onset == 'time':
        command['since'] = time
        senses['since'] = time
    hidden = Hidden(robot, fields, replace(robot.command, **command),
                    replace(robot.senses, **senses), wind, spec.world, onset, which, time)
    return hidden, told, changes


def _commanded(robot: robots.Robot, fields: Mapping[str, float],
               change: Change) -> Mapping[str, Any]:
    if fields['loop'] < 0.5 or robot.fields['loop'] > 0.5:
        return _added(robot.command, change.command)
    return change.command


def alone(hidden: Hidden, change: Change) -> Hidden:
    """Return the same robot with one of its effects only."""
    robot = hidden.robot
    fields = {**robot.fields, **change.fields}
    command: dict[str, Any] = {**_commanded(robot, fields, change)}
    senses: dict[str, Any] = {**change.senses}
    return replace(hidden, fields=fields, command=replace(robot.command, **command),
                   senses=replace(robot.senses, **senses), gusts=change.gusts)


def check_traces(hidden: Hidden, changes: Sequence[Change],
                 drives: tuple[manoeuvres.Manoeuvre, ...], poses: list[Pose]) -> None:
    """
    Refuse an effect that these drives cannot show: a weak reverse gear when none reverses.

    Raises
    ------
    NoTraceError
        An effect alone moves no channel by `LEAST_TRACE` of its noise. Faults of sensors and
        wind, which move nothing by themselves, are not looked at.

    """
    for change in changes:
        if change.senses or change.gusts > 0.0:
            continue
        seen = visibility(alone(hidden, change), drives, poses)
        if max(seen.values()) < LEAST_TRACE:
            raise NoTraceError(f'{dict(change.parameters)} leaves no trace: {seen}')


def _added(path: sensors.CommandPath, change: Mapping[str, float]) -> dict[str, float]:
    """Combine a command effect with what the robot's command path does anyway."""
    result = dict(change)
    for name in ('latency', 'loop_lag'):
        if name in result:
            result[name] += getattr(path, name)
    for name in ('limit_forward', 'limit_yaw', 'slew_forward', 'slew_yaw'):
        before = getattr(path, name)
        if name in result and before > 0.0:
            result[name] = min(result[name], before) if result[name] > 0.0 else before
    return result


def _gaps(senses: sensors.Senses, duration: float,
          rng: np.random.Generator) -> sensors.Senses:
    gaps = [(float(rng.uniform(2.0, duration - 3.0)), float(rng.uniform(0.15, 0.45)))
            for _ in range(int(rng.integers(0, 3)))]
    if rng.random() < 0.1:
        gaps.append((float(rng.uniform(5.0, duration - 5.0)), float(rng.uniform(0.6, 1.2))))
    return replace(senses, gaps=tuple(gaps))


def _start_pose(rng: np.random.Generator, elsewhere: bool) -> Pose:
    draw = rng.uniform(-1.0, 1.0, 3)
    if not elsewhere:
        return (0.0, 0.0, 0.0)
    return (float(3.0 * draw[0]), float(3.0 * draw[1]), float(math.pi * draw[2]))


def _place(hidden: Hidden, drives: tuple[manoeuvres.Manoeuvre, ...],
           poses: list[Pose]) -> Hidden:
    """Put the border of another floor where the robot passes about half way."""
    tables = [run(hidden, drive, pose, None, None, with_effect=False)
              for drive, pose in zip(drives, poses, strict=True)]
    passed = np.concatenate([table[:, COLUMNS.index('x')] for table in tables])
    return replace(hidden, onset_x=float(np.quantile(passed, 0.5)))


def generate(spec: Spec, name: str, out_dir: Path, answers_dir: Path,
             held_out_dir: Path) -> str:
    """
    Make one concealed case and return the commitment to its answer.

    Parameters
    ----------
    spec
        What to draw.
    name
        Name of the case, 'case_0001'.
    out_dir
        Gets `<name>/recordings/rec1` and so on, and `<name>/baseline/base1` where the
        question is what changed.
    answers_dir
        Gets `<name>.json`, sealed.
    held_out_dir
        Gets `<name>/held1`, ... (fresh recordings of the same robot) and `<name>/truth1`,
        ... (what the hidden robot would do without noise under the same commands).

    Raises
    ------
    NoTraceError
        The drives that were drawn cannot show the effect.
    FloatingPointError
        The robot leaves its physical bounds.

    """
    rng = np.random.default_rng([spec.seed, WORLDS.index(spec.world),
                                 KINDS.index(spec.kind)])
    robot = _ROBOTS[spec.world](rng)
    drives = manoeuvres.drive(spec.drive, rng)
    hidden, told, changes = conceal(spec, robot, drives, rng)
    elsewhere = bool(rng.random() < 0.5)
    poses = [_start_pose(rng, elsewhere) for _ in drives]
    if hidden.onset == 'place':
        hidden = _place(hidden, drives, poses)
    check_traces(hidden, changes, drives, poses)
    # One date for all: it says nothing of the seed, from which the answer could be made again.
    clock = 1_700_000_000
    for index, (drive, pose) in enumerate(zip(drives, poses, strict=True)):
        table = run(hidden, drive, pose, index, rng)
        senses = _gaps(replace(hidden.senses, since=gates(hidden, index)[1]),
                       drive.duration, rng)
        write_bag(out_dir / name / 'recordings' / f'rec{index + 1}',
                  sensors.publish(table, drive, senses, rng), clock * 10 ** 9)
        clock += int(drive.duration) + 15
    if spec.world != 'g1':
        for index, drive in enumerate(manoeuvres.again(spec.drive, drives, rng)):
            table = run(hidden, drive, poses[0], None, rng, with_effect=False)
            write_bag(out_dir / name / 'baseline' / f'base{index + 1}',
                      sensors.publish(table, drive, _gaps(robot.senses, drive.duration, rng),
                                      rng), (clock - 90_000) * 10 ** 9)
            clock += int(drive.duration) + 15
    for index, drive in enumerate(manoeuvres.held_out(spec.drive, drives, rng)):
        table = run(hidden, drive, poses[0], None, rng)
        senses = replace(hidden.senses, since=-1.0)
        write_bag(held_out_dir / name / f'held{index + 1}',
                  sensors.publish(table, drive, senses, rng), clock * 10 ** 9)
        truth = sensors.ideal(run(hidden, drive, poses[0], None, None), drive, senses)
        write_bag(held_out_dir / name / f'truth{index + 1}', truth, clock * 10 ** 9)
        clock += int(drive.duration) + 15
    salt = hashlib.sha256(rng.bytes(32)).hexdigest()
    answer = {
        'case': name, 'salt': salt, 'spec': asdict(spec), 'effects': told,
        'onset': {'kind': hidden.onset,
                  'recording': f'rec{hidden.onset_recording + 1}'
                  if hidden.onset == 'time' else None,
                  'time_s': hidden.onset_time if hidden.onset == 'time' else None,
                  'x_m': hidden.onset_x if hidden.onset == 'place' else None},
        'visibility': visibility(hidden, drives, poses) if told else {},
        'robot': {key: value for key, value in hidden.fields.items()
                  if value != world.nominal()[key]},
        'command_path': asdict(hidden.command), 'senses': asdict(hidden.senses),
        'floor': asdict(robot.floor), 'manoeuvres': [drive.name for drive in drives],
    }
    return seal(answers_dir / f'{name}.json', plain(answer))


def plain(value: Any) -> Any:
    """Return JSON's own types, with infinities as text."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value
