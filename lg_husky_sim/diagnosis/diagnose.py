# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole way from recordings to an answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

from lg_husky_sim.comparison.scatter import scatter_notes
from lg_husky_sim.diagnosis.conclusion import (
    answer,
    estimates,
    findings,
    indistinguishable,
    undetermined,
    without_undetermined,
)
from lg_husky_sim.diagnosis.decision.confidence import Features
from lg_husky_sim.diagnosis.decision.strain import strained
from lg_husky_sim.diagnosis.error_tables import with_nominal
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.held_out import errors, held_out_errors
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import Effort
from lg_husky_sim.diagnosis.localisation import mismatches, Missing, missing_efforts
from lg_husky_sim.diagnosis.log_notes import log_notes, reading_notes
from lg_husky_sim.diagnosis.model_mismatch import model_mismatch, ModelMismatch, unsearched
from lg_husky_sim.diagnosis.nameless import described, left_over, remaining, unknown_finding
from lg_husky_sim.diagnosis.result import Diagnosis, grown, Rivalry, Verdict
from lg_husky_sim.diagnosis.selection.rotors import rotor_notes
from lg_husky_sim.diagnosis.selection.rounds import Round
from lg_husky_sim.diagnosis.selection.search import Progress, Search, search
from lg_husky_sim.diagnosis.selection.supply import likeliest_supply
from lg_husky_sim.diagnosis.sensors.faults import Fault, faults
from lg_husky_sim.diagnosis.sensors.relations import relations
from lg_husky_sim.diagnosis.sensors.repair import (
    begun_with,
    certain,
    fault_findings,
    UNMODELLED,
)
from lg_husky_sim.diagnosis.sensors.robot import differences, impossible, misread
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Subsystem
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.recording import check_driven, named_apart, Recording, Segment, segments
from lg_husky_sim.threads import threads


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
    left : Search
        The same under the noise that is fair to what it leaves.
    rest : tuple of Effort
        Smooth efforts in that.
    free : tuple of Missing
        Efforts over time in that.
    features : Features
        That made the confidence.

    """

    diagnosis: Diagnosis
    search: Search
    segments: tuple[Segment, ...]
    nominal: ModelFile
    left: Search
    rest: tuple[Effort, ...]
    free: tuple[Missing, ...]
    features: Features


def diagnose(recordings: Sequence[Recording], nominal: ModelFile, progress: Progress, *,
             jobs: int = 1) -> Case:
    """
    Locate, name, model and show what a model lacks.

    Parameters
    ----------
    recordings : sequence of Recording
        In the order of time.
    nominal : ModelFile
        The model in doubt.
    progress : callable
        Told what is being done and how far it is (0 to 1).
    jobs : int
        Threads for independent simulations; the answer does not depend on it.

    Returns
    -------
    Case

    Raises
    ------
    RecordingError
        If any recording cannot be used, one is given twice, or the robot is never driven.

    """
    nominal = nominal.in_proportion()
    recordings, _ = named_apart(recordings, ())
    drives = drives_of(recordings)
    check_driven(recordings)
    names = [r.name for r in recordings]
    parts = tuple(s for r in recordings for s in segments(r))
    progress('comparing the sensors', 0.01)
    related = relations(parts)
    seen = faults(related, parts)
    different = misread(seen) or differences(related, nominal.parameters)
    numbers = nominal.parameters.replacing({k: v for d in different for k, v in d.numbers.items()})
    with threads(jobs) as pool:
        start = beginning(nominal.structure, base_unknowns(numbers, drives), numbers, Reading())
        numbers = likeliest_supply(drives, names, start, pool)
        start = beginning(nominal.structure, base_unknowns(numbers, drives), numbers, Reading())
        start, there = begun_with(start, certain(seen))
        progress('noise', 0.02)
        evidence = evidence_of(drives, names, start,
                               first_guess(drives, start.structure.robot), pool)
        if different:
            progress('recalibration', 0.05)
        found = unsearched(evidence, start) if different else search(evidence, start, progress)
        different = different or impossible(found.final, nominal.parameters)
        progress('smooth efforts', 0.85)
        left = remaining(found)
        # What a model of another robot leaves of this one needs no words.
        rest = () if different else left_over(left.evidence, left.final)
        free = missing_efforts(left.evidence, left.final)
        progress('intervals', 0.9)
        said, features = _diagnosis(found, left, rest, free, parts, nominal, there)
        if different:
            progress('another robot: what differs', 0.92)
            sized = ModelFile(start.structure, start.numbers)
            said = _of_other_robot(said, model_mismatch(
                different, said.held_out_plain, recordings, parts, sized, there, pool))
    sensors = tuple(f.statement for f in seen)
    notes = (*said.notes, *_supplied(nominal, numbers), *_mended(recordings))
    said = with_nominal(replace(said, notes=notes, sensors=sensors), nominal, parts, names)
    known = [one['forward_rmse'] for one in (said.nominal, said.plain, said.augmented)
             if 'forward_rmse' in one]
    if known:
        said = replace(said, notes=(*said.notes, *scatter_notes(parts, min(known))))
    return Case(said, found, parts, nominal, left, rest, free, features)


def _supplied(nominal: ModelFile, numbers: Parameters) -> tuple[str, ...]:
    most, known = numbers['supply_voltage'], nominal.parameters['supply_voltage']
    return () if most == known else (
        f'the motors seem to get up to {most:.3g} V, where the model has a supply of {known:g} V: '
        'supply_voltage is that, and command_gain less by as much',)


def _of_other_robot(said: Diagnosis, other: ModelMismatch) -> Diagnosis:
    # The names of a search that ended on another robot are rivals, and no answer.
    sensors = tuple(f for f in said.findings if f.subsystem == Subsystem.SENSOR.value
                    and f.statement.endswith(UNMODELLED))
    rivals = tuple(Rivalry(f.effect, f.side, f.held_out_gain) for f in said.findings
                   if f not in sensors and f.effect != 'unknown')
    return replace(
        said, verdict=Verdict.UNKNOWN, findings=(replace(other.finding, rivals=rivals), *sensors),
        indistinguishable=(), model=other.model or said.plain_model,
        augmented=other.everywhere or said.plain,
        held_out_augmented=other.held_out or said.held_out_plain, fits=False)


def _diagnosis(found: Search, left: Search, rest: Sequence[Effort], free: Sequence[Missing],
               parts: Sequence[Segment], nominal: ModelFile, there: Sequence[Fault]
               ) -> tuple[Diagnosis, Features]:
    said = answer(left, rest, free)
    sensors = fault_findings(there, found.final)
    if sensors and said.verdict is Verdict.NOTHING_MISSING:
        said = replace(said, verdict=Verdict.KNOWN)
    match said.verdict:
        case Verdict.KNOWN:
            names = (*sensors, *(findings(found) if found.found else ()))
        case Verdict.UNKNOWN:
            names = (unknown_finding(found, rest, free), *sensors)
        case Verdict.NOTHING_MISSING:
            names = ()
    culprit = names[0].subsystem if names else None
    plain_out, augmented_out = held_out_errors(found, parts)
    about = ' '.join(f.statement for f in names) or 'recalibrated, nothing named'
    nearest = _nearest(found) if said.verdict is Verdict.UNKNOWN else ''
    groups = indistinguishable(found) if said.verdict is Verdict.KNOWN else ()
    diagnosis = Diagnosis(
        said.verdict, said.sure, names, groups,
        mismatches(found.evidence, found.plain, culprit),
        estimates(found.final, list(nominal.parameters), nominal.parameters),
        errors(found.plain.point.plant, parts),
        errors(found.final.point.plant, parts, found.evidence.names),
        plain_out, augmented_out, _remaining(found, rest),
        model_of(found.final, found.evidence, nominal, f'{about} {nearest}'.rstrip()),
        model_of(found.plain, found.evidence, nominal, 'recalibrated, nothing added'),
        (*((nearest,) if nearest else ()), *_notes(found, plain_out, augmented_out)),
        {**asdict(said.features), 'readings': float(found.evidence.count)},
        strained_plain=strained(found.plain), strained=strained(found.final))
    return diagnosis, said.features


def model_of(fit: Fit, evidence: Evidence, nominal: ModelFile, about: str) -> ModelFile:
    """Return a fit as a model that can be written: numbers with intervals and sources."""
    numbers = without_undetermined(evidence, fit).numbers
    entries: list[Parameter] = [
        replace(numbers.entry(name), source='not determined by these recordings')
        for name in undetermined(fit, list(numbers))]
    for one in estimates(fit, list(numbers), fit.point.numbers):
        entry = numbers.entry(one.name)
        source = entry.source if one.name not in nominal.parameters else (
            'recalibrated by lg_husky diagnose; nominal '
            f'{nominal.parameters[one.name]:g}')
        entries.append(replace(entry, low=one.low, high=one.high, source=source))
    structure = fit.point.structure
    onset = structure.onset
    if onset is not None and onset.recording in evidence.names:
        earlier = tuple(evidence.names[:evidence.names.index(onset.recording)])
        structure = replace(structure, onset=replace(onset, earlier=earlier))
    return ModelFile(structure, numbers.with_entries(*entries), about)


def _remaining(found: Search, rest: Sequence[Effort]) -> str:
    text = []
    if rest and rest[0].evidence > 0.0:
        first = rest[0]
        text.append(f'the best description of the remaining residual is {described(first)}, with '
                    f'a log evidence of {first.evidence:.1f} nats')
    last = found.rounds[-1]
    if last.tried and not (found.found and last is found.rounds[len(found.found) - 1]):
        text.append(_refused(last, found.found))
    return '; '.join(text) or 'nothing beyond noise'


def _refused(last: Round, found: Sequence[Hypothesis]) -> str:
    # Why the best effect that was looked at last is no finding.
    best = last.tried[0]
    name = best.hypothesis.effect.id
    again = 'one more ' if name in {one.effect.id for one in found} else ''
    gain = f'the best further effect, {again}{name}, gains {best.gain:.1f} nats, '
    if last.small:
        told = 200.0 * best.gain / best.count
        return gain + (f'and explains {told:.2g} % of the variance of the innovations: beyond '
                       'chance, but so little is left by models that are not exact more often '
                       'than by an effect')
    if last.chance > setting('false_alarm_rate'):
        beside = ', or what was found may be off by' if found else ''
        return gain + ('as chance alone gives it' if last.chance > 0.5 else
                       f'which chance gives with a probability of {last.chance:.2g}') + beside
    return gain + 'more than chance gives, but nothing as the log is read in the end'


def _nearest(found: Search) -> str:
    # What model.yaml has beside an unknown.
    names = [hypothesis.effect.id for hypothesis in found.found]
    return (f'model.yaml has the nearest effects of the catalogue, {", ".join(names)}, which do '
            'not explain it' if names else '')


def _notes(found: Search, plain: dict[str, float], augmented: dict[str, float]
           ) -> tuple[str, ...]:
    notes = []
    made = reading_notes(found.evidence.drives, found.final.point.log)
    worse = grown(plain, augmented) if found.found else []
    if any(name in worse and any(note.startswith(rates) for note in made) for name, rates in (
            ('wheel_speed_rmse', 'wheel rates'), ('yaw_rate_rmse', 'yaw rates'))):
        notes.append('held-out errors of rates that grow are those of the rates themselves, not '
                     'of what this log makes of them (below), which numbers of the '
                     'recalibrated model may stand for')
    notes += log_notes(found.evidence.drives)
    notes += [*made, *rotor_notes(found.final.point)]
    values = found.evidence.noise.values
    notes.append(f'estimated disturbances (standard deviation): force {values["force"]:.2g} '
                 f'N, yaw moment {values["moment"]:.2g} N·m, torque on the wheels of each side '
                 f'{values["drive"]:.2g} N·m')
    return tuple(notes)


def _mended(recordings: Sequence[Recording]) -> tuple[str, ...]:
    # What reading had to repair or to go without, once for all recordings of which it is true.
    where: dict[str, list[str]] = {}
    for recording in recordings:
        for note in recording.notes:
            where.setdefault(note, []).append(recording.name)
    return tuple(f'{", ".join(names)}: {note}' for note, names in where.items())
