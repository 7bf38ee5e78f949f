# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How a log is made: what nobody should rely on is drawn over decades.

A family is one value of one axis ('floor: place', 'wheels: lowpass'); tuning leaves some of
them out (`left_out_of_tuning` of `config/blind_trial.yaml`), reports have all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
import math
from typing import Any

from lg_husky_sim.proof.hidden import logarithmic, Rng
from lg_husky_sim.proof.settings import settings

STREAMS = ('wheels', 'imu', 'pose')


@dataclass(frozen=True)
class FloorKind:
    """Roughness: rms force [N], moment, torque a side [N·m], and its colour."""

    level: str
    colour: str
    force: float
    moment: float
    drive: float
    time: float
    wavelength: float
    speed: float


@dataclass(frozen=True)
class Link:
    """
    The way of a command from its publisher to the base and to the recorder.

    `rate` [Hz], `delay` [s] on the way, `lost_robot` and `lost_recorder` shares of messages,
    `late` a share that comes `late_by` seconds later; `base_rate` [Hz] at which the base
    looks for commands (0: at once), `base_phase` in turns. `stamped`: TwistStamped.
    """

    rate: float
    delay: float
    lost_robot: float
    lost_recorder: float
    late: float
    late_by: float
    base_rate: float
    base_phase: float
    stamped: bool


@dataclass(frozen=True)
class Wheels:
    """
    How wheel speeds are made: see `sensors.wheel_speeds`; SI units.

    `stamp`: 0 the window's end, 0.5 its middle, 1 its start.
    """

    kind: str
    rate: float
    window: float
    step: float
    tick: float
    noise: float
    stamp: float
    positions: bool
    suffix: str
    order: tuple[int, ...]


@dataclass(frozen=True)
class Gyro:
    """How the gyro and the accelerometer read; SI units."""

    kind: str
    rate: float
    window: float
    noise: float
    bias: float
    step: float
    accelerometer: float
    accelerometer_bias: tuple[float, float]
    stamp: float


@dataclass(frozen=True)
class Poses:
    """How poses are measured; SI units."""

    rate: float
    noise: float
    heading: float
    gaps: int


@dataclass(frozen=True)
class Conventions:
    """All of it; `jitter` [s] of all stamps in the form `jitter_form`, `missing` streams."""

    floor: FloorKind
    link: Link
    wheels: Wheels
    gyro: Gyro
    poses: Poses
    jitter: float
    jitter_level: str
    jitter_form: str
    missing: tuple[str, ...]
    regime: Mapping[str, str]

    @property
    def streams(self) -> tuple[str, ...]:
        """Sensors that are recorded."""
        return tuple(name for name in STREAMS if name not in self.missing)

    def as_json(self) -> dict[str, Any]:
        """Return all as plain data."""
        return asdict(self)


def _of(rng: Rng, ends: Sequence[float]) -> float:
    low, high = float(ends[0]), float(ends[1])
    return logarithmic(rng, low, high) if low > 0.0 else float(rng.uniform(low, high))


def _one(rng: Rng, values: Sequence[Any], left_out: frozenset[str],
         weights: Sequence[float] | None = None) -> Any:
    pairs = [(value, 1.0 if weights is None else float(weights[k]))
             for k, value in enumerate(values) if str(value) not in left_out]
    total = sum(weight for _, weight in pairs)
    return pairs[int(rng.choice(len(pairs), p=[weight / total for _, weight in pairs]))][0]


def left_out(axis: str, tuning: bool) -> frozenset[str]:
    """Return the families of an axis that a tuning trial may not have (none of a report's)."""
    if not tuning:
        return frozenset()
    return frozenset(str(name) for name in settings()['left_out_of_tuning'].get(axis, ()))


def _floor(rng: Rng, numbers: Mapping[str, Any], tuning: bool, level: str) -> FloorKind:
    levels = numbers['levels']
    level = level or str(rng.choice(list(levels), p=[0.1, 0.3, 0.3, 0.3]))
    colour = str(_one(rng, numbers['colours'], left_out('floor', tuning)))
    force = _of(rng, levels[level])
    # White roughness has its power spread over all frequencies.
    size = force * (2.0 if colour == 'white' else 1.0)
    return FloorKind(
        level, colour, size, size * _of(rng, numbers['moment_arm']),
        size * _of(rng, numbers['drive_arm']), _of(rng, numbers['time']),
        _of(rng, numbers['wavelength']), _of(rng, numbers['speed']))


def _link(rng: Rng, numbers: Mapping[str, Any], tuning: bool) -> Link:
    base = 0.0
    if rng.random() < float(numbers['ticked']):
        low, high = (float(end) for end in numbers['tick'])
        slow = 'ticked below 25 Hz' in left_out('base', tuning)
        base = logarithmic(rng, max(low, 25.0) if slow else low, high)
    return Link(
        rate=float(rng.choice(numbers['rate'])), delay=_of(rng, numbers['delay']),
        lost_robot=float(rng.uniform(0.0, numbers['lost'])),
        lost_recorder=float(rng.uniform(0.0, numbers['lost'])),
        late=float(rng.choice(numbers['late'])), late_by=_of(rng, numbers['late_by']),
        base_rate=base, base_phase=float(rng.random()), stamped=bool(rng.random() < 0.6))


def _stamp(rng: Rng, numbers: Mapping[str, Any], tuning: bool) -> tuple[str, float]:
    kind = str(_one(rng, numbers['kinds'], left_out('stamps', tuning), numbers['weights']))
    return kind, {'start': 1.0, 'middle': 0.5, 'end': 0.0}[kind]


def _wheels(rng: Rng, numbers: Mapping[str, Any], tuning: bool, stamp: float,
            kind: str) -> Wheels:
    kind = kind or str(_one(rng, numbers['kinds'], left_out('wheels', tuning),
                            numbers['weights']))
    rate = float(rng.choice(numbers['rate']))
    window = 0.0
    if kind == 'difference':
        # Most drivers difference over their own period; others count over windows of any length.
        window = 1.0 / rate if rng.random() < 0.5 else _of(rng, numbers['window'])
    elif kind == 'lowpass':
        window = _of(rng, numbers['lowpass'])
    order = [int(k) for k in rng.permutation(4)]
    return Wheels(
        kind, rate, window, float(rng.choice(numbers['step'])) if kind == 'rounded' else 0.0,
        _of(rng, numbers['tick']), _of(rng, numbers['noise']),
        stamp if kind == 'difference' else 0.0,
        kind == 'positions' or bool(rng.random() >= float(numbers['speeds_alone'])),
        '_joint' if rng.random() < 0.5 else '', tuple(order))


def _gyro(rng: Rng, numbers: Mapping[str, Any], stamp: float) -> Gyro:
    kind = str(rng.choice(numbers['kinds']))
    window = 0.0 if kind == 'instant' else _of(rng, numbers['window'])
    bias = float(numbers['accelerometer_bias'])
    return Gyro(kind, float(rng.choice(numbers['rate'])), window, _of(rng, numbers['noise']),
                float(rng.normal(0.0, numbers['bias'])), float(rng.choice(numbers['step'])),
                _of(rng, numbers['accelerometer']),
                (float(rng.normal(0.0, bias)), float(rng.normal(0.0, bias))),
                stamp if kind == 'mean' else 0.0)


def _missing(rng: Rng, shares: Mapping[str, Any], needed: frozenset[str]) -> tuple[str, ...]:
    draw = float(rng.random())
    for name, stream in (('gyro', 'imu'), ('pose', 'pose'), ('wheels', 'wheels')):
        draw -= float(shares[name])
        if draw < 0.0:
            return () if stream in needed else (stream,)
    return ()


def _noise_level(wheels: Wheels, gyro: Gyro, poses: Poses, numbers: Mapping[str, Any]) -> str:
    """Return 'fine', 'medium' or 'coarse': where gyro and pose lie in their decades."""
    shares = []
    for value, ends in ((gyro.noise, numbers['gyro']['noise']),
                        (poses.noise, numbers['pose']['noise']),
                        (wheels.tick, numbers['wheels']['tick'])):
        shares.append(math.log(value / ends[0]) / math.log(ends[1] / ends[0]))
    mean = sum(shares) / len(shares)
    return 'fine' if mean < 0.42 else 'coarse' if mean > 0.58 else 'medium'


def draw(rng: Rng, tuning: bool, needed: frozenset[str] = frozenset(),
         floor: str = '', wheels: str = '') -> Conventions:
    """
    Draw how one robot's logs are made.

    Parameters
    ----------
    rng
        Where chance comes from.
    tuning
        Leave out the families that tuning may not see.
    needed
        Streams without which the hidden effect cannot be seen at all.
    floor, wheels
        A level and a kind that are given; drawn where empty.

    """
    numbers = settings()['conventions']
    ground = _floor(rng, numbers['floor'], tuning, floor)
    link = _link(rng, numbers['commands'], tuning)
    stamp_name, stamp = _stamp(rng, numbers['stamps'], tuning)
    encoders = _wheels(rng, numbers['wheels'], tuning, stamp, wheels)
    gyro = _gyro(rng, numbers['gyro'], stamp)
    numbers_pose = numbers['pose']
    poses = Poses(float(rng.choice(numbers_pose['rate'])), _of(rng, numbers_pose['noise']),
                  _of(rng, numbers_pose['heading']),
                  int(rng.integers(0, int(numbers_pose['gaps']) + 1)))
    levels = numbers['jitter']['levels']
    level = str(rng.choice(list(levels)))
    form = str(_one(rng, numbers['jitter']['forms'], left_out('jitter', tuning)))
    missing = _missing(rng, numbers['missing'], needed)
    base = 'at once' if link.base_rate == 0.0 else \
        'ticked' if link.base_rate >= 25.0 else 'ticked below 25 Hz'
    speeds = encoders.kind
    if speeds == 'difference':
        speeds = 'difference up to 60 ms' if encoders.window <= 0.06 else 'difference beyond 60 ms'
    regime = {
        'floor': ground.level, 'colour': 'none' if ground.level == 'none' else ground.colour,
        'wheels': 'absent' if 'wheels' in missing else speeds,
        'stamps': stamp_name if encoders.stamp or encoders.kind == 'difference' else 'end',
        'jitter': level, 'jitter form': form, 'base': base,
        'commands': 'below 15 Hz' if link.rate < 15.0 else '15 Hz and more',
        'noise': _noise_level(encoders, gyro, poses, numbers),
        'missing': ', '.join(missing) or 'nothing'}
    return Conventions(ground, link, encoders, gyro, poses, _of(rng, levels[level]), level, form,
                       missing, regime)
