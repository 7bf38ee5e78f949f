# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""One concealed case: draw it, drive it, publish its bags, seal its answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
import hashlib
import math
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import CommandError
from lg_husky_sim.proof import (
    catalogue,
    conventions,
    effects,
    manoeuvres,
    oracle,
    robots,
    sensors,
    world,
)
from lg_husky_sim.proof.bags import write_bag
from lg_husky_sim.proof.commands import send, Sent
from lg_husky_sim.proof.conventions import Conventions
from lg_husky_sim.proof.hidden import Change, Rng, Setting, size_of
from lg_husky_sim.proof.integrate import COLUMNS
from lg_husky_sim.proof.motion import alone, gates, Hidden, Pose, run
from lg_husky_sim.proof.sealing import plain, seal
from lg_husky_sim.proof.settings import settings
import numpy as np

KINDS = ('clean', 'single', 'pair', 'outside')
WORLDS = ('g1', 'g2', 'g3', 'g4')
WORLD_TITLES = {'g1': 'open loop, fine steps', 'g2': 'MuJoCo',
                'g3': 'four tyres, speed loop', 'g4': 'Bullet'}
ENGINES = ('g2', 'g4')
DATE = 1_700_000_000
"""One date [s] for all: it says nothing of the seed, from which an answer could be made again."""
HELD_OUT_DATE = 1_700_090_000 * 10 ** 9
_ROBOTS = {'g1': robots.open_loop_robot, 'g2': robots.engine_robot,
           'g3': robots.closed_loop_robot, 'g4': robots.engine_robot}


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
        'g1' (open-loop, fine-step), 'g2' (MuJoCo), 'g3' (four tyres and a speed loop) or
        'g4' (Bullet); all but the first come with baseline recordings.
    drive
        One of `manoeuvres.SETS`.
    effects
        Names; empty: drawn.
    severity
        'weak', 'medium', 'strong'; empty: drawn.
    onset
        'none', 'time' or 'place'; empty: drawn.
    tuning
        Leave out the families that tuning may not see.
    floor, wheels
        Level of roughness and kind of wheel speeds; empty: drawn.
    seconds
        Shortest and longest recording [s].
    complete
        No sensor is missing.

    """

    seed: int
    kind: str = 'single'
    world: str = 'g1'
    drive: str = 'full'
    effects: tuple[str, ...] = ()
    severity: str = ''
    onset: str = ''
    tuning: bool = True
    floor: str = ''
    wheels: str = ''
    seconds: tuple[float, float] = (40.0, 60.0)
    complete: bool = False

    def __post_init__(self) -> None:
        for name, value, allowed in (
                ('kind', self.kind, KINDS), ('world', self.world, WORLDS),
                ('drive', self.drive, tuple(manoeuvres.SETS)),
                ('severity', self.severity, ('', *catalogue.SEVERITIES)),
                ('onset', self.onset, ('', 'none', 'time', 'place'))):
            if value not in allowed:
                raise CommandError(f'{name} = {value!r} is none of {", ".join(allowed)}')


def _others(first: str, names: list[str]) -> list[str]:
    """Names that may join `first` in a pair: of another subsystem."""
    same = catalogue.subsystem(first)
    return [name for name in names if catalogue.subsystem(name) != same]


def choose(spec: Spec, rng: Rng) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names and severities of the effects of a case."""
    names = sorted(catalogue.SUBSYSTEM)
    names = [name for name in names if name not in catalogue.absent_from(spec.world)]
    if spec.kind == 'clean':
        chosen: tuple[str, ...] = ()
    elif spec.effects:
        chosen = spec.effects
    elif spec.kind == 'outside':
        outside = set(catalogue.OUTSIDE) - catalogue.absent_from(spec.world)
        chosen = (str(rng.choice(sorted(outside))),)
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


def _onset(spec: Spec, chosen: tuple[str, ...], rng: Rng) -> str:
    draw = float(rng.random())
    if not chosen or len(chosen) > 1 or spec.world != 'g1':
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


def _setting(name: str, severity: str, hidden: Hidden, case: oracle.Drives,
             tuning: bool, rng: Rng) -> Setting:
    commands = np.concatenate([drive.commands for drive in case.drives])
    fields = hidden.fields
    volts = fields['supply'] * fields['command_gain'] * (
        np.abs(commands[:, 0]) + fields['turn_ratio'] * np.abs(commands[:, 1]))
    steepest = max(float(np.abs(np.diff(drive.commands, axis=0)).max())
                   for drive in case.drives) * case.how.link.rate
    squares, peaks, charges = [10.0], [], [1.0]
    for k, drive in enumerate(case.drives):
        table = run(alone(hidden), drive, case.sent[k], case.how, case.poses[k], None,
                    step=oracle.step_of(hidden))
        currents = table[:, COLUMNS.index('current_left'):COLUMNS.index('current_right') + 1]
        squares.append(float((currents ** 2).sum(axis=0).max() * (table[1, 0] - table[0, 0])))
        peaks.append(float(np.abs(currents).max()))
        # By the power of both motors: what choppers draw is less than what motors do.
        volts_at = fields['resistance'] * currents + fields['torque_constant'] * table[
            :, COLUMNS.index('wheel_left'):COLUMNS.index('wheel_right') + 1]
        charges.append(float((volts_at * currents).sum() * (table[1, 0] - table[0, 0])
                             / fields['supply']))
    return Setting(
        fields, size_of(name, catalogue.SEVERITIES.index(severity), rng),
        float(np.abs(commands[:, 0]).max()), float(np.abs(commands[:, 1]).max()),
        float(min(volts.max(), fields['supply'])), min(steepest, 20.0), max(squares), max(peaks),
        max(charges), max(drive.duration for drive in case.drives), case.how.streams,
        conventions.left_out('forms', tuning))


def conceal(spec: Spec, robot: robots.Robot, case: oracle.Drives, chosen: tuple[str, ...],
            severities: tuple[str, ...],
            rng: Rng) -> tuple[Hidden, list[dict[str, Any]], list[Change]]:
    """Return the robot with its effects, what the answer says of them, and their changes."""
    onset = _onset(spec, chosen, rng)
    which = int(rng.integers(len(case.drives)))
    drive = case.drives[which]
    time = drive.moving_start + float(rng.uniform(0.3, 0.65)) * (
        drive.duration - drive.moving_start)
    hidden = Hidden(robot, robot.fields, robot.command, sensors.Faults(), 0.0, spec.world,
                    onset, which, time, onset_width=float(rng.choice([0.02, 0.2, 0.5])),
                    onset_sign=1.0 if rng.random() < 0.5 else -1.0)
    told, changes = [], []
    for name, severity in zip(chosen, severities, strict=True):
        setting = _setting(name, severity, hidden, case, spec.tuning, rng)
        change = effects.build(name, setting, rng)
        changes.append(change)
        hidden = with_change(hidden, change)
        told.append(_told(name, severity, setting.size, change))
    if onset == 'place':
        hidden = replace(hidden, onset_x=_border(hidden, case))
    return hidden, told, changes


def with_change(hidden: Hidden, change: Change) -> Hidden:
    """Return a robot with one effect more."""
    command: dict[str, Any] = _added(hidden.command, change.command)
    faults: dict[str, Any] = dict(change.senses)
    return replace(hidden, fields={**hidden.fields, **change.fields},
                   command=replace(hidden.command, **command),
                   faults=replace(hidden.faults, **faults), gusts=hidden.gusts + change.gusts)


def _added(path: Any, change: Mapping[str, float]) -> dict[str, Any]:
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


def _told(name: str, severity: str, size: float, change: Change) -> dict[str, Any]:
    numbers = settings()['effects'][name]
    return {'effect': name, 'in_list': name in catalogue.SUBSYSTEM, 'severity': severity,
            'size': size, 'unit': numbers['unit'], 'form': change.form,
            'side': 'both' if change.side == 'none' else change.side,
            'location': {'subsystem': catalogue.subsystem(name)},
            'related_answers': list(numbers['related']),
            'parameters': dict(change.parameters), 'onset': None}


def _border(hidden: Hidden, case: oracle.Drives) -> float:
    """Put the border of another floor where the robot passes about half way."""
    plain = alone(hidden)
    tables = [run(plain, drive, case.sent[k], case.how, case.poses[k], None,
                  step=oracle.step_of(plain)) for k, drive in enumerate(case.drives)]
    return float(np.quantile(np.concatenate(
        [table[:, COLUMNS.index('x')] for table in tables]), 0.5))


def _onset_json(hidden: Hidden, case: oracle.Drives) -> dict[str, Any] | None:
    if hidden.world != 'g1':
        return {'type': 'set'}
    if hidden.onset == 'time':
        before = case.drives[hidden.onset_recording].moving_start
        return {'type': 'time', 'recording': f'rec{hidden.onset_recording + 1}',
                'seconds_after_epoch': round(hidden.onset_time - before, 3)}
    if hidden.onset == 'place':
        return {'type': 'place', 'x0': round(hidden.onset_x, 3), 'sign': hidden.onset_sign}
    return None


def _start_pose(rng: Rng, elsewhere: bool) -> Pose:
    draw = rng.uniform(-1.0, 1.0, 3)
    if not elsewhere:
        return (0.0, 0.0, 0.0)
    return (float(3.0 * draw[0]), float(3.0 * draw[1]), float(math.pi * draw[2]))


def _drives(spec: Spec, how: Conventions, who: manoeuvres.Driver, rng: Rng,
            count: int = 3) -> oracle.Drives:
    """Draw one set of manoeuvres, and what becomes of their messages."""
    drives = manoeuvres.drive(spec.drive, who, rng, conventions.left_out('drives', spec.tuning),
                              count)
    elsewhere = bool(rng.random() < 0.5)
    sent: list[Sent] = [send(drive, how.link, how.jitter, rng) for drive in drives]
    return oracle.Drives(drives, sent, [_start_pose(rng, elsewhere) for _ in drives], how)


def _record(hidden: Hidden, case: oracle.Drives, folder: Path, clock: int, rng: Rng) -> int:
    """Drive and write `rec1`, ...; return the time after the last [s since the epoch]."""
    for index, drive in enumerate(case.drives):
        ground = robots.floor(case.how.floor, drive.duration, rng)
        table = run(hidden, drive, case.sent[index], case.how, case.poses[index], index, ground,
                    rng)
        faults = replace(hidden.faults, since=gates(hidden, index)[1])
        published = sensors.publish(table, case.sent[index], case.how, faults,
                                    drive.moving_start, hidden.robot.told_radius, rng)
        write_bag(folder / f'rec{index + 1}', published, clock * 10 ** 9)
        clock += int(drive.duration) + int(rng.integers(15, 200))
    return clock


def _hold_out(spec: Spec, hidden: Hidden, how: Conventions, who: manoeuvres.Driver, folder: Path,
              rng: Rng) -> None:
    """Write a fresh drive of the same robot, and what it would do without chance."""
    who = replace(who, moving=0.0, longest=min(who.longest, 60.0),
                  shortest=min(who.shortest, 40.0))
    case = _drives(spec, how, who, rng, 1)
    drive, sent = case.drives[0], case.sent[0]
    ground = robots.floor(how.floor, drive.duration, rng)
    table = run(hidden, drive, sent, how, case.poses[0], None, ground, rng)
    radius = hidden.robot.told_radius
    write_bag(folder / 'held1', sensors.publish(table, sent, how, hidden.faults, 0.0, radius, rng),
              HELD_OUT_DATE)
    truth = run(hidden, drive, sent, how, case.poses[0], None)
    write_bag(folder / 'truth1', sensors.ideal(truth, sent, how, hidden.faults), HELD_OUT_DATE)


def generate(spec: Spec, name: str, out_dir: Path, answers_dir: Path,
             held_out_dir: Path | None = None) -> str:
    """
    Make one concealed case and return the commitment to its answer.

    Parameters
    ----------
    spec
        What to draw.
    name
        Name of the case, 'case_0001'.
    out_dir
        Gets `<name>/rec1` and so on, or `<name>/before/rec1` and `<name>/after/rec1`
        where the question is what changed.
    answers_dir
        Gets `<name>.json`, sealed.
    held_out_dir
        Gets `<name>/held1` (a fresh recording of the same robot) and `<name>/truth1` (what it
        would do without chance under the same commands), where the robot has all sensors
        and no baseline. None: not made.

    Raises
    ------
    NoTraceError
        The drives that were drawn cannot show the effect.
    FloatingPointError
        The robot leaves its physical bounds.

    """
    rng = np.random.default_rng([spec.seed, WORLDS.index(spec.world), KINDS.index(spec.kind)])
    robot = _ROBOTS[spec.world](rng)
    chosen, severities = choose(spec, rng)
    needed = frozenset(conventions.STREAMS) if spec.complete else catalogue.needs(chosen)
    how = conventions.draw(rng, spec.tuning, needed, spec.floor, spec.wheels)
    who = manoeuvres.driver(rng, how.link.rate, spec.seconds,
                            float(settings()['conventions']['moving_start']))
    case = _drives(spec, how, who, rng)
    hidden, told, changes = conceal(spec, robot, case, chosen, severities, rng)
    worth = [_worth(replace(with_change(alone(hidden), change), onset=hidden.onset), case, spec)
             for change in changes]
    if worth and min(worth) < float(settings()['oracle']['no_trace']):
        raise NoTraceError(f'{[t["effect"] for t in told]} leave no trace: {worth} nats')
    clock = DATE
    if spec.world == 'g1':
        _record(hidden, case, out_dir / name, clock, rng)
    else:
        before = _drives(spec, how, who, rng)
        _record(alone(hidden), before, out_dir / name / 'before', clock, rng)
        _record(hidden, case, out_dir / name / 'after', clock + 90_000, rng)
    if held_out_dir is not None and spec.world == 'g1' and not how.missing \
            and how.wheels.kind != 'positions':
        _hold_out(spec, hidden, how, who, held_out_dir / name, rng)
    for item in told:
        item['onset'] = _onset_json(hidden, case)
    nominal = world.nominal()
    kind = {'clean': 'none'}.get(spec.kind, spec.kind) if spec.world == 'g1' else 'before_after'
    answer = {
        'kind': kind, 'name': ' + '.join(f'{t["effect"]}/{t["severity"]}' for t in told) or 'none',
        'level': oracle.level(min(worth)) if worth else 'clean', 'nats': worth,
        'world': WORLD_TITLES[spec.world], 'unseen': unseen(spec, case, told),
        'robot': {'wheel_radius_m': robot.told_radius, 'track_m': robot.told_track},
        'answers': told, 'regime': dict(how.regime), 'conventions': how.as_json(),
        'true_parameters': {key: value for key, value in hidden.fields.items()
                            if value != nominal[key]},
        'command_path': asdict(hidden.command), 'faults': asdict(hidden.faults),
        'recordings': [{'name': f'rec{k + 1}', 'manoeuvre': drive.name,
                        'seconds': drive.duration - drive.moving_start,
                        'moving_start': drive.moving_start, 'start_pose': case.poses[k]}
                       for k, drive in enumerate(case.drives)],
        'spec': asdict(spec), 'case': name, 'salt': hashlib.sha256(rng.bytes(32)).hexdigest()}
    return seal(answers_dir / f'{name}.json', plain(answer))


def unseen(spec: Spec, case: oracle.Drives, told: list[dict[str, Any]]) -> list[str]:
    """Return the families of a case that tuning never has."""
    regime = case.how.regime
    present = {
        'floor': {regime['colour']}, 'wheels': {regime['wheels']}, 'stamps': {regime['stamps']},
        'jitter': {regime['jitter form']}, 'base': {regime['base']},
        'drives': {drive.name for drive in case.drives},
        'forms': {f'{item["effect"]} {item["form"]}' for item in told}, 'worlds': {spec.world}}
    return sorted(f'{axis}: {name}' for axis, names in present.items()
                  for name in names & conventions.left_out(axis, tuning=True))


def _worth(hidden: Hidden, case: oracle.Drives, spec: Spec) -> float:
    """Return nats of an effect; in worlds with a baseline, against the same robot before."""
    if spec.world in ENGINES:
        # Engines are slow, and effects there are medium or strong.
        return math.inf
    return oracle.nats(hidden, case, np.random.default_rng([spec.seed, 5]))
