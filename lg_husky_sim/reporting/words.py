# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""One name, one unit and one sign for each quantity, on all pages and in all tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
import sys

#: What every error is. X is ahead and Y to the left of the robot as it stood at the start.
SIGN = 'measured − predicted'
#: Shown where a number is not known.
UNKNOWN = '–'
#: Largest factor of a change that is written out.
MOST_FACTOR = 1000.0

QUANTITIES: Mapping[str, tuple[str, str]] = {
    'wheel_left': ('left wheel rate', 'rad/s'),
    'wheel_right': ('right wheel rate', 'rad/s'),
    'wheel_speed': ('wheel rate', 'rad/s'),
    'forward': ('forward speed', 'm/s'),
    'advance': ('forward speed (pose)', 'm/s'),
    'yaw_rate': ('yaw rate', 'rad/s'),
    'turn': ('yaw rate (pose)', 'rad/s'),
    'accel_x': ('forward acceleration', 'm/s²'),
    'heading': ('heading', 'rad'),
    'position': ('position', 'm'),
    'x': ('x', 'm'),
    'y': ('y', 'm'),
    'position_rmse_m': ('position', 'm'),
    'heading_rmse': ('heading', 'rad'),
    'wheel_speed_rmse': ('wheel rate', 'rad/s'),
    'yaw_rate_rmse': ('yaw rate', 'rad/s'),
    'forward_rmse': ('forward speed', 'm/s'),
    'max_abs_x_m': ('largest |X| error', 'm'),
    'max_abs_y_m': ('largest |Y| error', 'm'),
}
"""Name and unit of each quantity, by the key that it has in JSON and in the code."""


def quantity(key: str) -> str:
    """Return the name of a quantity; that of an unknown key is the key in words."""
    return QUANTITIES[key][0] if key in QUANTITIES else key.replace('_', ' ')


def quantity_with_unit(key: str) -> str:
    """Return the name of a quantity with its unit in brackets."""
    name, unit = quantity(key), QUANTITIES.get(key, ('', ''))[1]
    return f'{name} [{unit}]' if unit else name


def capitalised(text: str) -> str:
    """Return a text whose first letter is large, the others as they are."""
    return text[:1].upper() + text[1:]


def plural(count: int, noun: str) -> str:
    """Return a count with its noun, as in ``1 recording`` and ``2 recordings``."""
    return f'{count} {noun}{"" if count == 1 else "s"}'


def in_a_row(names: Sequence[str]) -> str:
    """Return names with commas and a word before the last: ``a and b``, ``a, b, and c``."""
    if len(names) < 3:
        return ' and '.join(names)
    return f'{", ".join(names[:-1])}, and {names[-1]}'


def number(value: float, digits: int = 3) -> str:
    """
    Return a number in a few significant digits.

    Parameters
    ----------
    value : float
        Without its unit.
    digits : int
        Significant digits.

    Returns
    -------
    str
        With powers of ten for very large and very small numbers; a dash for one that is not
        finite.

    """
    if not math.isfinite(value):
        return UNKNOWN
    text = f'{value:.{digits}g}'
    if 'e' in text and 1e-4 <= abs(value) < 1e7:
        return f'{value:.0f}'
    return text.replace('-', '−')


def padded(value: float, digits: int = 3) -> str:
    """Return a number in so many significant digits, zeros at its end among them."""
    text = number(value, digits)
    if text == UNKNOWN or 'e' in text or abs(value) >= 10 ** digits:
        return text
    return f'{value:#.{digits}g}'.rstrip('.').replace('-', '−')


def with_unit(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with its unit; the unit 1 is not written."""
    return f'{number(value, digits)} {unit}' if unit not in ('', '1') else number(value, digits)


def with_interval(value: float, low: float, high: float, unit: str = '', word: str = '') -> str:
    """
    Return an estimate with its interval, such as ``1.443 m/s (1.441 to 1.445)``.

    Parameters
    ----------
    value, low, high : float
        An interval that is not finite is left out.
    unit : str
        The unit 1 is not written.
    word : str
        Behind the unit, such as ``late``.

    Returns
    -------
    str
        In three significant digits, or so many that the estimate differs from both ends.

    """
    if not (math.isfinite(low) and math.isfinite(high)):
        return ' '.join(filter(None, (with_unit(value, unit), word)))
    digits = digits_apart(value, low, high)
    said = ' '.join(filter(None, (with_unit(value, unit, digits), word)))
    return f'{said} ({number(low, digits)} to {number(high, digits)})'


def digits_apart(value: float, low: float, high: float) -> int:
    """Return three significant digits, or so many that a value differs from its bounds."""
    return next((digits for digits in range(3, sys.float_info.dig) if all(
        end == value or number(end, digits) != number(value, digits) for end in (low, high))),
        sys.float_info.dig)


def plus_minus(share: float) -> str:
    """Return half a width, a share of a value, in per cent; a dash for one without end."""
    return f'±{number(100.0 * share, 2)} %' if math.isfinite(share) else UNKNOWN


def change(before: float, after: float, decimals: int = 0) -> str:
    """Return a change in per cent with its sign; a dash where there is none."""
    if not (math.isfinite(before) and math.isfinite(after)) or before <= 0.0:
        return UNKNOWN
    share = round(100.0 * (after / before - 1.0), decimals) + 0.0  # no minus zero
    if after > MOST_FACTOR * before:
        return f'over ×{MOST_FACTOR:.0f}'
    if share > 999:
        return f'×{after / before:.1f}'
    return f'{share:+.{decimals}f}\u00a0%'.replace('-', '−')
