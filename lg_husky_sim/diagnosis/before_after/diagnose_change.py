# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole way from two sets of recordings to what changed between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math

from lg_husky_sim.diagnosis.before_after.comparison import Block, compare
from lg_husky_sim.diagnosis.before_after.conclusion import finding, mismatches, not_told_apart
from lg_husky_sim.diagnosis.before_after.decision import decide, Decision
from lg_husky_sim.diagnosis.before_after.drives import all_drives, Drive
from lg_husky_sim.diagnosis.before_after.fitting import threads
from lg_husky_sim.diagnosis.before_after.prediction import base_of, residual
from lg_husky_sim.diagnosis.before_after.recording_fits import at_the_edge, fit_recordings
from lg_husky_sim.diagnosis.before_after.runnable import carried, fitted, started
from lg_husky_sim.diagnosis.before_after.settings import Settings, settings
from lg_husky_sim.diagnosis.held_out import errors, split
from lg_husky_sim.diagnosis.result import Diagnosis, Verdict
from lg_husky_sim.errors import RecordingError
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.recording import named_apart, Recording, Segment, segments
from lg_husky_sim.signals import FloatArray
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
    decision : Decision
    body, loop : Block or None
        The base fitted to both sets, with the wheels as measured and without.
    segments : tuple of Segment
        Of the later recordings.
    nominal : ModelFile
        The model in doubt.
    """

    diagnosis: Diagnosis
    decision: Decision
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
        If a recording cannot be used.
    """
    return change_case(recordings, baseline, nominal, progress, jobs=jobs).diagnosis


def change_case(recordings: Sequence[Recording], baseline: Sequence[Recording],
                nominal: ModelFile, progress: Progress, *, jobs: int = 1) -> ChangeCase:
    """Do as :func:`diagnose_change`, and return what the answer was made from as well."""
    recordings, baseline = named_apart(recordings, baseline)
    known = settings()
    before, after = _drives(baseline, known), _drives(recordings, known)
    later = frozenset(drive.recording for drive in after)
    body = None
    with threads(jobs) as pool:
        intervals = [float(np.median(np.diff(d.wheels.times))) for d in (*before, *after)
                     if d.wheels.times.size > 1]
        streams = frozenset.intersection(*(frozenset(d.bins) for d in (*before, *after)))
        base = at_the_edge(base_of(known, nominal.parameters, True, max(intervals, default=0.0),
                                   streams), (*before, *after))
        begin = base.start
        if all(_shows_the_body(drive) for drive in (*before, *after)):
            fits = fit_recordings(base, (*before, *after), begin, pool, lambda share: progress(
                'motion of the body', 0.02 + 0.28 * share))
            body, begin = compare(fits, later), fits.common
        loop = compare(fit_recordings(
            replace(base, given=False), (*before, *after), begin, pool,
            lambda share: progress('wheel loop and body', 0.3 + 0.5 * share)), later)
    decision = decide(body, loop, known)
    progress('model', 0.8)
    parts, others = (tuple(s for r in rs for s in segments(r)) for rs in (recordings, baseline))
    return ChangeCase(_diagnosis(decision, body, loop, after, others, parts, nominal, known,
                                 progress, _notes((*baseline, *recordings))),
                      decision, body, loop, parts, nominal)


def _drives(recordings: Sequence[Recording], known: Settings) -> tuple[Drive, ...]:
    found: list[Drive] = []
    for recording in recordings:
        drives = all_drives([recording], known.simulation['step'], known.bins,
                            known.fit['settle'], known.fit['shortest'])
        if not drives:
            raise RecordingError(
                f'recording {recording.name} has no stretch of {known.fit["shortest"]:g} s '
                'without a gap in its streams')
        found.extend(drives)
    return tuple(found)


def _shows_the_body(drive: Drive) -> bool:
    return 'wheels' in drive.bins and len(drive.bins) > 1


def _diagnosis(decision: Decision, body: Block | None, loop: Block, after: Sequence[Drive],
               earlier: Sequence[Segment], later: Sequence[Segment], nominal: ModelFile,
               known: Settings, progress: Progress, notes: Sequence[str]) -> Diagnosis:
    named = decision.named
    found = finding(decision, known, _share(decision, body, loop, after))
    about = 'robot before the change, by lg_husky diagnose'
    steps = int(known.fit['evaluations'])
    names = loop.base.names

    def begun(z: FloatArray) -> ModelFile:
        return started(nominal, dict(zip(names, loop.base.values(z), strict=True)), known)
    old, new = begun(loop.before), begun(loop.after)
    plain = fitted([old], earlier, steps, about)
    progress('model', 0.87)
    train, test = split(later)
    model = half = plain
    if found is not None:
        new = carried(new, old, plain)
        model = fitted([plain, new], later, steps, found.statement)
        progress('model', 0.91)
        half = fitted([plain, new], train, steps, about)
    shown = body if named is not None and named.change.block == 'body' and body else loop
    return Diagnosis(
        Verdict.NOTHING_MISSING if found is None else (
            Verdict.UNKNOWN if decision.unknown else Verdict.KNOWN), decision.confidence,
        () if found is None else (found,), not_told_apart(decision, known),
        mismatches(shown, after, decision, known), (),
        _errors(plain, later), _errors(model, later), _errors(plain, test), _errors(half, test),
        _remaining(decision), model, plain, tuple(notes))


def _errors(model: ModelFile, parts: Sequence[Segment]) -> dict[str, float]:
    return errors(compile_model(model.structure).at(model.parameters), parts)


def _share(decision: Decision, body: Block | None, loop: Block, after: Sequence[Drive]
           ) -> float:
    # Of the sum of squares in which the later drives are off the base before.
    if decision.named is None:
        return math.nan
    block = body if decision.named.change.block == 'body' and body is not None else loop

    def total(z: FloatArray) -> float:
        return sum(float(e @ e) for e in (
            block.noise.white(residual(block.base, drive, z)) for drive in after))
    return float(np.clip(1.0 - total(block.after) / total(block.before), 0.0, 1.0))


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
