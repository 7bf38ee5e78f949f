# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole way from recordings to an answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import overload, TYPE_CHECKING

from lg_husky_sim.diagnosis import judge
from lg_husky_sim.diagnosis.confidence import estimates
from lg_husky_sim.diagnosis.doubts import is_guise
from lg_husky_sim.diagnosis.encoders import as_read, is_momentary, read_otherwise
from lg_husky_sim.diagnosis.events import event_words, what_happens
from lg_husky_sim.diagnosis.everyday import everyday_words, more_than_everyday
from lg_husky_sim.diagnosis.evidence import folds_of, held_out_cost
from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.diagnosis.held_out import errors, held_out_errors, plant_of
from lg_husky_sim.diagnosis.misfit import against_before, MORE
from lg_husky_sim.diagnosis.mismatches import mismatches
from lg_husky_sim.diagnosis.nameless import (
    description_words,
    no_ground_reaction,
    rolls_without_moving,
    unnamed_finding,
)
from lg_husky_sim.diagnosis.plausible import check_wheel_rates
from lg_husky_sim.diagnosis.result import Diagnosis, Finding, Verdict
from lg_husky_sim.diagnosis.search import MOST, Progress, Search, search
from lg_husky_sim.diagnosis.unnamed import described, look_for_unnamed, Unnamed
from lg_husky_sim.diagnosis.workers import HERE, Workers
from lg_husky_sim.husky.effects import descriptions
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import named_apart, Recording, Segment, segments
import numpy as np

if TYPE_CHECKING:
    from lg_husky_sim.diagnosis.before_after.diagnose_change import ChangeCase

#: Part of what a smooth effort gains that a guise must add to stay in the model beside it.
MATERIAL = 0.01


@dataclass(frozen=True, eq=False)
class Case:
    """
    A diagnosis with what it was made from, for reports and pictures.

    Parameters
    ----------
    diagnosis : Diagnosis
    search : Search
    segments : tuple of Segment
    nominal : ModelFile
        That was in doubt.
    fit : Fit
        Of the diagnosis' model to all observations.
    """

    diagnosis: Diagnosis
    search: Search
    segments: tuple[Segment, ...]
    nominal: ModelFile
    fit: Fit


def usable_segments(recordings: Sequence[Recording]) -> tuple[Segment, ...]:
    """
    Return the segments of recordings that share no name.

    Raises
    ------
    RecordingError
        If one has no commands.
    """
    for recording in recordings:
        recording.stream('command')
    return tuple(s for r in recordings for s in segments(r))


def model_of(fit: Fit, about: str, intervals: Sequence[Parameter] = ()) -> ModelFile:
    """Return the model file of a fit; ``intervals`` replace their namesakes."""
    return ModelFile(fit.structure, fit.parameters.with_entries(*intervals), about)


def ordered(fit: Fit, names: Sequence[str]) -> Fit:
    """Return a fit whose onset says which of the recordings are earlier than its own."""
    onset = fit.structure.onset
    if onset is None or onset.recording not in names:
        return fit
    earlier = tuple(names[:names.index(onset.recording)])
    return replace(fit, structure=replace(fit.structure, onset=replace(onset, earlier=earlier)))


def with_intervals(case: Search, nominal: Parameters) -> tuple[Parameter, ...]:
    """Return the final fit's parameters with their 95 % intervals."""
    final = case.final
    names = [u.name for u in final.solution.unknowns if not u.extra]
    found = []
    metric = case.rounds[-1].metric
    for number in estimates(case.observations, final, metric, names):
        entry = final.parameters.entry(number.name)
        source = entry.source if number.name not in nominal else (
            f'recalibrated by lg_husky diagnose; nominal {nominal[number.name]:g}')
        found.append(replace(entry, low=number.low, high=number.high, source=source))
    return tuple(found)


@overload
def diagnose(recordings: Sequence[Recording], nominal: ModelFile, progress: Progress) -> Case:
    ...


@overload
def diagnose(recordings: Sequence[Recording], nominal: ModelFile, progress: Progress,
             baseline: Sequence[Recording] = (), workers: Workers = HERE
             ) -> Case | ChangeCase:
    ...


def diagnose(recordings: Sequence[Recording], nominal: ModelFile, progress: Progress,
             baseline: Sequence[Recording] = (), workers: Workers = HERE
             ) -> Case | ChangeCase:
    """
    Locate, name, model and show what a model lacks.

    Parameters
    ----------
    recordings : sequence of Recording
    nominal : ModelFile
        The model in doubt.
    progress : callable
        Told what is being done and how far it is (0 to 1).
    baseline : sequence of Recording
        Recordings of the same robot before a change: the question is then what changed.
    workers : Workers
        What does the independent work.

    Returns
    -------
    Case or ChangeCase
        The latter where a baseline is given.

    Raises
    ------
    RecordingError
        If any recording cannot be used, or one is given twice.
    DiagnosisError
        If wheels turn faster than any do.
    """
    recordings, baseline = named_apart(recordings, baseline)
    if baseline:
        from lg_husky_sim.diagnosis.before_after.diagnose_change import change_case
        return change_case(recordings, baseline, nominal, progress, jobs=workers.jobs)
    parts = usable_segments(recordings)
    whole = observations(parts)
    for recording in recordings:
        if recording.name not in whole.recordings:
            observations(segments(recording))  # says what it lacks
    check_wheel_rates(whole, nominal)
    names = [r.name for r in recordings]
    progress('recalibration', 0.0)
    whole, begin = as_read(whole, nominal.structure, nominal.parameters)
    found = search(whole, nominal.structure, nominal.parameters, progress, start=begin,
                   workers=workers)
    other = read_otherwise(found)
    if other is not None:
        whole = other
        found = search(whole, nominal.structure, nominal.parameters, progress, workers=workers)
    found = replace(found, final=ordered(found.final, whole.recordings))
    progress('numbers', 0.9)
    own = tuple(s for s in parts if s.recording in names)
    said, fit = _diagnosis(found, own, nominal, whole)
    said = replace(said, notes=(*said.notes, *_mended(recordings)))
    return Case(said, found, own, nominal, fit)


def _diagnosis(found: Search, own: tuple[Segment, ...], nominal: ModelFile,
               whole: Observations) -> tuple[Diagnosis, Fit]:
    names = judge.findings(found)
    verdict = Verdict.KNOWN if names else Verdict.NOTHING_MISSING
    unnamed, fit = None, None
    if found.change is None or not names:
        unnamed = look_for_unnamed(whole, found.final, found.change)
    if rolls_without_moving(whole):
        verdict, names = Verdict.UNKNOWN, (no_ground_reaction(found),)
    elif unnamed is not None and (
            is_guise(found, unnamed) if names else judge.is_unnamed(
                found, more_than_everyday(unnamed))):
        verdict = Verdict.UNKNOWN
        finding, fit = _without_name(found, whole, unnamed)
        names = (finding,)
    final = found.final if fit is None else fit
    model = model_of(final, '; '.join(f.statement for f in names) or 'recalibrated, nothing named',
                     with_intervals(found, nominal.parameters) if fit is None else ())
    residual = whole.measured - found.plain.solution.predicted
    best = found.rounds[-1].base if not found.rounds[-1].adopted else found.final
    culprit = names[0].subsystem if names else None
    listed = mismatches(whole, residual, whole.measured - best.solution.predicted, culprit)
    plain_out, augmented_out = held_out_errors(
        found.plain, final, found.nominal, own, found.rounds[-1].metric,
        is_momentary(whole))
    return Diagnosis(
        verdict, judge.confidence(found, verdict, unnamed), names,
        judge.indistinguishable(found), listed,
        judge.recalibration(found, final, nominal.parameters),
        errors(plant_of(found.plain), own), errors(plant_of(final), own),
        plain_out, augmented_out, _remaining(found, final, unnamed), model,
        model_of(found.plain, 'recalibrated, nothing added'), _notes(found, verdict)), final


def _without_name(found: Search, whole: Observations, unnamed: Unnamed
                  ) -> tuple[Finding, Fit | None]:
    # A guise stays in the model only where the smooth effort needs it.
    options = [(found.final, unnamed)]
    if found.final is not found.plain:
        options.append((found.plain, look_for_unnamed(whole, found.plain, found.change)))
    folds, made = folds_of(whole), []

    def cost(fit: Fit) -> float:
        return float(np.sum(held_out_cost(whole, fit, unnamed.metric, folds)))
    for base, looked in options:
        finding, description = unnamed_finding(found, looked)
        fit = None if description is None else described(
            whole, base, found.nominal, looked, description)
        if fit is not None and description is not None:
            fit = ordered(fit, whole.recordings)
            finding, _ = unnamed_finding(found, looked.refitted(fit, description))
        made.append((cost(found.final if fit is None else fit), finding, fit))
    material = max(judge.NEAR_NATS, MATERIAL * (
        cost(found.plain) - min(one[0] for one in made)))
    _, finding, fit = min(made, key=lambda one: one[0] + material * len((
        found.final if one[2] is None else one[2]).structure.effects))
    return finding, fit


def _remaining(found: Search, final: Fit, unnamed: Unnamed | None) -> str:
    last = found.rounds[-1]
    residual = found.observations.measured - final.solution.predicted
    words = []
    for name in found.observations.channels:
        mask = found.observations.channel_mask(name)
        words.append(f'{name.replace("_", " ")} {np.sqrt(np.mean(residual[mask] ** 2)):.3g}')
    best = last.rivals[0] if last.rivals and not last.adopted else None
    text = 'root mean square residual: ' + ', '.join(words)
    if best is not None:
        full = sum(one.adopted for one in found.rounds) >= MOST
        text += (f'; the best further effect would be {best.effect.id} with a held-out gain of '
                 f'{best.held_out:.0f} nats, ' + (
                     f'and {MOST} effects are as many as one diagnosis adopts' if full else
                     'which is not enough to adopt it'))
    if unnamed is not None and unnamed.held_out > 0.0 and final is found.final:
        first = unnamed.descriptions[0]
        text += (f'; the best smooth description of the rest is {description_words(first)}'
                 f' with a held-out gain of {first.held_out:.0f} nats')
    return text


def _notes(found: Search, verdict: Verdict) -> tuple[str, ...]:
    bound = found.final.solution.at_bound
    notes = []
    if any(effect.id in descriptions() for effect in found.plain.structure.effects):
        notes.append('the model has a smooth effort of an earlier diagnosis: no other one was '
                     'looked for beside it')
    if everyday_words(found) and verdict is not Verdict.UNKNOWN:
        notes.append('in the model, and too little to be called missing from it: '
                     + everyday_words(found))
    if is_momentary(found.observations):
        notes.append('the wheel rates are read as those of the moment: this is nearer to the '
                     'data than means over the time in which an encoder counts')
    if bound:
        notes.append('at the edge of what a recalibration may use up: ' + ', '.join(bound))
    if verdict is Verdict.KNOWN:
        seen = what_happens(found)
        if seen:
            notes.append(f'what was named is not the whole of it: {event_words(seen)}')
        more = against_before(found, found.final, False)
        if more > MORE:
            notes.append(f'the later recordings are still {more:.1f} times as far from the model '
                         'as the earlier ones (mean square of the worst channel): what was named '
                         'comes near, but is not the whole of it')
    return tuple(notes)


def _mended(recordings: Sequence[Recording]) -> tuple[str, ...]:
    # What reading had to repair or to go without, once for all recordings of which it is true.
    where: dict[str, list[str]] = {}
    for recording in recordings:
        for note in recording.notes:
            where.setdefault(note, []).append(recording.name)
    return tuple(f'{", ".join(names)}: {note}' for note, names in where.items())
