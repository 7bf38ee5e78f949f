# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The numbers of an estimation: ``config/identification.yaml``, with unit, meaning and source."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from lg_husky_sim.settings import numbers

#: What the smallest noise of a channel is called where it has not the channel's own name.
_NOISE = {'wheel_left': 'wheels', 'wheel_right': 'wheels', 'wheel_speed': 'wheels',
          'forward': 'advance'}


@cache
def settings() -> Mapping[str, float]:
    """Return the numbers of ``config/identification.yaml`` by name."""
    return numbers('identification.yaml', 'lg_husky_sim/identification/1')


def setting(name: str) -> float:
    """Return one number of ``config/identification.yaml`` [its unit there]."""
    return settings()[name]


def least_noise(channel: str) -> float:
    """Return the smallest noise of a channel that is believed [the channel's unit]."""
    return setting(f'least_noise_{_NOISE.get(channel, channel)}')
