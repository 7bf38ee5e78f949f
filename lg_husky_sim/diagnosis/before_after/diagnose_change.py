# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole way from two sets of recordings to what changed between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.before_after.base import base_of
from lg_husky_sim.diagnosis.before_after.comparison import Block, compare, refitted
from lg_husky_sim.diagnosis.before_after.conclusion import findings, mismatches, not_told_apart
from lg_husky_sim.diagnosis.before_after.decision import Decision
from lg_husky_sim.diagnosis.before_after.drives import all_drives, Drive
from lg_husky_sim.diagnosis.before_after.lags import lags_of
from lg_husky_sim.diagnosis.before_after.recording_fits import (
    at_the_edge,
    fit_recordings,
    RecordingFits,
)
from lg_husky_sim.diagnosis.before_after.runnable import carried, fitted, having, started
from lg_husky_sim.diagnosis.before_after.selection import remembered, select, Selection
from lg_husky_sim.diagnosis.before_after.settings import Change, Settings, settings
from lg_husky_sim.diagnosis.before_after.ticks import at_own_ticks, likelier
from lg_husky_sim.diagnosis.held_out import errors, split
from lg_husky_sim.diagnosis.result import Diagnosis, Verdict
from lg_husky_sim.errors import RecordingError
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.recording import check_driven, named_apart, Recording, Segment, segments
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.threads import threads
import numpy as np

#: Told what is being done and how far it is (0 to 1).
Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class ChangeCase:
    """
    A diagnosis of a change with what it was made from.

    Parameters
    ----------
    diagnosis : Diagnosis
    decisions : tuple of Decision
        One a change, or a single one of none or an unknown one.
    body, loop : Block or None
        The base fitted to both sets, with the wheels as measured and without.
    segments : tuple of Segment
        Of the later recordings.
    nominal : ModelFile
        The model in doubt.

    """

    diagnosis: Diagnosis
    decisions: tuple[Decision, ...]
    body: Block | None
    loop: Block
    segments: tuple[Segment, ...]
    nominal: ModelFile


def diagnose_change(recordings: Sequence[Recording], baseline: Sequence[Recording],
                    nominal: ModelFile, progress: Progress, *, jobs: int = 1) -> Diagnosis:
    """
    Say what changed from the baseline to the other recordings.

    Parameters
    ----------
    recordings, baseline : sequence of Recording
        After and before the change; the robot need not fit the nominal model in either.
    nominal : ModelFile
        The model in doubt: it gives the sizes and masses to begin with.
    progress : callable
        Told what is being done and how far it is (0 to 1).
    jobs : int
        Threads.

    Returns
    -------
    Diagnosis

    Raises
    ------
    RecordingError
        If a recording cannot be used, or the robot is never driven in one of the sets.

    """
    return change_case(recordings, baseline, nominal, progress, jobs=jobs).diagnosis


def change_case(recordings: Sequence[Recording], baseline: Sequence[Recording],
                nominal: ModelFile, progress: Progress, *, jobs: int = 1) -> ChangeCase:
    """Do as :func:`diagnose_change`, and return what the answer was made from as well."""
    recordings, baseline = named_apart(recordings, baseline)
    nominal = nominal.in_proportion()
    known = settings().of(nominal.structure.robot)
    before, after = _drives(baseline, known), _drives(recordings, known)
    check_driven(recordings)
    check_driven(baseline)
    later = frozenset(drive.recording for drive in after)
    moved = None
    with threads(jobs) as pool:
        intervals = [float(np.median(np.diff(d.wheels.times))) for d in (*before, *after)
                     if d.wheels.times.size > 1]
        streams = frozenset.intersection(*(frozenset(d.bins) for d in (*before, *after)))
        base = at_the_edge(base_of(known, nominal.parameters, True, max(intervals, default=0.0),
                                   streams), (*before, *after))
        begin, lags = base.start, lags_of(recordings, baseline, base)
        before, after = (_drives(one, known, lags) for one in (baseline, recordings))
        if all(_shows_the_body(drive) for drive in (*before, *after)):
            moved = fit_recordings(base, (*before, *after), lags, begin, pool, lambda share: (
                progress('motion of the body', 0.02 + 0.28 * share)))
            begin = moved.common
        free = replace(base, given=False)
        looped = fit_recordings(
            free, (*before, *after), lags, begin, pool,
            lambda share: progress('wheel loop and body', 0.3 + 0.25 * share))
        ticking = at_own_ticks(looped, pool)
        if ticking is not None:
            looped = likelier(looped, fit_recordings(
                free, ticking, lags, looped.common, pool,
                lambda share: progress('commands at ticks', 0.55 + 0.2 * share)))

        def block(fits: RecordingFits, adopted: Sequence[Change], fitted: Sequence[Change]
                  ) -> Block:
            return compare(refitted(fits, later, fitted, pool), later, adopted)

        def compared(adopted: Sequence[Change], fitted: Sequence[Change]
                     ) -> tuple[Block | None, Block]:
            return (None if moved is None else block(moved, adopted, fitted),
                    block(looped, adopted, fitted))
        progress('several changes', 0.75)
        found = select(remembered(compared), known)
    progress('model', 0.8)
    parts, others = (tuple(s for r in rs for s in segments(r)) for rs in (recordings, baseline))
    return ChangeCase(_diagnosis(found, after, others, parts, nominal, known, progress,
                                 _notes((*baseline, *recordings))),
                      found.decisions, found.body, found.loop, parts, nominal)


def _drives(recordings: Sequence[Recording], known: Settings,
            lags: Mapping[str, FloatArray] | None = None) -> tuple[Drive, ...]:
    # Without the end of stretches where a stream that is early runs past the simulation.
    found: list[Drive] = []
    for recording in recordings:
        early = 0.0 if lags is None else max(-float(np.min(lags[recording.name])), 0.0)
        drives = all_drives([recording], known.simulation['step'], known.bins,
                            known.fit['settle'], known.fit['shortest'], early)
        if not drives:
            raise RecordingError(
                f'recording {recording.name} has no stretch of {known.fit["shortest"]:g} s '
                'without a gap in its streams')
        found.extend(drives)
    return tuple(found)


def _shows_the_body(drive: Drive) -> bool:
    return 'wheels' in drive.bins and len(drive.bins) > 1


def _diagnosis(selection: Selection, after: Sequence[Drive], earlier: Sequence[Segment],
               later: Sequence[Segment], nominal: ModelFile, known: Settings, progress: Progress,
               notes: Sequence[str]) -> Diagnosis:
    first, loop = selection.decisions[0], selection.loop
    named, found = first.named, findings(selection.decisions, known)
    about = 'robot before the change, by lg_husky diagnose'
    steps = int(known.fit['evaluations'])
    names = loop.base.names

    def begun(z: FloatArray) -> ModelFile:
        return started(nominal, dict(zip(names, loop.base.values(z), strict=True)), known)
    old, new = begun(selection.claimed.before), begun(selection.claimed.after)
    plain = fitted([old], earlier, steps, about)
    progress('model', 0.87)
    train, test = split(later)
    model = half = plain
    if found:
        changed = {one.name: one.value for finding in found for one in finding.parameters}
        new = carried(new, old, plain)
        options = [having(one, changed, known) for one in (plain, new)]
        model = fitted(options, later, steps, ' '.join(one.statement for one in found))
        progress('model', 0.91)
        half = fitted(options, train, steps, about)
    shown = None if named is None or named.change.block == 'loop' else selection.body
    return Diagnosis(
        Verdict.NOTHING_MISSING if not found else (
            Verdict.UNKNOWN if first.unknown else Verdict.KNOWN), first.confidence,
        found, not_told_apart(selection.decisions, known),
        mismatches(shown or loop, after, first, known), (),
        _errors(plain, later), _errors(model, later), _errors(plain, test), _errors(half, test),
        _remaining(first), model, plain, tuple(notes), first.features)


def _errors(model: ModelFile, parts: Sequence[Segment]) -> dict[str, float]:
    return errors(compile_model(model.structure).at(model.parameters), parts)


def _remaining(decision: Decision) -> str:
    if decision.named is None:
        best = decision.rivals[0] if decision.rivals else None
        return 'no change has a gain' if best is None or best.gain <= 0.0 else (
            f'the best change, {best.change.effect}, gains {best.gain:.1f} nats, too little to '
            'adopt it')
    others = [one for one in decision.rivals if one.gain > 0.0]
    return 'no other change has a gain' if not others else (
        f'the runner-up, {others[0].change.effect}, would gain {others[0].gain:.0f} nats instead')


def _notes(recordings: Sequence[Recording]) -> tuple[str, ...]:
    where: dict[str, list[str]] = {}
    for recording in recordings:
        for note in recording.notes:
            where.setdefault(note, []).append(recording.name)
    return tuple(f'{", ".join(names)}: {note}' for note, names in where.items())
