# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
A recording beside models: the same commands replayed, errors by channel, the paper's figures.

`replay` drives a plant with a segment's commands, `metrics` measures how far it is from what was
recorded, `figures` draws both, `outcome` and `page` make tables, JSON and a page of it.
"""

from lg_husky_sim.comparison.metrics import (
    channel_errors,
    measured_channels,
    pooled,
    SquareSum,
    Tracking,
    tracking,
)
from lg_husky_sim.comparison.replay import initial_state, InitialState, replay

__all__ = [
    'InitialState',
    'SquareSum',
    'Tracking',
    'channel_errors',
    'initial_state',
    'measured_channels',
    'pooled',
    'replay',
    'tracking',
]
