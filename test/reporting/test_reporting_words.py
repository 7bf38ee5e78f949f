# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers as they are written on pages and in terminals."""

from __future__ import annotations

import math

from lg_husky_sim.reporting.advice import filled
from lg_husky_sim.reporting.words import change, in_a_row, plus_minus, with_interval
import pytest


@pytest.mark.parametrize(('estimate', 'text'), [
    ((1.94, 1.83, 2.05, 'm/s²'), '1.94 m/s² (1.83 to 2.05)'),
    ((1.4432, 1.4411, 1.4453, 'm/s²'), '1.443 m/s² (1.441 to 1.445)'),
    ((-0.0155, -0.0157, -0.0153, 'rad/s'), '−0.0155 rad/s (−0.0157 to −0.0153)'),
    ((0.0, 0.0, 0.25, '1'), '0 (0 to 0.25)'),
    ((0.2, math.nan, math.nan, 's'), '0.2 s'),
    ((1.0, 1.0 - 1e-17, 1.0, ''), '1 (1 to 1)')])
def test_an_estimate_differs_from_the_ends_of_its_interval(
        estimate: tuple[float, float, float, str], text: str) -> None:
    assert with_interval(*estimate) == text


@pytest.mark.parametrize(('share', 'text'), [
    (0.0032, '±0.32 %'), (0.14, '±14 %'), (0.996, '±100 %'), (1.37, '±137 %'), (20.0, '±2000 %'),
    (math.inf, '–')])
def test_a_half_width_in_per_cent_has_no_power_of_ten(share: float, text: str) -> None:
    assert plus_minus(share) == text


def test_names_in_a_row_can_be_told_apart() -> None:
    """Names of effects have an `or` and an `and` of their own."""
    assert in_a_row(['slope']) == 'slope'
    assert in_a_row(['slope', 'payload']) == 'slope and payload'
    assert in_a_row(['limit or lag', 'belts', 'payload']) == 'limit or lag, belts, and payload'
    assert in_a_row([]) == ''


def test_a_word_stands_behind_the_unit() -> None:
    assert with_interval(0.24, 0.22, 0.25, 's', 'late') == '0.24 s late (0.22 to 0.25)'


def test_per_cent_stand_apart_from_their_number_in_sentences_too() -> None:
    assert filled(['within {gain:.0%} of 1, {low:.1%}'], {'gain': 0.02, 'low': -0.5}) == (
        'within 2\N{NO-BREAK SPACE}% of 1, −50.0\N{NO-BREAK SPACE}%',)


@pytest.mark.parametrize(('before', 'after', 'text'), [
    (1.0, 0.5, '−50\N{NO-BREAK SPACE}%'), (1.0, 12.0, '×12.0'), (1.0, 999.0, '×999.0'),
    (1e-16, 1.0, 'over ×1000'), (0.0, 1.0, '–'), (1.0, math.inf, '–')])
def test_a_large_change_is_a_factor_and_no_long_number(before: float, after: float, text: str
                                                       ) -> None:
    assert change(before, after) == text
