# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A base as sold: it delays the command, limits its change and closes a wheel-speed loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from lg_husky_sim.diagnosis.candidates import effect_entries
from lg_husky_sim.diagnosis.evidence import energy
from lg_husky_sim.diagnosis.fits import first_metric, Fit, fit_structure, recalibrate
from lg_husky_sim.diagnosis.workers import HERE, Workers
from lg_husky_sim.errors import DiagnosisError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml, shown

#: What a base that closes a speed loop has: all of it is tried at once, since each alone is found
#: in the guise of another.
BASE = (Effect('command_latency'), Effect('command_slew', shape='both'), Effect('speed_loop'))
#: A loop hides the dampings, so that their nominal values say little: factor on them to begin.
DAMPED = 5.0
#: Energy that numbers from all recordings may leave more in the earlier ones.
AS_GOOD = 1.01
#: Refits under scales that are taken anew, and steps of each.
AGAIN, STEPS = 2, 8
#: Steps by which a start is judged.
QUICK = 3
#: Tyres that share their grip between driving and scrubbing, steps of their fit, and the part of
#: the energy that they may leave to be kept.
TYRES = Effect('traction_saturation', shape='circle')
TYRE_STEPS, GRIP_SHOWS = 6, 0.99
#: The same is kept if it leaves less than this part of what the plain robot leaves.
CLEARLY = 0.5
#: Nothing more is tried where the first fits leave more than this part of it.
HARDLY = 0.9


@cache
def starts() -> tuple[tuple[Mapping[str, float], ...], tuple[float, ...]]:
    """
    Read ``config/closed_base.yaml``.

    Returns
    -------
    tuple of mapping
        Numbers of a loop to begin from, one mapping for each kind of base.
    tuple of float
        Limits of a wheel's force to begin from [N·m].

    Raises
    ------
    DiagnosisError
        If a number is missing, unknown or outside its bounds.
    """
    path = config_path('closed_base.yaml')
    content = read_yaml(path, DiagnosisError)

    def checked(where: str, entries: Mapping[str, object], effects: Sequence[Effect]
                ) -> dict[str, float]:
        known = {p.name: p for effect in effects for p in effect.parameters()}
        if set(entries) != set(known):
            raise DiagnosisError(f'{path}: {where} has {", ".join(sorted(entries))}; it needs '
                                 f'{", ".join(sorted(known))}')
        for name, value in entries.items():
            low, high = known[name].lower, known[name].upper
            if not isinstance(value, (int, float)) or not low <= value <= high:
                raise DiagnosisError(f'{path}: {where}.{name} = {shown(value)} is not a number '
                                     f'between {low:g} and {high:g}')
        return {name: float(str(value)) for name, value in entries.items()}

    try:
        bases = tuple(checked(f'bases.{kind}', {k: v for k, v in entries.items()
                                                if k != 'source'}, BASE)
                      for kind, entries in content['bases'].items())
        name, = (p.name for p in TYRES.parameters())
        tyres = tuple(checked('tyres', {name: value}, (TYRES,))[name]
                      for value in content['tyres']['values'])
    except (KeyError, TypeError, AttributeError) as error:
        raise DiagnosisError(f'{path} cannot be understood: {error}') from error
    return bases, tyres


def closed_base(observations: Observations, structure: Structure, nominal: Parameters,
                workers: Workers = HERE, known: Fit | None = None) -> Fit | None:
    """
    Fit a base that delays, limits and follows the command in a speed loop.

    Parameters
    ----------
    observations : Observations
    structure : Structure
        Of the model in doubt.
    nominal : Parameters
    workers : Workers
    known : Fit, optional
        Such a base, fitted to some of the observations: the only start then.

    Returns
    -------
    Fit or None
        None where that is no clear improvement.
    """
    bases, _ = starts()
    plain = recalibrate(observations, structure, nominal)
    lacking = [e for e in BASE if all(e.id != there.id for there in structure.effects)]
    whole = structure
    for effect in lacking:
        whole = whole.with_effect(effect)
    tasks = []
    for start in bases if known is None else ():
        given = nominal.with_entries(*(
            p for effect in lacking for p in effect_entries(effect, start)))
        sizes = {name: given[name] for name in given}
        begin = {**sizes, **{name: DAMPED * sizes[name] for name in (
            'wheel_damping', 'yaw_damping')}}
        tasks.append(Begun(observations, whole, given, begin, plain))
    if known is not None:
        given = nominal.with_entries(*(
            known.parameters.entry(p.name) for e in lacking for p in e.parameters()))
        tasks.append(Begun(observations, whole, given, known.solution.values, plain))
    usable = [fit for fit in workers.map(fitted, tasks) if fit is not None]
    if not usable:
        return None
    metric = first_metric(observations, usable[0].solution.predicted)
    best = min(usable, key=lambda fit: energy(observations, fit, metric))
    if energy(observations, best, metric) > HARDLY * energy(observations, plain, metric):
        return None
    tasks = []
    for start in bases:
        # Where the fit without a limit is good, none is found from there: put one in.
        limited = {name: start[name] for name in ('slew_forward', 'slew_yaw')}
        given = nominal.with_entries(*(
            p for effect in lacking for p in effect_entries(effect, start)))
        tasks.append(Begun(observations, whole, given, {**best.solution.values, **limited},
                           best, QUICK, 0))
    quick = [(energy(observations, fit, metric), k) for k, fit in enumerate(
        workers.map(fitted, tasks)) if fit is not None]
    if quick:
        again = fitted(replace(tasks[min(quick)[1]], steps=STEPS, again=AGAIN))
        if again is not None and energy(observations, again, metric) < energy(
                observations, best, metric):
            best = again
    if energy(observations, best, metric) > CLEARLY * energy(observations, plain, metric):
        return None
    return recalibrate(observations, whole, nominal, best)


def as_in_all(before: Observations, whole: Observations, fit: Fit, nominal: ModelFile,
              workers: Workers = HERE) -> Fit:
    """
    Take what all recordings say of a base, if it explains the earlier ones as well.

    The earlier ones alone may leave open which of two numbers it is.

    Parameters
    ----------
    before, whole : Observations
        The earlier recordings, and all.
    fit : Fit
        Of the earlier ones, by :func:`closed_base`.
    nominal : ModelFile
    workers : Workers

    Returns
    -------
    Fit
        Of the earlier ones.
    """
    everywhere = closed_base(whole, nominal.structure, nominal.parameters, workers, fit)
    if everywhere is None:
        return fit
    given = nominal.parameters.with_entries(*(
        everywhere.parameters.entry(p.name) for e in everywhere.structure.effects
        for p in e.parameters()))
    again = fitted(Begun(before, everywhere.structure, given, everywhere.solution.values, fit))
    metric = first_metric(before, fit.solution.predicted)
    if again is None or energy(before, again, metric) > AS_GOOD * energy(before, fit, metric):
        return fit
    return recalibrate(before, again.structure, nominal.parameters, again)


def with_adhesion(observations: Observations, fit: Fit, nominal: Parameters,
                  workers: Workers = HERE) -> Fit:
    """
    Give a base tyres whose grip is limited, if that explains its recordings better.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        By :func:`closed_base`.
    nominal : Parameters
    workers : Workers

    Returns
    -------
    Fit
        The same where the limit is out of reach.
    """
    if any(e.id == TYRES.id for e in fit.structure.effects):
        return fit
    structure = fit.structure.with_effect(TYRES)
    name, = (p.name for p in TYRES.parameters())
    known = {**{n: fit.parameters[n] for n in fit.parameters}, **fit.solution.values}
    tasks = [Begun(observations, structure, nominal.with_entries(
        *(fit.parameters.entry(p.name) for e in fit.structure.effects for p in e.parameters()),
        *effect_entries(TYRES, {name: start})), {**known, name: start}, fit, TYRE_STEPS, 1)
        for start in starts()[1]]
    metric = first_metric(observations, fit.solution.predicted)
    tried = [one for one in workers.map(fitted, tasks) if one is not None]
    best = min(tried, key=lambda one: energy(observations, one, metric), default=fit)
    if energy(observations, best, metric) > GRIP_SHOWS * energy(observations, fit, metric):
        return fit
    return recalibrate(observations, structure, nominal, best)


@dataclass(frozen=True, eq=False)
class Begun:
    """A fit that begins somewhere: arguments of :func:`fitted`."""

    observations: Observations
    structure: Structure
    parameters: Parameters
    begin: Mapping[str, float]
    near: Fit
    steps: int = STEPS
    again: int = AGAIN


def fitted(task: Begun) -> Fit | None:
    """Refit under scales that are taken anew each time; the first are those of a fit nearby."""
    fit: Fit | None = task.near
    begin, sizes = task.begin, {name: task.parameters[name] for name in task.parameters}
    for _ in range(1 + task.again):
        if fit is None:
            break
        metric = first_metric(task.observations, fit.solution.predicted)
        fit = fit_structure(task.observations, task.structure, task.parameters, metric, begin,
                            sizes, task.steps, polish=False)
        if fit is not None:
            begin = fit.solution.values
    return fit
