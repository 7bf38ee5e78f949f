# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed between recordings made before and recordings made after."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from lg_husky_sim.diagnosis.alike import with_common_errors
from lg_husky_sim.diagnosis.candidates import effect_entries
from lg_husky_sim.diagnosis.evidence import energy
from lg_husky_sim.diagnosis.fits import Fit, fit_structure, first_metric, recalibrate
from lg_husky_sim.diagnosis.search import Progress, Search, search
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
#: Refits under scales that are taken anew.
AGAIN = 2
#: The same is kept if it leaves less than this part of what the plain robot leaves.
CLEARLY = 0.5


def search_change(whole: Observations, baseline: Collection[str], nominal: ModelFile,
                  progress: Progress, jobs: int = 1) -> Search:
    """
    Search for the effect that separates later recordings from earlier ones.

    The earlier recordings alone decide what the robot is like. What that model still gets wrong
    may be wrong in all recordings alike; only what is left then, in the later ones alone, is a
    change.

    Parameters
    ----------
    whole : Observations
        Of the earlier recordings, then of the later ones.
    baseline : collection of str
        Names of the earlier recordings.
    nominal : ModelFile
    progress : callable
    jobs : int
        Threads to use.

    Returns
    -------
    Search
        Its plain fit is the robot before the change.
    """
    before = whole.subset([piece.recording in baseline for piece in whole.pieces])
    progress('before the change: what the base closes', 0.0)
    start = closed_base(before, nominal.structure, nominal.parameters)
    known = start or search(
        before, nominal.structure, nominal.parameters,
        lambda text, share: progress(f'before the change: {text}', 0.4 * share),
        most=BEFORE, onsets=False, eager=True, jobs=jobs).final
    first = next(piece for piece in whole.pieces if piece.recording not in baseline)
    onset = Onset(OnsetKind.TIME, first.start, first.recording)
    exact = known.parameters.with_entries(*(
        replace(known.parameters.entry(name), tolerance=0.0) for name in nominal.parameters))
    return search(with_common_errors(whole, known), known.structure, exact,
                  lambda text, share: progress(text, 0.4 + 0.5 * share),
                  change=onset, start=known, jobs=jobs)


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
    metric = first_metric(observations, plain.solution.predicted)
    fits = []
    for start in STARTS:
        entries = [p for effect in lacking for p in effect_entries(effect, start)]
        given = nominal.with_entries(*entries)
        sizes = {name: given[name] for name in given}
        begin = {**sizes, **{name: DAMPED * sizes[name] for name in (
            'wheel_damping', 'yaw_damping')}}
        fit = fit_structure(observations, whole, given, metric, begin, sizes, 6, polish=False)
        for _ in range(AGAIN):
            if fit is not None:
                nearer = first_metric(observations, fit.solution.predicted)
                fit = fit_structure(observations, whole, nominal, nearer, fit.solution.values,
                                    fit.parameters, 8, polish=False)
        if fit is not None:
            fits.append(fit)
    if not fits:
        return None
    common = first_metric(observations, fits[0].solution.predicted)
    best = min(fits, key=lambda fit: energy(observations, fit, common))
    if energy(observations, best, metric) > CLEARLY * energy(observations, plain, metric):
        return None
    return recalibrate(observations, whole, nominal, best)
