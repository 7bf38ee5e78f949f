# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Marking what was said against what is true, and the figures of many marks."""

from __future__ import annotations

import math
from typing import Any

from lg_husky_sim.proof import catalogue, measures, summary
from lg_husky_sim.proof.outcomes import line_of
from lg_husky_sim.proof.page import page_of, text_of
from lg_husky_sim.proof.scoring import judge, Judgement
from lg_husky_sim.proof.settings import settings
import numpy as np
import pytest


def answer(*effects: str, kind: str = 'single', onset: dict[str, Any] | None = None,
           level: str = 'clear', side: str = 'both', severity: str = 'medium') -> dict[str, Any]:
    part = {**catalogue.SUBSYSTEM, **catalogue.OUTSIDE}
    return {
        'kind': kind if effects or kind == 'before_after' else 'none',
        'level': level if effects else 'clean', 'world': 'open loop, fine steps',
        'regime': {'floor': 'smooth'}, 'unseen': [],
        'answers': [{
            'effect': name, 'in_list': name in catalogue.SUBSYSTEM, 'severity': severity,
            'side': side, 'onset': onset, 'location': {'subsystem': part[name]},
            'related_answers': settings()['effects'][name]['related']} for name in effects]}


def finding(effect: str, subsystem: str = '', gain: float = 50.0, **more: Any) -> dict[str, Any]:
    part = subsystem or catalogue.SUBSYSTEM.get(effect, '')
    return {'effect': effect, 'subsystem': part, 'side': 'both', 'onset': {'kind': 'none'},
            'rivals': [], 'evidence': {'held_out_gain_nats': gain}, **more}


def outcome(*findings: dict[str, Any], confidence: float = 0.99, verdict: str = '',
            inseparable: list[str] | None = None) -> dict[str, Any]:
    verdict = verdict or ('known' if findings else 'nothing_missing')
    return {'case': 'case_0001', 'seconds': 4.0, 'error': '', 'held_out': [], 'diagnosis': {
        'verdict': verdict, 'confidence': confidence, 'findings': list(findings),
        'indistinguishable': [{'effects': inseparable}] if inseparable else []}}


CRASH: dict[str, Any] = {'case': 'a', 'diagnosis': None, 'error': 'error: no wheels',
                         'held_out': []}


def marked(truth: dict[str, Any], said: dict[str, Any]) -> Judgement:
    return judge(line_of(truth, said))


def test_the_right_name_is_right_in_every_way() -> None:
    one = marked(answer('slope'), outcome(finding('slope')))
    (mark,) = one.marks
    assert (mark.named, mark.outright, mark.considered, mark.part) == (1.0, True, True, True)
    assert (one.right, one.extra, one.first) == (1.0, 0, 'slope')


def test_a_related_name_is_worth_half_and_a_declared_tie_makes_it_whole() -> None:
    truth, said = answer('slope'), finding('rolling_resistance')
    assert marked(truth, outcome(said)).marks[0].named == 0.5
    tied = marked(truth, outcome(said, inseparable=['slope', 'rolling_resistance']))
    assert tied.marks[0].named == 1.0
    assert not tied.marks[0].outright
    far = outcome(finding('gyro_bias'), inseparable=['slope', 'gyro_bias'])
    assert marked(truth, far).marks[0].named == 0.5
    crowd = outcome(finding('gyro_bias'), inseparable=['slope', 'gyro_bias', 'payload',
                                                       'yaw_pull', 'battery_sag'])
    assert marked(truth, crowd).marks[0].named == 0.0, 'a group of five says nothing'


def test_only_the_best_rival_counts_as_second() -> None:
    rivals = [{'effect': 'gyro_bias', 'held_out_gain_nats': 3.0},
              {'effect': 'slope', 'held_out_gain_nats': 90.0}]
    wrong = finding('payload', rivals=rivals)
    assert marked(answer('slope'), outcome(wrong)).marks[0].considered
    assert not marked(answer('gyro_bias'), outcome(wrong)).marks[0].considered


def test_nothing_is_right_on_clean_robots_and_only_there() -> None:
    assert marked(answer(), outcome()).right == 1.0
    assert marked(answer(), outcome(finding('slope'))).right == 0.0
    assert marked(answer('slope'), outcome()).right == 0.0


@pytest.mark.parametrize('level', ['weak', 'undetectable'])
def test_caution_where_hardly_anything_shows_does_not_count_against(level: str) -> None:
    truth = answer('slope', level=level)
    assert marked(truth, outcome()).right is None
    assert marked(truth, outcome(finding('payload'), confidence=0.5)).right is None
    assert marked(truth, outcome(finding('payload'), confidence=0.9)).right == 0.0
    assert marked(truth, outcome(finding('slope'), confidence=0.9)).right == 1.0


@pytest.mark.parametrize(('said', 'acceptable'), [
    (outcome(finding('unknown', 'drivetrain'), verdict='unknown'), True),
    (outcome(finding('payload')), True), (outcome(finding('gyro_bias')), False),
    (outcome(), False),
    ({'case': 'a', 'diagnosis': None, 'error': 'crashed', 'held_out': []}, False)])
def test_an_effect_outside_the_catalogue_wants_humility(said: dict[str, Any],
                                                        acceptable: bool) -> None:
    one = marked(answer('wind_gusts', kind='outside'), said)
    assert one.acceptable is acceptable
    assert one.right == float(acceptable)


def test_unknown_is_no_name_for_a_known_effect() -> None:
    one = marked(answer('slope'), outcome(finding('unknown', 'translation'), verdict='unknown'))
    assert (one.marks[0].named, one.right, one.first) == (0.0, 0.0, 'unknown')


def test_a_crash_is_a_failure_and_never_right() -> None:
    one = marked(answer('slope'), CRASH)
    assert (one.first, one.failed, one.right) == ('failed', 'error: no wheels', 0.0)
    assert one.shares == {'all': 0.0, 'position_m': 0.0}
    clean = marked(answer(), CRASH)
    rates = {rate.name: rate for rate in summary.rates([clean])}
    assert rates['clean robots: named, called unknown or failed (false alarm)'].hits == 1
    assert rates['no diagnosis (error)'].as_json()['reached'] is False


def test_a_crash_is_not_caution_either() -> None:
    assert marked(answer('slope', level='weak'), CRASH).right == 0.0


@pytest.mark.parametrize(('said', 'error'), [
    ({'kind': 'time', 'recording': 'rec2', 'time_s': 12.4}, 0.4),
    ({'kind': 'time', 'recording': 'some/where/rec2', 'time_s': 11.0}, 1.0),
    ({'kind': 'time', 'recording': 'rec1', 'time_s': 12.0}, math.inf),
    ({'kind': 'place', 'x_m': 12.0}, math.inf), ({'kind': 'none'}, math.inf)])
def test_an_onset_needs_its_recording(said: dict[str, Any], error: float) -> None:
    truth = answer('slope', onset={'type': 'time', 'recording': 'rec2',
                                   'seconds_after_epoch': 12.0})
    one = marked(truth, outcome(finding('slope', onset=said)))
    assert one.marks[0].onset == pytest.approx(error)
    assert not one.onset_invented


def test_an_onset_where_there_is_none_is_noted() -> None:
    one = marked(answer('slope'), outcome(finding('slope', onset={'kind': 'place', 'x_m': 1.0})))
    assert one.onset_invented
    assert one.marks[0].onset is None
    start = {'kind': 'time', 'recording': 'rec1', 'time_s': 0.04}
    assert not marked(answer('slope'), outcome(finding('slope', onset=start))).onset_invented


def test_sides_count_where_one_side_is_hit_and_its_effect_named() -> None:
    truth = answer('torque_ripple', side='left')
    right = finding('torque_ripple', side='left')
    assert marked(truth, outcome(right)).marks[0].side is True
    assert marked(truth, outcome({**right, 'side': 'both'})).marks[0].side is False
    assert marked(truth, outcome(finding('slope'))).marks[0].side is None


def test_of_a_pair_the_strongest_two_findings_count_in_any_order() -> None:
    truth = answer('slope', 'gyro_bias', kind='pair')
    both = [finding('gyro_bias', gain=9.0), finding('slope', gain=90.0)]
    assert marked(truth, outcome(*both)).right == 1.0
    assert marked(truth, outcome(both[0])).right == 0.0
    third = finding('payload', gain=20.0)
    one = marked(truth, outcome(*both, third))
    assert (one.right, one.extra) == (0.0, 1)


def test_share_of_the_achievable() -> None:
    assert measures.share(2.0, 0.5, 0.5) == 1.0
    assert measures.share(2.0, 2.0, 0.5) == 0.0
    assert measures.share(2.0, 3.5, 0.5) == -1.0
    assert measures.share(1.0, 0.9, 0.95) is None
    assert measures.share(1.0, 0.9, math.nan) is None
    assert measures.share(1.0, math.nan, 0.1) == measures.share(1.0, math.inf, 0.1) == -1.0


def test_wilson_s_interval_has_its_published_values() -> None:
    # Newcombe, Statistics in Medicine 17 (1998), table I, method 3.
    assert measures.wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert measures.wilson(15, 148) == pytest.approx((0.0624, 0.1605), abs=1e-4)
    assert measures.wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert measures.wilson(0, 0) == (0.0, 1.0)


def bag(rate: float, speed: float, shift: float = 0.0) -> dict[str, Any]:
    times = np.arange(0.0, 10.0, 1.0 / rate) + 1000.0 + shift
    zeros, ones = np.zeros(times.size), np.ones(times.size)
    return {'joints': np.column_stack([times, speed * ones, speed * ones]),
            'imu': np.column_stack([times, zeros, zeros, zeros]),
            'poses': np.column_stack([times, speed * (times - times[0]), zeros, zeros])}


def test_errors_are_zero_for_the_same_motion_at_other_rates_and_epochs() -> None:
    same = measures.errors(bag(200.0, 0.5), bag(50.0, 0.5))
    assert max(same.values()) < 1e-9
    assert max(measures.errors(bag(200.0, 0.5, shift=5e5), bag(50.0, 0.5)).values()) < 1e-9


def test_errors_have_the_size_of_the_difference() -> None:
    found = measures.errors(bag(50.0, 0.6), bag(50.0, 0.5))
    assert found['wheel_rad_s'] == pytest.approx(0.1)
    assert found['step_m'] == pytest.approx(0.1 / math.sqrt(2.0))
    assert found['yaw_rate_rad_s'] == 0.0
    assert found['position_m'] == pytest.approx(0.1 * 10.0 / math.sqrt(3.0), rel=0.01)


def test_calibration_is_counted_by_hand() -> None:
    """Nine of ten at 0.95 right and one of two at 0.55: (10·0.05 + 2·0.05) / 12."""
    said = [marked(answer('slope'), outcome(finding('slope'), confidence=0.95))] * 9
    said += [marked(answer('slope'), outcome(finding('gyro_bias'), confidence=0.95))]
    said += [marked(answer('slope'), outcome(finding(name), confidence=0.55))
             for name in ('slope', 'gyro_bias')]
    found = summary.reliability(said)
    assert found['error'] == pytest.approx((10 * 0.05 + 2 * 0.05) / 12)
    assert [row['count'] for row in found['bins']] == [2, 10]
    assert found['bins'][1]['right'] == pytest.approx(0.9)
    assert found['mean_when_wrong'] == pytest.approx(0.75)
    sure = marked(answer('slope'), outcome(finding('slope'), confidence=1.0))
    assert summary.reliability([sure])['bins'][0]['from'] == pytest.approx(0.9)
    assert summary.reliability([])['error'] is None


def judgements() -> list[Judgement]:
    held = {who: {'all': value, 'position_m': 3.0 * value}
            for who, value in (('plain', 2.0), ('augmented', 0.8), ('truth', 0.5))}
    right = {**outcome(finding('slope')), 'held_out': [held]}
    wrong = outcome(finding('payload'))
    rough = {**answer('slope'), 'regime': {'floor': 'rough'}, 'unseen': ['wheels: lowpass'],
             'world': 'Bullet'}
    return [marked(answer('slope'), right), marked(answer('slope'), right),
            marked(rough, wrong), marked(answer(), wrong), marked(answer(), outcome()),
            marked(answer('slope', 'gyro_bias', kind='pair'), right)]


def test_the_summary_counts() -> None:
    result = summary.summarise(judgements())
    rates = {rate['name']: rate for rate in result['rates']}
    assert rates['single effects: named right']['value'] == pytest.approx(2.0 / 3.0)
    assert rates['single effects: named right']['reached'] is False
    alarms = rates['clean robots: named, called unknown or failed (false alarm)']
    assert (alarms['value'], alarms['reached']) == (0.5, False)
    assert rates['pairs: at least one right']['reached'] is True
    assert rates['pairs: both right']['reached'] is False
    assert result['shares']['known effects, all']['median'] == pytest.approx(0.8)
    table = result['confusion']
    row = table['counts'][table['hidden'].index('slope')]
    assert row[table['named'].index('slope')] == 2
    assert row[table['named'].index('payload')] == 1
    assert sum(map(sum, table['counts'])) == 5
    assert result['by_effect']['slope']['named'] == {'slope': 2, 'payload': 1}
    families = {(row['axis'], row['family']): row for row in result['by_regime']}
    assert families['floor', 'rough']['named']['hits'] == 0
    assert families['floor', 'smooth']['named']['hits'] == 2
    assert families['world', 'Bullet']['named']['count'] == 1
    assert families['left out of tuning', 'wheels: lowpass']['named']['count'] == 1


def test_text_and_page_say_the_figures_of_each_set_apart() -> None:
    result = summary.summarise(judgements())
    assert '6 cases: 3 single effects, 1 pairs, 2 clean, 0 outside' in text_of(result)
    facts = {'command': 'lg_husky prove --report', 'commit': 'c0ffee', 'cases': 6, 'planned': 6,
             'seal': 'ab' * 32, 'seeds': '10000 to 10005', 'set': 'report',
             'note': 'Stopped early.'}
    page = page_of({'report': (result, [facts]), 'tuning': (result, [facts])},
                   ['docs/some.jsonl'])
    assert page.count('| single effects: named right | 2 of 3 | 67 % (21 % to 94 %) '
                      '| ≥ 80 % | missed |') >= 2
    assert 'lg_husky prove --from docs/some.jsonl --page docs/proof.md' in page
    assert 'Single effects that are too weak to show are not counted' in page
    assert '| `lg_husky prove --report` | `c0ffee` | 10000 to 10005 | 6 of 6 |' in page
    assert page.index('## Reported trial') < page.index('## Tuning trial')
    assert '| slope | 3 | 2 | 3 | payload 1 |' in page
    assert 'Expected calibration error' in page
    assert 'No set is reported' not in page
    assert '\nStopped early.\n' in page
    assert 'No set is reported' in page_of({'tuning': (result, [facts])}, ['a'])


def test_the_page_lists_trials_of_all_states_with_their_sum() -> None:
    result, both = summary.summarise(judgements()), summary.summarise(judgements() * 2)
    facts = {'command': 'lg_husky prove', 'commit': 'c0ffee', 'cases': 6, 'planned': 6,
             'seal': 'ab' * 32, 'seeds': '10000 to 10005', 'set': 'report'}
    page = page_of({'report': (result, [facts])}, ['a'], history=[
        (facts, result), ({**facts, 'set': 'exam', 'seeds': '-', 'commit': 'deadbeef'}, result)],
        whole=both)
    assert '| report | 10000 to 10005 | `c0ffee` | 6 | 2 of 3 |' in page
    assert '| exam | - | `deadbeef` | 6 | 2 of 3 |' in page
    assert '| sum |  |  | 12 | 4 of 6 |' in page


def test_pictures_are_drawn(tmp_path: Any) -> None:
    pytest.importorskip('matplotlib')
    from lg_husky_sim.proof.pictures import draw
    paths = draw(summary.summarise(judgements()), tmp_path / 'pictures')
    assert [path.name for path in paths] == [
        'proof_confusion.png', 'proof_rates.png', 'proof_reliability.png']
    assert all(path.stat().st_size > 5000 for path in paths)
