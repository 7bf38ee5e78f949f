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
from lg_husky_sim.diagnosis.candidates import changed_candidates, effect_entries
from lg_husky_sim.diagnosis.fits import fit_structure
from lg_husky_sim.errors import DiagnosisError, LgHuskyError
from lg_husky_sim.husky.effects import check_distinct, Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import Segment
import numpy as np

#: Deviations of the sensors that a drive is judged with [unit of the channel].
NOISE = {'wheel_left': 0.03, 'wheel_right': 0.03, 'yaw_rate': 0.01, 'advance': 0.04,
         'turn': 0.03}
#: Steps of a refit, and starts that it is tried from.
STEPS = 3
STARTS = 2
#: Separation from which one drive decides [nats].
DECISIVE = 20.0


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
    there = next((c for c in changed_candidates(structure, parameters)
                  if c.effect.id == name and side in ('', c.effect.side)), None)
    if there is not None:
        effect = replace(there.effect, late=False)
        entries = effect_entries(effect, there.starts[0])
        return Rival(name, structure.with_effect(effect), parameters.with_entries(*entries),
                     tuple(dict(start) for start in there.starts[:STARTS]))
    bare = Effect(name, side)
    effect = replace(bare, late=False)
    free = [p for p in effect.parameters() if not p.fixed]
    count = max(len(p.starts) for p in free)
    starts = tuple({p.name: p.starts[min(i, len(p.starts) - 1)] for p in free}
                   for i in range(count))
    middle = starts[len(starts) // 2]
    entries = effect_entries(effect, middle)
    whole = structure.with_effect(effect)
    check_distinct(whole.effects)
    compile_model(whole)
    ordered = (middle, *(s for s in starts if s is not middle))
    return Rival(name, whole, parameters.with_entries(*entries), ordered[:STARTS])


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


def recorded(rival: Rival, manoeuvre: Manoeuvre) -> Observations:
    """
    Return what the sensors would measure if an explanation were true.

    Parameters
    ----------
    rival : Rival
    manoeuvre : Manoeuvre

    Returns
    -------
    Observations
        Without noise.
    """
    plant = compile_model(rival.structure).at(rival.parameters)
    commands = manoeuvre.commands()
    streams = simulate_commands(plant, commands, 1.0)
    segment = Segment(manoeuvre.name, 0, float(commands.times[0]), float(commands.times[-1]),
                      {name: streams[name] for name in (
                          'command', 'wheels', 'wheel_angles', 'imu', 'pose')})
    return observations([segment])


def _metric(data: Observations) -> Metric:
    scale = np.zeros(data.measured.size)
    for name in data.channels:
        scale[data.channel_mask(name)] = 1.0 / NOISE[name]
    return Metric(scale, {name: np.ones(1) for name in data.channels})


def imitated(truth: Rival, other: Rival, manoeuvre: Manoeuvre) -> tuple[float, str]:
    """
    Refit an explanation to what another one would have recorded.

    Parameters
    ----------
    truth, other : Rival
    manoeuvre : Manoeuvre

    Returns
    -------
    float
        Half the sum of squares that the refit leaves, in units of the noise [nats].
    str
        Channel that it leaves most in.

    Raises
    ------
    DiagnosisError
        If the other one cannot be simulated.
    """
    data = recorded(truth, manoeuvre)
    metric = _metric(data)
    base = {name: other.parameters[name] for name in other.parameters}
    best = None
    for start in other.starts:
        sizes = {**base, **start}
        fit = fit_structure(data, other.structure, other.parameters, metric, sizes, sizes,
                            STEPS, polish=False)
        if fit is not None and (best is None or fit.solution.cost < best.solution.cost):
            best = fit
    if best is None:
        raise DiagnosisError(f'{other.name} cannot be simulated on {manoeuvre.name}')
    squares = 0.5 * ((data.measured - best.solution.predicted) * metric.scale) ** 2
    shares = {name: float(np.sum(squares[data.channel_mask(name)])) for name in data.channels}
    return best.solution.cost, max(shares, key=lambda name: shares[name])


def plan(one: Rival, two: Rival, manoeuvres: Sequence[Manoeuvre],
         progress: Callable[[], object] | None = None) -> tuple[Separation, ...]:
    """
    Rank drives by how well they tell two explanations apart.

    Parameters
    ----------
    one, two : Rival
    manoeuvres : sequence of Manoeuvre
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


def named_drive(effects: Sequence[str], structure: Structure, parameters: Parameters,
                speed: float = 0.8, rate: float = 0.8) -> str:
    """
    Return in words the drive that tells the first two of several effects apart.

    Parameters
    ----------
    effects : sequence of str
        At least two ids of the catalogue.
    structure, parameters
        The model that they are added to, at typical sizes.
    speed, rate : float
        Highest speed [m/s] and yaw rate [rad/s].

    Returns
    -------
    str
        Empty where no drive decides, or one of the two cannot be put into the model.
    """
    try:
        one, two = (typical(name, structure, parameters) for name in effects[:2])
        best = plan(one, two, drives(speed, rate))[0]
    except LgHuskyError:
        return ''
    return best.manoeuvre.about if best.nats > DECISIVE else ''
