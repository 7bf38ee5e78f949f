# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed between recordings made before and recordings made after."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from lg_husky_sim.diagnosis.alike import with_common_errors
from lg_husky_sim.diagnosis.candidates import effect_entries
from lg_husky_sim.diagnosis.evidence import energy
from lg_husky_sim.diagnosis.fits import (
    extras_of,
    first_metric,
    Fit,
    fit_structure,
    recalibrate,
)
from lg_husky_sim.diagnosis.held_out import plant_of
from lg_husky_sim.diagnosis.search import Progress, Search, search
from lg_husky_sim.diagnosis.workers import HERE, Workers
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.problem import Observations

#: Most effects that the robot is given before the change is looked for.
BEFORE = 4
#: What a base that closes a speed loop has: all of it is tried at once, since each alone is found
#: in the guise of another.
BASE = (Effect('command_latency'), Effect('command_slew', shape='both'), Effect('speed_loop'))
#: Values of the same to begin from: a quick base and a slow one.
STARTS: tuple[Mapping[str, float], ...] = (
    {'latency': 0.05, 'slew_forward': 2.5, 'slew_yaw': 5.0, 'loop_lag': 0.1, 'loop_gain': 0.5,
     'loop_integral': 20.0},
    {'latency': 0.12, 'slew_forward': 1.0, 'slew_yaw': 2.0, 'loop_lag': 0.25, 'loop_gain': 0.5,
     'loop_integral': 20.0},
    {'latency': 0.12, 'slew_forward': 8.0, 'slew_yaw': 16.0, 'loop_lag': 0.25, 'loop_gain': 1.0,
     'loop_integral': 4.0})
#: A loop hides the dampings, so that their nominal values say little: factor on them to begin.
DAMPED = 5.0
#: Energy that numbers from all recordings may leave more in the earlier ones.
AS_GOOD = 1.01
#: Refits under scales that are taken anew.
AGAIN = 2
#: The same is kept if it leaves less than this part of what the plain robot leaves.
CLEARLY = 0.5


def search_change(whole: Observations, baseline: Collection[str], nominal: ModelFile,
                  progress: Progress, workers: Workers = HERE) -> Search:
    """
    Search for the effect that separates later recordings from earlier ones.

    The earlier recordings alone decide what the robot is like; its numbers are held from then on.
    What that model still gets wrong may be wrong in all recordings alike; only what is left
    then, in the later ones alone, is a change.

    Parameters
    ----------
    whole : Observations
        Of the earlier recordings, then of the later ones.
    baseline : collection of str
        Names of the earlier recordings.
    nominal : ModelFile
    progress : callable
    workers : Workers
        What does the independent work.

    Returns
    -------
    Search
        Its plain fit is the robot before the change.
    """
    before = whole.subset([piece.recording in baseline for piece in whole.pieces])
    progress('before the change: what the base closes', 0.0)
    start = closed_base(before, nominal.structure, nominal.parameters)
    if start is not None:
        start = _as_in_all(before, whole, start, nominal)
    known = start or search(
        before, nominal.structure, nominal.parameters,
        lambda text, share: progress(f'before the change: {text}', 0.4 * share),
        most=BEFORE, onsets=False, eager=True, workers=workers).final
    first = next(piece for piece in whole.pieces if piece.recording not in baseline)
    onset = Onset(OnsetKind.TIME, first.start, first.recording)
    exact = known.parameters.with_entries(*(
        replace(p, tolerance=0.0) for p in known.parameters.entries))
    moved = fit_structure(whole, known.structure, nominal.parameters,
                          first_metric(whole, whole.predict(plant_of(known), extras_of(known))),
                          known.solution.values, known.parameters, 0, polish=False) or known
    found = search(with_common_errors(whole, moved), known.structure, exact,
                   lambda text, share: progress(text, 0.4 + 0.5 * share),
                   change=onset, start=known, workers=workers)
    return replace(found, plain=_unheld(found.plain, known), final=_unheld(found.final, known))


def _unheld(fit: Fit, known: Fit) -> Fit:
    # The numbers were held for the search only.
    return replace(fit, parameters=fit.parameters.with_entries(*(
        replace(fit.parameters.entry(p.name), tolerance=p.tolerance)
        for p in known.parameters.entries)))


def closed_base(observations: Observations, structure: Structure, nominal: Parameters
                ) -> Fit | None:
    """
    Fit a base that delays, limits and follows the command in a speed loop.

    Parameters
    ----------
    observations : Observations
    structure : Structure
        Of the model in doubt.
    nominal : Parameters

    Returns
    -------
    Fit or None
        None where that is no clear improvement.
    """
    plain = recalibrate(observations, structure, nominal)
    lacking = [e for e in BASE if all(e.id != there.id for there in structure.effects)]
    whole = structure
    for effect in lacking:
        whole = whole.with_effect(effect)
    fits = []
    for start in STARTS:
        given = nominal.with_entries(*(
            p for effect in lacking for p in effect_entries(effect, start)))
        sizes = {name: given[name] for name in given}
        begin = {**sizes, **{name: DAMPED * sizes[name] for name in (
            'wheel_damping', 'yaw_damping')}}
        fits.append(_fitted(observations, whole, given, begin, plain))
    usable = [fit for fit in fits if fit is not None]
    if not usable:
        return None
    metric = first_metric(observations, usable[0].solution.predicted)
    best = min(usable, key=lambda fit: energy(observations, fit, metric))
    for start in STARTS:
        # Where the fit without a limit is good, none is found from there: put one in.
        limited = {name: start[name] for name in ('slew_forward', 'slew_yaw')}
        given = nominal.with_entries(*(
            p for effect in lacking for p in effect_entries(effect, start)))
        again = _fitted(observations, whole, given, {**best.solution.values, **limited}, best)
        if again is not None and energy(observations, again, metric) < energy(
                observations, best, metric):
            best = again
    if energy(observations, best, metric) > CLEARLY * energy(observations, plain, metric):
        return None
    return recalibrate(observations, whole, nominal, best)


def _as_in_all(before: Observations, whole: Observations, fit: Fit, nominal: ModelFile) -> Fit:
    # What all recordings together say of the base, if it explains the earlier ones as well:
    # these alone may leave open which of two numbers it is.
    everywhere = closed_base(whole, nominal.structure, nominal.parameters)
    if everywhere is None:
        return fit
    again = _fitted(before, everywhere.structure, nominal.parameters.with_entries(*(
        everywhere.parameters.entry(p.name) for e in everywhere.structure.effects
        for p in e.parameters())), everywhere.solution.values, fit)
    metric = first_metric(before, fit.solution.predicted)
    if again is None or energy(before, again, metric) > AS_GOOD * energy(before, fit, metric):
        return fit
    return recalibrate(before, again.structure, nominal.parameters, again)


def _fitted(observations: Observations, structure: Structure, parameters: Parameters,
            begin: Mapping[str, float], near: Fit) -> Fit | None:
    # Refits under scales that are taken anew; the first ones are those of a fit nearby.
    fit: Fit | None = near
    for _ in range(1 + AGAIN):
        if fit is None:
            break
        metric = first_metric(observations, fit.solution.predicted)
        sizes = {name: parameters[name] for name in parameters}
        fit = fit_structure(observations, structure, parameters, metric, begin, sizes, 8,
                            polish=False)
        if fit is not None:
            begin = fit.solution.values
    return fit
