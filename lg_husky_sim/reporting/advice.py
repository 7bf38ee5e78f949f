# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Sentences of advice with the numbers that were found."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import math
import string

from lg_husky_sim.reporting.words import digits_apart, number


class _Number(float):
    # A number that is written with a few digits where its format says nothing.
    digits = 3

    def __format__(self, spec: str) -> str:
        return float.__format__(self, spec).replace('-', '−').replace(
            '%', '\N{NO-BREAK SPACE}%') if spec else number(self, self.digits)


def _exact(value: float, low: float, high: float) -> dict[str, _Number]:
    # A value with the ends of its interval, in digits that tell the three apart.
    found = {'value': _Number(value), 'low': _Number(low), 'high': _Number(high)}
    if math.isfinite(low) and math.isfinite(high):
        for one in found.values():
            one.digits = digits_apart(value, low, high)
    return found


def filled(sentences: Iterable[str], values: Mapping[str, float | str]) -> tuple[str, ...]:
    """
    Return sentences with what was found in place of the names in braces.

    Parameters
    ----------
    sentences : iterable of str
        Such as ``Set `max_yaw: {limit_yaw}` in sim_node``.
    values : mapping of str to float or str
        Numbers and words by name; ``value``, ``low`` and ``high`` are an estimate with its
        interval.

    Returns
    -------
    tuple of str
        Without the sentences that name something that was not found.

    """
    known = {name: _Number(value) if isinstance(value, float) else value
             for name, value in values.items()}
    estimate = [known.get(name) for name in ('value', 'low', 'high')]
    if all(isinstance(one, float) for one in estimate):
        known |= _exact(*estimate)  # type: ignore[arg-type]
    return tuple(sentence.format_map(known) for sentence in sentences
                 if names_in(sentence) <= set(known))


def names_in(sentence: str) -> set[str]:
    """Return the names in braces of a sentence."""
    return {name for _, name, _, _ in string.Formatter().parse(sentence) if name}
