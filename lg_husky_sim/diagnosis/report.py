# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis as the values of a report: headline, advice, numbers, competing effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lg_husky_sim.diagnosis.before_after.settings import settings as before_after
from lg_husky_sim.diagnosis.result import Diagnosis, Estimate, Finding, Verdict
from lg_husky_sim.diagnosis.wording import (
    LATENESS,
    lateness_words,
    number_words,
    PHASE,
    sized,
    what_to_check,
)
from lg_husky_sim.husky.effects import catalogue, effect_kind, Onset, OnsetKind
from lg_husky_sim.reporting.advice import filled
from lg_husky_sim.reporting.data import (
    Advice,
    ErrorTable,
    Headline,
    Mismatch,
    NOMINAL,
    ParameterRow,
    Provenance,
    RECALIBRATED,
    ReportData,
    Trace,
    View,
    WITH_FINDING,
)
from lg_husky_sim.reporting.sections import Cell, Section, Table, Tone
from lg_husky_sim.reporting.words import (
    capitalised,
    in_a_row,
    number,
    with_interval,
    with_unit,
)

_STREAMS = {'wheels': 'the wheels (`/joint_states`)', 'imu': 'the IMU',
            'pose': 'the pose (`/tf`, odometry)'}
_WHEELS = {'left': 'the left wheels', 'right': 'the right wheels'}
#: Signals of the page by the channels of a diagnosis that are rates of the pose.
_SIGNALS = {'advance': 'forward', 'turn': 'yaw_rate'}


def name_of(effect: str) -> str:
    """Return what reports call an effect."""
    if effect in catalogue():
        return effect_kind(effect).name
    return before_after().names.get(effect, effect.replace('_', ' '))


def effect_words(finding: Finding) -> str:
    """Return effect and side in words, such as ``torque ripple, left side``."""
    name = 'an unknown effect' if finding.effect == 'unknown' else name_of(finding.effect)
    side = {'left': ', left side', 'right': ', right side'}.get(finding.side, '')
    return name + side


def onset_words(onset: Onset | None) -> str:
    """Return when or where an effect acts, in words."""
    if onset is None:
        return 'always'
    if onset.kind is OnsetKind.TIME:
        where = f' of {onset.recording}' if onset.recording else ' of each recording'
        return f'from {onset.value:.1f} s{where}'
    side = 'above' if onset.kind is OnsetKind.PLACE_ABOVE else 'below'
    return f'where x is {side} {number(onset.value)} m'


def label_of(name: str, *, changed: bool = False) -> str:
    """Return what reports call a number; one of the base robot by its meaning."""
    if changed:
        for one in before_after().quantities:
            if one.name == name:
                return one.meaning
    return number_words(name)


def _acts(finding: Finding, changed: bool) -> str:
    return 'in the later recordings' if changed else onset_words(finding.onset)


def size_words(one: Estimate, *, changed: bool = False) -> str:
    """Return a number with its name and interval."""
    if one.name == LATENESS or one.name.removesuffix('_late') in _STREAMS:
        return f'stamps {lateness_words(one)}'
    return (f'{label_of(one.name, changed=changed)} '
            f'{with_interval(one.value, one.low, one.high, one.unit)}')


def headline(diagnosis: Diagnosis, warnings: Sequence[str] = (), *, changed: bool = False
             ) -> Headline:
    """
    Return the answer in thirty seconds.

    Parameters
    ----------
    diagnosis : Diagnosis
        With verdict, confidence and findings.
    warnings : sequence of str
        What speaks against it.
    changed : bool
        Whether the question was what changed between recordings.

    Returns
    -------
    Headline

    """
    found, sure = diagnosis.findings, ('Confidence', f'{100.0 * diagnosis.confidence:.0f} %')
    sentences = tuple(one.statement for one in found)
    match diagnosis.verdict:
        case Verdict.NOTHING_MISSING:
            text = 'No change found' if changed else 'No missing physics found'
            words = ('The model of the earlier recordings explains the later ones.' if changed
                     else 'The recalibrated model explains the recordings.')
            return Headline(text, Tone.GOOD, (sure,), (words,), tuple(warnings))
        case Verdict.UNKNOWN if not diagnosis.fits:
            return Headline(diagnosis.misfit, Tone.BAD, (sure,), sentences, tuple(warnings))
        case Verdict.UNKNOWN:
            parts = ', '.join(dict.fromkeys(one.subsystem for one in found))
            text = 'Something has changed' if changed else 'Something is missing'
            return Headline(f'{text} that is not in the catalogue', Tone.BAD,
                            (('Effect', 'not in the catalogue'),
                             ('Part of the robot', parts or '–'), sure),
                            sentences, tuple(warnings))
        case Verdict.KNOWN:
            several = list(dict.fromkeys(effect_words(one) for one in found))
            what = '; '.join(several)
            noun = 'What changed' if changed else (
                'Missing effect found' if len(several) == 1 else 'Missing effects found')
            facts = tuple(fact for one in found for fact in _facts(
                one, len(found) > 1, changed))
            return Headline(f'{noun}: {what}', Tone.FOUND, (*facts, sure),
                            sentences, tuple(warnings))


def _facts(finding: Finding, several: bool, changed: bool) -> tuple[tuple[str, str], ...]:
    # The phase of a ripple says where on the wheel, not how large.
    sizes = [size_words(one, changed=changed) for one in sized(finding.parameters)
             if not one.name.startswith(PHASE)]
    words = '; '.join(sizes) or '–'
    if several:
        return ((f'Size of {effect_words(finding)}', words),)
    kind = catalogue().get(finding.effect)
    sided = kind is not None and set(kind.sides) & {'left', 'right', 'both'}
    return (('Effect', name_of(finding.effect)),
            ('Side', finding.side if sided and finding.side != 'none' else 'whole robot'),
            # More than two numbers are read better in the sentence than in a small box.
            *((('Size', words),) if len(sizes) <= 2 else ()),
            ('Acts', _acts(finding, changed)))


def advice(diagnosis: Diagnosis, shapes: Mapping[tuple[str, str], str], *,
           changed: bool = False) -> tuple[Advice, ...]:
    """
    Return what to change on the robot and in the simulator.

    Parameters
    ----------
    diagnosis : Diagnosis
        Its findings say what to change.
    shapes : mapping of (str, str) to str
        Variant of form of each effect of the model, by its id and side.
    changed : bool
        Whether the question was what changed between recordings.

    Returns
    -------
    tuple of Advice

    """
    robot: list[str] = []
    simulator: list[str] = []
    instead: list[str] = []
    others = 0
    for finding in diagnosis.findings:
        if finding.effect == 'unknown' and not diagnosis.fits:
            robot.append('Check that the wheels are on the ground, that their rates are in rad/s, '
                         'and that the pose is of this robot. If the model is of another robot, '
                         'give it one of its own: `--robot FILE.yaml`.')
            continue
        if finding.effect == 'unknown':
            robot.append(what_to_check(finding))
            continue
        values: dict[str, float | str] = {one.name: one.value for one in sized(finding.parameters)}
        values |= {'side': finding.side, 'where': 'both sides', 'wheels': 'the wheels'}
        if finding.side in _WHEELS:
            values |= {'where': f'{finding.side} side', 'wheels': _WHEELS[finding.side]}
        values |= _stream_words(finding, shapes.get((finding.effect, finding.side), ''))
        kind = catalogue().get(finding.effect)
        if kind is not None:
            simulator += filled(kind.advice.simulator, values)
            settings = filled(kind.advice.instead, values)
            others += not settings
            instead += settings
        robot += _for_a_change(finding, values) if changed else (
            filled(kind.advice.robot, values) if kind is not None else ())
    for group in diagnosis.indistinguishable:
        tell = '; '.join((*group.sensors, *group.manoeuvres))
        names = ', '.join(map(name_of, group.effects))
        if tell:
            robot.append('Before repairing anything: these recordings do not distinguish '
                         f'{names}. '
                         f'These would: {tell}.')
    if diagnosis.fits or diagnosis.model != diagnosis.plain_model:
        simulator.append(_loading(diagnosis, instead, others))
    parts = (('On the robot', robot), ('In the simulator', simulator))
    return tuple(Advice(where, tuple(lines)) for where, lines in parts if lines)


def _loading(diagnosis: Diagnosis, instead: Sequence[str], others: int) -> str:
    # Parameters of sim_node that do what the model does are no second step, and not all of it.
    load = (f'the {_which(diagnosis)}: `ros2 run lg_husky_sim sim_node --ros-args -p '
            'model:=model.yaml`')
    if not instead:
        return f'Load {load}.'
    lacking = ' The latter lacks what else was found.' * bool(others)
    return (f'Either load {load}. Or load `plain.yaml` and set {" and ".join(instead)} in '
            f'sim_node; not both, or the effect acts twice.{lacking}')


def _for_a_change(finding: Finding, values: Mapping[str, float | str]) -> tuple[str, ...]:
    # Of the catalogue where it fits; a change has numbers of its own names.
    known, kind = before_after().advice, catalogue().get(finding.effect)
    what = finding.statement.partition(':')[0]
    for sentences in (known.get(finding.effect, ()), kind.advice.robot if kind else (),
                      known['default']):
        lines = filled(sentences, {**values, 'change': what[:1].lower() + what[1:]})
        if lines:
            return lines
    return ()


def _which(diagnosis: Diagnosis) -> str:
    # What model.yaml is.
    if diagnosis.model == diagnosis.plain_model:
        return 'recalibrated model'
    if diagnosis.fits and all(f.effect == 'unknown' for f in diagnosis.findings):
        return 'model with the nearest effects of the catalogue'
    return 'model with the finding' if diagnosis.fits else (
        'commercial base, a starting point for a model of this robot')


def _stream_words(finding: Finding, shape: str) -> dict[str, float | str]:
    # Of stamps: whose they are, and how late or early.
    for one in finding.parameters:
        stream = _STREAMS.get(shape if one.name == LATENESS else one.name.removesuffix('_late'))
        if stream:
            how = 'late' if one.value > 0.0 else 'early'
            return {'stream': stream, 'offset': f'{with_unit(abs(one.value), one.unit)} {how}'}
    return {}


def competing(diagnosis: Diagnosis) -> tuple[Section, ...]:
    """Return the effects that were refused, beside the one that was taken."""
    tables, text = [], []
    for finding in diagnosis.findings:
        if not finding.rivals:
            continue
        top = max(finding.held_out_gain, *(one.held_out_gain for one in finding.rivals), 1e-9)
        rows: list[tuple[str | Cell, ...]] = [
            (effect_words(finding), Cell(_nats(finding.held_out_gain),
                                         max(finding.held_out_gain, 0.0) / top, Tone.GOOD))]
        for one in sorted(finding.rivals, key=lambda r: -r.held_out_gain):
            side = one.side if one.side in ('left', 'right') else ''
            rows.append((', '.join(part for part in (name_of(one.effect), side) if part),
                         Cell(_nats(one.held_out_gain), max(one.held_out_gain, 0.0) / top)))
        tables.append(Table(('effect', 'gain [nats]'), tuple(rows)))
        near = max(finding.rivals, key=lambda r: r.held_out_gain)
        share = near.held_out_gain / finding.held_out_gain if finding.held_out_gain > 0.0 else 0.0
        if share > 0.0:
            text.append(f'Runner-up to {effect_words(finding)}: '
                        f'{name_of(near.effect)}, with {100.0 * share:.0f} % of its '
                        'gain.')
    text.append('The gain is the log-likelihood ratio of the model with the effect to the one '
                'without it, everything else refitted (1 nat is a factor of 2.7).')
    return (Section('Competing effects', tuple(text), tables=tuple(tables)),) if tables else ()


def _nats(gain: float) -> str:
    # Hundredths of a nat are nothing.
    return number(round(gain, 2) + 0.0)


def unexplained_sensors(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Return what sensors say of each other that no finding says already."""
    return tuple(text for text in diagnosis.sensors
                 if not any(one.statement.startswith(text) for one in diagnosis.findings))


def unbroken(text: str) -> str:
    """Return a number in words that no line breaks apart."""
    return text.replace(' ', '\N{NO-BREAK SPACE}').replace('-', '\N{NON-BREAKING HYPHEN}')


def found_numbers(diagnosis: Diagnosis, *, changed: bool = False) -> tuple[Section, ...]:
    """Return the numbers of the findings with their intervals and evidence."""
    rows, points = [], []
    for finding in diagnosis.findings:
        if finding.effect == 'unknown' and not diagnosis.fits:
            continue
        rows += [(effect_words(finding), label_of(one.name, changed=changed), number(one.value, 4),
                  f'{number(one.low, 4)} to {number(one.high, 4)}',
                  '' if one.unit == '1' else one.unit) for one in sized(finding.parameters)]
        place = f'Elements of the graph: {", ".join(finding.elements)}. ' if (
            finding.elements) else ''
        known = '' if finding.effect == 'unknown' else f'`{finding.effect}`, '
        points.append(f'{capitalised(effect_words(finding))} ({known}{finding.subsystem}): shows '
                      f'{finding.regime or "everywhere"}; acts {_acts(finding, changed)}. '
                      f'{place}Gain {number(finding.held_out_gain)} nats'
                      f'{"; " + unbroken(finding.chance) if finding.chance else ""}.')
    tables = (Table(('effect', 'parameter', 'estimate', '95 % interval', 'unit'), tuple(rows)),)
    return (Section('The finding in numbers', points=tuple(points),
                    tables=tables if rows else ()),) if points else ()


def report_data(
    diagnosis: Diagnosis, recordings: Sequence[str], traces: Sequence[Trace],
    errors: Sequence[ErrorTable], parameters: Sequence[ParameterRow] = (), *,
    shapes: Mapping[tuple[str, str], str] | None = None, sections: Sequence[Section] = (),
    view: View | None = None, provenance: Provenance | None = None, changed: bool = False,
) -> ReportData:
    """
    Return all of a diagnosis' report.

    Parameters
    ----------
    diagnosis : Diagnosis
        With verdict, findings, notes and what remains.
    recordings : sequence of str
        Their names, for the title.
    traces : sequence of Trace
        Of :func:`~lg_husky_sim.reporting.data.diagnosis_trace`.
    errors : sequence of ErrorTable
        Columns nominal, recalibrated, with finding; held-out ones first.
    parameters : sequence of ParameterRow
        Of the recalibration.
    shapes : mapping of (str, str) to str, optional
        Variant of form of each effect of the model, by its id and side.
    sections : sequence of Section
        Drawings of the graph, efforts and what else there is.
    view : View, optional
        What is shown first; the signal in which the finding helps most if not given.
    provenance : Provenance, optional
        Of what files and versions the report is made.
    changed : bool
        Whether the question was what changed between recordings.

    Returns
    -------
    ReportData

    """
    columns = tuple(name for name in (NOMINAL, RECALIBRATED, WITH_FINDING)
                    if any(name in table.columns for table in errors)
                    or any(name in trace.predicted for trace in traces))
    what = in_a_row(list(dict.fromkeys(effect_words(one) for one in diagnosis.findings)))
    about = {NOMINAL: 'the model as it was given',
             RECALIBRATED: 'its parameters refitted within their tolerances, nothing added',
             WITH_FINDING: f'refitted with {what}'
             if diagnosis.verdict is Verdict.KNOWN else
             'a commercial base: limited commands, wheel-speed loop, tyres that saturate'
             if not diagnosis.fits else
             'refitted with the nearest effects of the catalogue, which do not explain it'}
    remains = diagnosis.remaining if diagnosis.fits else ''
    notes = (*(f'sensors compared with each other: {text}'
               for text in unexplained_sensors(diagnosis)),
             *diagnosis.notes,
             *((f'what remains: {remains}',) if remains else ()))
    warnings = tuple(f'{capitalised(text)}.' for text in diagnosis.warnings)
    return ReportData(
        f'{"What changed in " if changed else "Diagnosis of "}{", ".join(recordings)}',
        headline(diagnosis, warnings, changed=changed), columns,
        tuple((name, about[name]) for name in columns), tuple(traces), tuple(errors),
        advice(diagnosis, shapes or {}, changed=changed), view,
        tuple(Mismatch(m.recording, _SIGNALS.get(m.channel, m.channel), m.start,
                       m.end, m.strength, m.subsystem)
              for m in diagnosis.mismatch),
        tuple(parameters),
        sections=(*found_numbers(diagnosis, changed=changed), *competing(diagnosis), *sections),
        notes=notes,
        files=(('model.yaml', f'is the {_which(diagnosis)}'),
               ('plain.yaml', 'is the model of the earlier recordings' if changed else
                'is the recalibrated model with nothing added'),
               ('diagnosis.json', 'has all numbers')), provenance=provenance or Provenance())
