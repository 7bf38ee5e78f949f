# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed between recordings made before and recordings made after."""

from __future__ import annotations

from collections.abc import Collection

from lg_husky_sim.diagnosis.search import Progress, Search, search
from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.identification.problem import Observations

#: Most effects that the robot is given before the change is looked for.
BEFORE = 4


def search_change(whole: Observations, baseline: Collection[str], nominal: ModelFile,
                  progress: Progress, jobs: int = 1) -> Search:
    """
    Search for the effect that separates later recordings from earlier ones.

    The earlier recordings alone decide what the robot is like; all recordings together then
    decide what is on in the later ones only, so that whatever the model lacks in both cannot be
    taken for a change.

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
        Its plain fit is the robot before the change, recalibrated on everything.
    """
    before = whole.subset([piece.recording in baseline for piece in whole.pieces])
    known = search(before, nominal.structure, nominal.parameters,
                   lambda text, share: progress(f'before the change: {text}', 0.4 * share),
                   most=BEFORE, onsets=False, eager=True, jobs=jobs)
    first = next(piece for piece in whole.pieces if piece.recording not in baseline)
    onset = Onset(OnsetKind.TIME, first.start, first.recording)
    return search(whole, known.final.structure, nominal.parameters,
                  lambda text, share: progress(text, 0.4 + 0.5 * share),
                  change=onset, start=known.final, jobs=jobs)
