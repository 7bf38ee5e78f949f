# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which of the screened candidates, and with which onset, are worth a refit."""

from __future__ import annotations

from collections.abc import Sequence

from lg_husky_sim.diagnosis.onsets import Onsets
from lg_husky_sim.diagnosis.rivals import LATER, LEAST_GAIN
from lg_husky_sim.diagnosis.screening import Score

#: Part of a late effect's screened gain from which the same effect is tried as always there.
ALWAYS = 0.5
#: How much more a change must explain after it than in any recording before it.
PLACEBO = 2.0


def changes(scores: Sequence[Score], whole: Onsets) -> list[Score]:
    """
    Choose the onset of each change between recordings: a moment inside one must clearly pay.

    Parameters
    ----------
    scores : sequence of Score
        With all onsets of each candidate.
    whole : Onsets
        The beginning of the later recordings.

    Returns
    -------
    list of Score
        One of each candidate, best first.
    """
    given = {onset for onset, _ in whole.onsets}
    late = beyond_placebo([s for s in scores if s.onset is not None])
    best = {s.signature.candidate.label: s for s in late if s.onset in given}
    for score in late:
        label = score.signature.candidate.label
        if score.onset not in given and (label not in best or score.gain > (
                LATER[0] + (1.0 + LATER[1]) * best[label].gain)):
            best[label] = score
    return sorted(best.values(), key=lambda s: -s.gain)


def beyond_placebo(scores: Sequence[Score]) -> list[Score]:
    """
    Keep the changes that explain more than they would if made elsewhere.

    Where a model is wrong in the same way before and after a change, an effect that is switched
    on in any one recording explains something; only one that explains several times as much
    where the change was is a change.

    Parameters
    ----------
    scores : sequence of Score
        Each with its ``placebo``.

    Returns
    -------
    list of Score
    """
    return [s for s in scores if s.gain > PLACEBO * s.placebo + LEAST_GAIN[0]]


def always(serious: Sequence[Score], scores: Sequence[Score]) -> list[Score]:
    """
    Return those that are serious as late effects only, as effects that were always there.

    A straight line may prefer an onset that no refit confirms, or reaches from there.

    Parameters
    ----------
    serious : sequence of Score
        That are refitted.
    scores : sequence of Score
        All, under the metric that forgives slow errors least.

    Returns
    -------
    list of Score
        Not yet among the serious ones.
    """
    early = {s.signature.candidate.label: s for s in scores if s.onset is None}
    late: dict[str, float] = {}
    for score in (s for s in scores if s.onset is not None):
        label = score.signature.candidate.label
        late[label] = max(late.get(label, 0.0), score.gain)
    known = {s.signature.candidate.label for s in serious if s.onset is None}
    asked = dict.fromkeys(s.signature.candidate.label for s in serious)
    return [early[label] for label in asked if label not in known and label in early
            and early[label].gain > ALWAYS * late.get(label, 0.0)]


def shortlist(scores: Sequence[Score], most: int) -> list[Score]:
    """
    Return the best few, at most two variants of one effect.

    Parameters
    ----------
    scores : sequence of Score
        Best first.
    most : int

    Returns
    -------
    list of Score
        With an onset only where it clearly helps.
    """
    plain = {s.signature.candidate.label: s.gain for s in scores if s.onset is None}
    chosen: list[Score] = []
    counts: dict[str, int] = {}
    for score in scores:
        name = score.signature.candidate.effect.id
        without = plain.get(score.signature.candidate.label, 0.0)
        if score.onset is not None and score.gain < 1.1 * without + 15.0:
            continue
        if counts.get(name, 0) >= 2:
            continue
        counts[name] = counts.get(name, 0) + 1
        chosen.append(score)
        if len(chosen) >= most:
            break
    return chosen
