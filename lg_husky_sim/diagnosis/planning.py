# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which drive tells two explanations apart.

Either explanation is simulated on a list of drives; the other one is refitted to it, its own
parameters together with what a recalibration can move. What it cannot imitate, in units of
the sensors' noise, is what a recording of that drive would say in favour of the truth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive, drive_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import NAMES as LEVELS
from lg_husky_sim.diagnosis.evidence.noise import Noise, UNITS
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns, effect_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.diagnosis.localisation import NAMES
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import DiagnosisError, LgHuskyError
from lg_husky_sim.husky.by_hand import other_robot
from lg_husky_sim.husky.effects import check_distinct, Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import packaged
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.robot_size import speeds_of
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import Segment
from lg_husky_sim.threads import Threads
import numpy as np


@dataclass(frozen=True)
class Rival:
    """
    An explanation: a structure with numbers.

    Parameters
    ----------
    name : str
    structure : Structure
    parameters : Parameters
    starts : tuple of mapping
        Sizes of its last effect from which a refit begins.

    """

    name: str
    structure: Structure
    parameters: Parameters
    starts: tuple[dict[str, float], ...]


@dataclass(frozen=True)
class Separation:
    """
    How well a drive tells two explanations apart.

    Parameters
    ----------
    manoeuvre : Manoeuvre
    nats : float
        Least evidence in favour of the truth, whichever of the two is true [nats].
    channel : str
        The channel that says most.

    """

    manoeuvre: Manoeuvre
    nats: float
    channel: str


def typical(name: str, structure: Structure, parameters: Parameters, side: str = '') -> Rival:
    """
    Return an effect of the catalogue at a typical size on top of a model.

    One that the model has already is taken with other numbers.

    Parameters
    ----------
    name : str
        Id of the catalogue.
    structure, parameters
        The model.
    side : str
        Left, right or both; the catalogue's first one if empty.

    Returns
    -------
    Rival

    Raises
    ------
    ParameterError
        If the effect is unknown or does not fit the structure.

    """
    there = next((e for e in structure.effects if e.id == name and side in ('', e.side)
                  and not e.again), None)
    if there is not None:
        return _changed(there, structure, parameters)
    bare = Effect(name, side, robot=structure.robot)
    effect = replace(bare, late=False)
    free = [p for p in effect.parameters() if not p.fixed]
    count = max(len(p.starts) for p in free)
    starts = tuple({p.name: p.starts[min(i, len(p.starts) - 1)] for p in free}
                   for i in range(count))
    middle = starts[len(starts) // 2]
    entries = entries_of(effect, middle)
    whole = structure.with_effect(effect)
    check_distinct(whole.effects)
    compile_model(whole)
    ordered = (middle, *(s for s in starts if s is not middle))
    return Rival(name, whole, parameters.with_entries(*entries),
                 ordered[:int(setting('planned_starts'))])


def _changed(there: Effect, structure: Structure, parameters: Parameters) -> Rival:
    # The same effect with other numbers.
    effect = replace(there, late=False, again=True)
    now = {later.name: parameters[before.name] for before, later in zip(
        there.parameters(), effect.parameters(), strict=True)}
    free = [p for p in effect.parameters() if not p.fixed]
    starts = []
    for factor in (setting('planned_change'), 1.0 / setting('planned_change')):
        starts.append({p.name: min(max(now[p.name] + (factor - 1.0) * max(
            abs(now[p.name]), 0.5 * abs(p.starts[0])), p.lower), p.upper) for p in free})
    entries = entries_of(effect, {**now, **starts[0]})
    return Rival(there.id, structure.with_effect(effect), parameters.with_entries(*entries),
                 tuple(starts))


def drives(speed: float, rate: float) -> tuple[Manoeuvre, ...]:
    """
    Return the drives that are tried.

    Parameters
    ----------
    speed : float
        Highest speed [m/s].
    rate : float
        Highest yaw rate [rad/s].

    Returns
    -------
    tuple of Manoeuvre
        Each begins and ends at rest.

    """
    def script(name: str, about: str, *steps: tuple[float, float, float, float]) -> Manoeuvre:
        rest = Step(1.5, 0.0, 0.0)
        return Manoeuvre(name, (rest, *(Step(seconds, speed * v, rate * w, ramp)
                                        for seconds, v, w, ramp in steps),
                                Step(2.0, 0.0, 0.0)), about=about)

    slow = [(1.2, 0.35 * math.sin(0.5 * math.pi * i), 0.0, 1.2) for i in range(1, 13)]
    return (
        script('two_speeds', 'straight slowly and fast, both ways',
               (5.0, 0.2, 0.0, 0.3), (4.0, 1.0, 0.0, 0.3), (5.0, -0.2, 0.0, 0.6),
               (4.0, -1.0, 0.0, 0.3), (4.0, 0.5, 0.0, 0.6)),
        script('sharp_steps', 'jumps of the speed from rest and back',
               *((2.0, v, 0.0, 0.0) for v in (0.5, 0.0, 1.0, 0.0, -0.5, 0.0, -1.0, 0.0))),
        script('hard_reversals', 'full speed ahead and back without a stop',
               *((2.5, v, 0.0, 0.0) for v in (1.0, -1.0, 1.0, -1.0))),
        script('slow_through_zero', 'slowly to and fro through rest', *slow),
        script('spin_rates', 'turning on the spot at several rates, both ways',
               *((3.0, 0.0, w, 0.2) for w in (0.25, -0.25, 0.5, -0.5, 1.0, -1.0))),
        script('turns_at_speeds', 'the same turn at several speeds, ahead and in reverse',
               *((3.5, v, 0.6, 0.4) for v in (0.2, 0.5, 1.0)),
               *((3.5, v, 0.6, 0.4) for v in (-0.2, -0.5, -1.0))),
        script('still_then_spin', 'standing still, then several turns on the spot',
               (5.0, 0.0, 0.0, 0.0), (8.0, 0.0, 1.0, 0.3), (5.0, 0.0, 0.0, 0.3),
               (8.0, 0.0, -1.0, 0.3)),
        script('four_headings', 'the same straight run in four headings',
               *(step for _ in range(4) for step in (
                   (4.0, 0.7, 0.0, 0.4), (0.5 * math.pi / (0.6 * rate), 0.0, 0.6, 0.0)))),
        script('long_straight', 'a long straight run, both ways',
               (10.0, 0.8, 0.0, 0.5), (10.0, -0.8, 0.0, 1.0)),
        script('mixed', 'speeds and turns of all kinds',
               (2.0, 0.5, 0.5, 0.0), (2.0, 1.0, -0.5, 0.0), (2.0, 0.3, 1.0, 0.0),
               (2.0, -0.6, 0.4, 0.0), (2.0, 0.0, -0.8, 0.0), (2.0, 0.8, 0.2, 0.0),
               (2.0, -1.0, -0.3, 0.0)),
    )


def recorded(rival: Rival, manoeuvre: Manoeuvre) -> Drive:
    """
    Return what the sensors would measure if an explanation were true.

    Parameters
    ----------
    rival : Rival
        The explanation, as a model with its numbers.
    manoeuvre : Manoeuvre
        Driven from rest.

    Returns
    -------
    Drive
        Without noise.

    Raises
    ------
    DiagnosisError
        If the drive is too short.

    """
    plant = compile_model(rival.structure).at(rival.parameters)
    commands = manoeuvre.commands()
    streams = simulate_commands(plant, commands, 1.0)
    drive = drive_of(Segment(
        manoeuvre.name, 0, float(commands.times[0]), float(commands.times[-1]),
        {name: streams[name] for name in ('command', 'wheels', 'wheel_angles', 'imu', 'pose')}))
    if drive is None:
        raise DiagnosisError(f'{manoeuvre.name} is too short to distinguish anything')
    return drive


def imitated(truth: Rival, other: Rival, manoeuvre: Manoeuvre) -> tuple[float, str]:
    """
    Refit an explanation to what another one would have recorded.

    Parameters
    ----------
    truth, other : Rival
        The explanation that is recorded, and the one that is refitted to it.
    manoeuvre : Manoeuvre
        Driven from rest by both.

    Returns
    -------
    float
        Half the sum of squares of the innovations that the refit leaves, and of the distances
        from the nominal numbers in tolerances [nats].
    str
        Channel that it leaves most in.

    Raises
    ------
    DiagnosisError
        If the other one cannot be simulated.

    """
    drive = recorded(truth, manoeuvre)
    noise = Noise({name: other.structure.robot.factor(UNITS.get(name, '1')) * setting(
        f'planned_{name}') for name in LEVELS})
    base = base_unknowns(other.parameters, [drive])
    best = None
    with Threads(1) as pool:
        for start in other.starts:
            own = effect_unknowns(other.structure.effects[-1], start)
            entries = entries_of(other.structure.effects[-1], start)
            point = beginning(other.structure, (*base, *own),
                              other.parameters.with_entries(*entries), Reading())
            try:
                evidence = evidence_of([drive], [drive.recording], point, noise, pool)
                fit = evidence.fit(point, rounds=int(setting('planned_rounds')))
            except LgHuskyError:
                continue
            nats = 0.5 * float(np.sum(fit.whitened ** 2) + np.sum(fit.point.prior_residuals ** 2))
            if best is None or nats < best[0]:
                channels = drive.channels[evidence.whiteners[0].frame.order]
                best = (nats, fit.whitened ** 2, channels)
    if best is None:
        raise DiagnosisError(f'{other.name} cannot be simulated on {manoeuvre.name}')
    shares: dict[str, float] = {}
    for code in np.unique(best[2]).tolist():
        name = NAMES[Channel(code)][0]
        shares[name] = shares.get(name, 0.0) + float(np.sum(best[1][best[2] == code]))
    return best[0], max(shares, key=lambda name: shares[name])


def plan(one: Rival, two: Rival, manoeuvres: Sequence[Manoeuvre],
         progress: Callable[[], object] | None = None) -> tuple[Separation, ...]:
    """
    Rank drives by how well they tell two explanations apart.

    Parameters
    ----------
    one, two : Rival
        Explanations, as models with their numbers; each has to imitate the other.
    manoeuvres : sequence of Manoeuvre
        Drives to rank.
    progress : callable, optional
        Called after each.

    Returns
    -------
    tuple of Separation
        Best first; drives on which a model blows up are left out.

    Raises
    ------
    DiagnosisError
        If none could be simulated.

    """
    found = []
    for manoeuvre in manoeuvres:
        try:
            tries = [imitated(one, two, manoeuvre), imitated(two, one, manoeuvre)]
        except LgHuskyError:
            tries = []
        if tries:
            nats, channel = min(tries)
            found.append(Separation(manoeuvre, nats, channel))
        if progress is not None:
            progress()
    if not found:
        raise DiagnosisError(f'{one.name} and {two.name} can be simulated on no drive')
    return tuple(sorted(found, key=lambda s: -s.nats))


def usual_speeds(parameters: Parameters) -> tuple[float, float]:
    """
    Return how fast planned drives are.

    Parameters
    ----------
    parameters : Parameters
        Of the robot's model.

    Returns
    -------
    float
        Highest speed [m/s], which asks no more of a slower robot than of a Husky.
    float
        Highest yaw rate [rad/s], likewise.

    """
    husky = packaged().parameters
    forward, yaw, _ = speeds_of(parameters, husky) if other_robot(husky, parameters) else (
        1.0, 1.0, 1.0)
    return (setting('planned_speed') * min(1.0, forward),
            setting('planned_rate') * min(1.0, yaw))


def named_drive(effects: Sequence[str], structure: Structure, parameters: Parameters) -> str:
    """
    Return in words the drive that tells the first two of several effects apart.

    Parameters
    ----------
    effects : sequence of str
        At least two ids of the catalogue.
    structure, parameters
        The model that they are added to, at typical sizes.

    Returns
    -------
    str
        Empty where no drive decides, or one of the two cannot be put into the model.

    """
    try:
        one, two = (typical(name, structure, parameters) for name in effects[:2])
        best = plan(one, two, drives(*usual_speeds(parameters)))[0]
    except LgHuskyError:
        return ''
    return best.manoeuvre.about if best.nats > setting('decisive') else ''
