# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What else was tried."""

from __future__ import annotations

from lg_husky_sim.diagnosis.result import Rivalry
from lg_husky_sim.diagnosis.selection.rounds import Round


def rivals_of(one: Round) -> tuple[Rivalry, ...]:
    """Return what else was tried in a round, each effect once, best first."""
    best: dict[str, Rivalry] = {}
    named = one.tried[0].hypothesis.effect.id if one.adopted else ''
    for tried in one.tried:
        effect = tried.hypothesis.effect
        if effect.id != named and (effect.id not in best
                                   or tried.gain > best[effect.id].held_out_gain):
            best[effect.id] = Rivalry(effect.id, effect.side, max(tried.gain, 0.0))
    return tuple(sorted(best.values(), key=lambda r: -r.held_out_gain))
