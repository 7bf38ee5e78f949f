# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Find the effects that a recalibrated model lacks.

The nominal model is recalibrated first, within the tolerances of its parameters. Then, round by
round: every candidate is screened by its signature; the serious ones are refitted together with
the recalibration; all are compared under one metric, whose correlation is estimated on what the
best of them leaves; the winner is adopted if its gain on held-out blocks is beyond chance and a
material share of what was unexplained.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from lg_husky_sim.diagnosis.candidates import candidates, changed_candidates
from lg_husky_sim.diagnosis.evidence import folds_of
from lg_husky_sim.diagnosis.fits import Fit, fit_structure, recalibrate
from lg_husky_sim.diagnosis.onset_placing import begun_late, refined_onsets
from lg_husky_sim.diagnosis.onsets import change_onsets, Onsets, place_onsets, time_onsets
from lg_husky_sim.diagnosis.revision import reconsidered, without_idle
from lg_husky_sim.diagnosis.rounds import play_round, Round
from lg_husky_sim.diagnosis.workers import HERE, Workers
from lg_husky_sim.husky.effects import Effect, Onset
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations
import numpy as np

#: Most effects that are named.
MOST = 3
#: Part of a change's gain that the same number in all recordings may miss.
ALIKE = 0.25


@dataclass(frozen=True, eq=False)
class Search:
    """
    The whole search.

    Parameters
    ----------
    observations : Observations
    plain : Fit
        Recalibrated, nothing added.
    final : Fit
        With the adopted effects.
    rounds : tuple of Round
    nominal : Parameters
        What every refit started from: centres of the priors, or numbers that are held.
    change : Onset or None
        Where every effect begins, if what changed between recordings was asked for.
    """

    observations: Observations
    plain: Fit
    final: Fit
    rounds: tuple[Round, ...]
    nominal: Parameters
    change: Onset | None = None

    @property
    def sides(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Names of the recordings before and after the change; without one, none and all."""
        names = self.observations.recordings
        border = 0 if self.change is None else names.index(self.change.recording)
        return names[:border], names[border:]


Progress = Callable[[str, float], None]


def _silent(text: str, share: float) -> None:
    del text, share


def search(observations: Observations, structure: Structure, nominal: Parameters,
           progress: Progress = _silent, most: int = MOST, onsets: bool = True,
           change: Onset | None = None, start: Fit | None = None, eager: bool = False,
           workers: Workers = HERE) -> Search:
    """
    Search the catalogue.

    Parameters
    ----------
    observations : Observations
    structure : Structure
        Of the model that is in doubt.
    nominal : Parameters
    progress : callable
        Told what is being done and how far it is.
    most : int
        Most effects to adopt.
    onsets : bool
        Whether an effect may begin late.
    change : Onset, optional
        Where every effect begins; nothing else is tried then.
    start : Fit, optional
        A fit of the structure to some of the data, to begin from.
    eager : bool
        Whether a good description is wanted rather than a name.
    workers : Workers
        What does the independent work.

    Returns
    -------
    Search
    """
    plain = recalibrate(observations, structure, nominal, start)
    base, corrected = plain, 0
    rounds: list[Round] = []
    folds = folds_of(observations)
    masks: tuple[Onsets, ...] = ()
    if change is None and onsets:
        masks = (time_onsets(observations), place_onsets(observations))
    pool = candidates()
    if change is not None:
        pool = (*pool, *changed_candidates(structure, plain.parameters))
    for number in range(most if eager else most + 1):
        if change is not None:
            masks = change_onsets(observations, change, base.structure.onset)
        progress(f'round {number + 1}: signatures and refits', number / (most + 1))
        play = partial(play_round, observations, nominal=nominal, pool=pool, masks=masks,
                       folds=folds, only_late=change is not None, eager=eager, workers=workers)
        one = play(base, number=number - corrected)
        if one.adopted and change is not None and number < most:
            common = as_before(observations, base, one, nominal)
            if common is not None:
                # The robot's number was wrong before, too: nothing has changed in it.
                base, nominal = common
                plain = plain if rounds else base
                corrected += 1
                continue
        if number == most:
            # No more are named: this round only says what would be next.
            one = replace(one, adopted=False)
        rounds.append(one)
        if not one.adopted:
            break
        found = one.rivals[0].fit
        if masks and number == 0:
            found = begun_late(observations, found, nominal, one.metric, change)
            one = replace(one, rivals=(replace(one.rivals[0], fit=found, effect=(
                found.structure.effects[-1]), onset=found.structure.onset), *one.rivals[1:]))
            rounds[-1] = one
        base = with_better_onset(observations, found, nominal, one.metric, change)
        base = without_idle(observations, base, nominal, one.metric, structure)
        kept = set(base.structure.effects)
        rounds = [r for r in rounds if not r.adopted or _same(r, kept)]
        if len(rounds) > 1 and not eager:
            progress(f'round {number + 1}: earlier names again', (number + 0.7) / (most + 1))
            base, rounds = reconsidered(observations, base, rounds, nominal, play)
    return Search(observations, plain, base, tuple(rounds), nominal, change)


def as_before(observations: Observations, base: Fit, one: Round, nominal: Parameters
              ) -> tuple[Fit, Parameters] | None:
    """
    Return the robot with an effect in all recordings, if that is as good as a change.

    The later recordings may go where the earlier ones never were: what shows there only may
    have been so before.

    Parameters
    ----------
    observations : Observations
    base : Fit
        Before the round.
    one : Round
        Whose best candidate is a change: a new effect, or one with other numbers than before.
    nominal : Parameters
        Held numbers.

    Returns
    -------
    Fit
        Without a change.
    Parameters
        The numbers that are held from then on.
    """
    best = one.rivals[0]
    structure, free = base.structure, nominal
    later = {own: best.fit.parameters[name] for own, name in best.effect.renamed.items()}
    if later:
        free = nominal.with_entries(*(
            replace(nominal.entry(name), tolerance=10.0) for name in later))
    else:
        later = {p.name: best.fit.parameters[p.name] for p in best.effect.parameters()}
        structure = structure.with_effect(replace(best.effect, late=False))
    fit = fit_structure(observations, structure, free, one.metric,
                        {**base.solution.values, **later}, {**base.parameters, **later}, 8)
    if fit is None:
        return None
    left = [0.5 * float(np.sum(one.metric.whiten(
        observations, observations.measured - f.solution.predicted) ** 2))
        for f in (fit, best.fit)]
    if left[0] - left[1] > ALIKE * best.gain:
        return None
    held = nominal.with_entries(*(
        replace(fit.parameters.entry(name), tolerance=0.0) for name in later))
    again = fit_structure(observations, structure, held, one.metric,
                          fit.solution.values, {**fit.parameters}, 3)
    return None if again is None else (again, held)


def _same(one: Round, kept: set[Effect]) -> bool:
    # Whether what a round adopted is still in.
    return one.rivals[0].effect in kept


def with_better_onset(observations: Observations, fit: Fit, nominal: Parameters,
                      metric_: Metric, change: Onset | None) -> Fit:
    """
    Return a fit with its onset placed finely, refitted.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    nominal : Parameters
    metric_ : Metric
    change : Onset or None
        The beginning of the later recordings, if a change was asked for: such an onset is given.

    Returns
    -------
    Fit
    """
    if fit.structure.onset is None or fit.structure.onset == change:
        return fit
    sizes = {**fit.parameters, **fit.solution.values}
    tried = [fit_structure(observations, replace(fit.structure, onset=onset), nominal, metric_,
                           fit.solution.values, sizes, 3)
             for onset in refined_onsets(observations, fit, metric_, change)]
    return min((again for again in tried if again is not None),
               key=lambda again: again.solution.cost, default=fit)
