# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed between recordings made before and recordings made after."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from lg_husky_sim.diagnosis.alike import with_common_errors
from lg_husky_sim.diagnosis.closed_base import as_in_all, closed_base, with_adhesion
from lg_husky_sim.diagnosis.fits import (
    extras_of,
    first_metric,
    Fit,
    fit_structure,
    recalibrate,
)
from lg_husky_sim.diagnosis.held_out import plant_of
from lg_husky_sim.diagnosis.search import Progress, Search, search
from lg_husky_sim.diagnosis.weighed import centred, weighed
from lg_husky_sim.diagnosis.workers import HERE, Workers
from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.identification.problem import Observations

#: Most effects that the robot is given before the change is looked for.
BEFORE = 3


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
        Of the earlier recordings, then of the later ones; some of either.
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
    earlier = [piece.recording in baseline for piece in whole.pieces]
    before = whole.subset(earlier)
    progress('before the change: what the base closes', 0.0)
    start = closed_base(before, nominal.structure, nominal.parameters, workers)
    if start is not None:
        closed = as_in_all(before, whole, start, nominal, workers)
        known = with_adhesion(before, closed, nominal.parameters, workers)
    else:
        open_loop = recalibrate(before, nominal.structure, nominal.parameters)
        tyred = with_adhesion(before, open_loop, nominal.parameters, workers)
        known = search(
            before, tyred.structure, nominal.parameters,
            lambda text, share: progress(f'before the change: {text}', 0.4 * share),
            most=BEFORE, onsets=False, start=tyred, eager=True, workers=workers).final
    loaded, known = known, weighed(known)
    own = nominal.parameters if known is loaded else centred(nominal.parameters, known)
    first = next(piece for piece in whole.pieces if piece.recording not in baseline)
    onset = Onset(OnsetKind.TIME, first.start, first.recording)
    exact = known.parameters.with_entries(*(
        replace(p, tolerance=0.0) for p in known.parameters.entries))
    moved = fit_structure(whole, known.structure, own,
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
