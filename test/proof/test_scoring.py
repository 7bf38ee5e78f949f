# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Judging a diagnosis against its answer, and the figures of many judgements."""

from __future__ import annotations

import math
from typing import Any

from lg_husky_sim.proof import measures, summary
from lg_husky_sim.proof.page import page_of, text_of
from lg_husky_sim.proof.scoring import judge
import numpy as np
import pytest


def answer(*effects: str, kind: str = 'single', onset: dict[str, Any] | None = None,
           severity: str = 'medium', side: str = 'none') -> dict[str, Any]:
    return {'case': 'case_0001', 'spec': {'kind': kind, 'world': 'g1', 'drive': 'paper'},
            'effects': [{'effect': name, 'severity': severity, 'side': side}
                        for name in effects],
            'onset': onset or {'kind': 'none'}}


def finding(effect: str, subsystem: str, **more: Any) -> dict[str, Any]:
    return {'effect': effect, 'subsystem': subsystem, 'side': 'none',
            'onset': {'kind': 'none'}, 'rivals': [], **more}


def outcome(verdict: str, *findings: dict[str, Any], confidence: float = 0.99,
            inseparable: list[str] | None = None) -> dict[str, Any]:
    return {'seconds': 4.0, 'error': '', 'held_out': [], 'diagnosis': {
        'verdict': verdict, 'confidence': confidence, 'findings': list(findings),
        'indistinguishable': [{'effects': inseparable}] if inseparable else []}}


def test_the_right_name_scores_in_every_way() -> None:
    one = judge(answer('slope'), outcome('known', finding('slope', 'translation')))
    assert (one.top1, one.top2, one.subsystem, one.found, one.extra) == (True, True, True, 1, 0)
    assert one.first == 'slope'


def test_a_wrong_name_scores_its_subsystem_only() -> None:
    one = judge(answer('slope'), outcome('known', finding('payload', 'translation')))
    assert (one.top1, one.top2, one.subsystem, one.found, one.extra) == (False, False, True, 0, 1)


def test_the_best_rival_counts_as_second() -> None:
    rivals = [{'effect': 'gyro_bias', 'held_out_gain_nats': 3.0},
              {'effect': 'slope', 'held_out_gain_nats': 90.0}]
    wrong = finding('quadratic_drag', 'translation', rivals=rivals)
    assert judge(answer('slope'), outcome('known', wrong)).top2
    assert not judge(answer('gyro_bias'), outcome('known', wrong)).top2


def test_of_names_only_two_count_and_of_an_unknown_none() -> None:
    rivals = [{'effect': 'slope', 'held_out_gain_nats': 90.0}]
    wrong = finding('quadratic_drag', 'translation', rivals=rivals)
    assert not judge(answer('slope'), outcome('known', wrong, finding(
        'payload', 'translation'))).top2
    assert judge(answer('slope'), outcome('known', wrong, finding('slope', 'translation'))).top2
    nameless = judge(answer('slope'), outcome('unknown', finding(
        'unknown', 'translation', rivals=rivals)))
    assert (nameless.top1, nameless.top2, nameless.nearest) == (False, False, True)


def test_a_declared_inseparable_pair_counts_as_second() -> None:
    said = finding('encoder_scale', 'sensor')
    truth = answer('wheel_radius_mismatch')
    assert not judge(truth, outcome('known', said)).top2
    assert judge(truth, outcome('known', said, inseparable=[
        'encoder_scale', 'wheel_radius_mismatch'])).top2
    assert not judge(truth, outcome('known', said, inseparable=[
        'slope', 'wheel_radius_mismatch'])).top2


def test_nothing_is_right_on_clean_and_only_there() -> None:
    clean = judge(answer(kind='clean'), outcome('nothing_missing'))
    assert (clean.first, clean.verdict) == ('nothing', 'nothing_missing')
    assert not judge(answer('slope'), outcome('nothing_missing')).top2


@pytest.mark.parametrize(('said', 'acceptable'), [
    (outcome('unknown', finding('unknown', 'drivetrain')), True),
    (outcome('known', finding('payload', 'translation'), confidence=0.6), True),
    (outcome('known', finding('payload', 'translation'), confidence=0.95), False),
    (outcome('known', finding('gyro_bias', 'sensor'), confidence=0.6), False),
    (outcome('nothing_missing'), False),
    ({'diagnosis': None, 'error': 'crashed', 'held_out': []}, False)])
def test_an_effect_outside_the_catalogue_wants_humility(said: dict[str, Any],
                                                        acceptable: bool) -> None:
    assert judge(answer('wind_gusts', kind='outside'), said).acceptable is acceptable


def test_a_crash_is_a_failure_and_never_right() -> None:
    one = judge(answer('slope'), {'diagnosis': None, 'error': 'error: no wheels', 'held_out': []})
    assert (one.first, one.failed, one.top2) == ('failed', 'error: no wheels', False)
    assert math.isnan(one.seconds)
    assert one.shares == {'all': 0.0, 'position_m': 0.0}


def test_a_model_that_cannot_be_driven_is_a_failure_too() -> None:
    said = {**outcome('known', finding('slope', 'translation')), 'held_out_error': 'simulate: no'}
    one = judge(answer('slope'), said)
    assert (one.failed, one.top1, one.shares['all']) == ('simulate: no', True, 0.0)
    (rate,) = [r for r in summary.rates([one]) if r.name.startswith('no diagnosis')]
    assert (rate.hits, rate.reached) == (1, False)


def test_a_crash_on_a_clean_robot_is_a_false_alarm() -> None:
    crashed = judge(answer(kind='clean'), {'diagnosis': None, 'error': 'crashed', 'held_out': []})
    fine = judge(answer(kind='clean'), outcome('nothing_missing'))
    (rate,) = [r for r in summary.rates([crashed, fine]) if 'false alarm' in r.name]
    assert (rate.hits, rate.count) == (1, 2)


@pytest.mark.parametrize(('said', 'error'), [
    ({'kind': 'time', 'recording': 'rec2', 'time_s': 12.7}, 0.7),
    ({'kind': 'time', 'recording': 'folder/rec2', 'time_s': 12.7}, 0.7),
    ({'kind': 'time', 'recording': 'rec1', 'time_s': 12.0}, math.inf),
    ({'kind': 'place', 'x_m': 12.0}, math.inf), ({'kind': 'none'}, math.inf)])
def test_an_onset_needs_its_recording(said: dict[str, Any], error: float) -> None:
    truth = answer('slope', onset={'kind': 'time', 'recording': 'rec2', 'time_s': 12.0})
    one = judge(truth, outcome('known', finding('slope', 'translation', onset=said)))
    assert one.onset_error == pytest.approx(error)
    assert not one.onset_invented


def test_an_onset_where_there_is_none_is_noted() -> None:
    said = {'kind': 'place', 'x_m': 1.0}
    one = judge(answer('slope'), outcome('known', finding('slope', 'translation', onset=said)))
    assert one.onset_invented
    assert one.onset_error is None
    start = {'kind': 'time', 'recording': 'rec1', 'time_s': 0.04}
    one = judge(answer('slope'), outcome('known', finding('slope', 'translation', onset=start)))
    assert not one.onset_invented


def test_sides_count_where_one_side_is_hit() -> None:
    truth = answer('torque_ripple', side='left')
    right = finding('torque_ripple', 'drivetrain', side='left')
    assert judge(truth, outcome('known', right)).side is True
    assert judge(truth, outcome('known', {**right, 'side': 'both'})).side is False
    assert judge(truth, outcome('known', finding('slope', 'translation'))).side is None


def test_pairs_count_both() -> None:
    truth = answer('slope', 'gyro_bias', kind='pair')
    both = [finding('gyro_bias', 'sensor'), finding('slope', 'translation')]
    assert judge(truth, outcome('known', *both)).found == 2
    assert judge(truth, outcome('known', both[0])).found == 1


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


def judgements() -> list[Any]:
    held = {who: {'all': value, 'position_m': 3.0 * value}
            for who, value in (('plain', 2.0), ('augmented', 0.8), ('truth', 0.5))}
    right = {**outcome('known', finding('slope', 'translation')), 'held_out': [held]}
    wrong = outcome('known', finding('payload', 'translation'))
    return [judge(answer('slope'), right), judge(answer('slope'), right),
            judge(answer('slope'), wrong), judge(answer(kind='clean'), wrong),
            judge(answer(kind='clean'), outcome('nothing_missing')),
            judge(answer('slope', 'gyro_bias', kind='pair'), right)]


def test_the_summary_counts() -> None:
    result = summary.summarise(judgements())
    rates = {rate['name']: rate for rate in result['rates']}
    assert rates['medium and strong: named right']['value'] == pytest.approx(2.0 / 3.0)
    assert rates['medium and strong: named right']['reached'] is False
    assert rates['clean: named, called unknown or failed (false alarm)']['value'] == 0.5
    assert rates['clean: named, called unknown or failed (false alarm)']['reached'] is False
    assert rates['pairs: at least one right']['reached'] is True
    assert rates['pairs: both right']['reached'] is False
    assert result['shares']['known effects, all'] == {
        'count': 3, 'median': pytest.approx(0.8), 'lower_quartile': pytest.approx(0.8),
        'upper_quartile': pytest.approx(0.8)}
    table = result['confusion']
    row = table['counts'][table['hidden'].index('slope')]
    assert row[table['named'].index('slope')] == 2
    assert row[table['named'].index('payload')] == 1
    assert sum(map(sum, table['counts'])) == 5
    assert result['by_effect']['slope']['named'] == {'slope': 2, 'payload': 1}


def test_a_wrong_name_beside_a_weak_effect_s_right_one_is_a_wrong_name() -> None:
    weak = answer('slope', severity='weak')
    right, two = (outcome('known', *found) for found in (
        (finding('slope', 'translation'),),
        (finding('slope', 'translation'), finding('gyro_bias', 'sensor'))))
    rates = {rate.name: rate for rate in summary.rates([judge(weak, right), judge(weak, two)])}
    assert rates['weak: named right'].value == 1.0
    assert rates['weak: named right, nothing or unknown, and no wrong name'].value == 0.5


def test_shares_against_a_baseline_stand_apart() -> None:
    """They count what is known of the base, too: a clean robot has a share there."""
    held = {who: {'all': value, 'position_m': value}
            for who, value in (('plain', 2.0), ('augmented', 0.8), ('truth', 0.5))}
    cases = []
    for kind, effects in (('clean', ()), ('single', ('slope',))):
        given = answer(*effects, kind=kind)
        given['spec']['world'] = 'g3'
        cases.append(judge(given, {**outcome('nothing_missing'), 'held_out': [held]}))
    result = summary.summarise(cases)
    assert result['shares']['known effects, all']['count'] == 0
    assert result['shares']['against a baseline, all']['count'] == 1
    assert result['shares']['against a baseline, clean, all']['median'] == pytest.approx(0.8)
    assert result['by_effect']['slope']['median_share'] is None


def test_text_and_page_say_the_figures() -> None:
    result = {**summary.summarise(judgements()), 'command': 'lg_husky prove', 'planned': 6,
              'seal': 'ab' * 32, 'first_seed': 10_000, 'last_seed': 10_005}
    assert '6 cases: 3 single effects, 1 pairs, 2 clean, 0 outside' in text_of(result)
    assert 'medium and strong: named right' in text_of(result)
    page = page_of(result)
    assert '| medium and strong: named right | 2 of 3 | 67 % (21 % to 94 %) | ≥ 80 % | missed |' \
        in page
    assert '| slope | 3 | 2 | 3 | 0.80 | payload 1 |' in page
    assert 'cases to finish' not in page
    assert 'The first 6 of 9 cases to finish' in page_of({**result, 'planned': 9})
    one = {'command': 'lg_husky prove --seed 10000', 'planned': 4, 'cases': 4, 'seal': 'ab' * 32,
           'first_seed': 10_000, 'last_seed': 10_003}
    page = page_of({**result, 'trials': [one, {
        **one, 'command': 'lg_husky prove --seed 11000', 'planned': 9, 'cases': 2,
        'seal': 'cd' * 32, 'first_seed': 11_000, 'last_seed': 11_008}]})
    assert '    lg_husky prove --seed 10000\n    lg_husky prove --seed 11000\n' in page
    assert f'`{"ab" * 8}` and `{"cd" * 8}`' in page
    assert 'reported here have 10000 to 10003 and 11000 to 11008.' in page
    assert 'The first 4 of 4 and the first 2 of 9 cases to finish' in page


def test_pictures_are_drawn(tmp_path: Any) -> None:
    pytest.importorskip('matplotlib')
    from lg_husky_sim.proof.pictures import draw
    paths = draw(summary.summarise(judgements()), tmp_path / 'pictures')
    assert [path.name for path in paths] == [
        'proof_confusion.png', 'proof_rates.png', 'proof_shares.png']
    assert all(path.stat().st_size > 5000 for path in paths)
