# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Candidates as they were refitted in a round: which is best, and whether it is adopted."""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.husky.effects import Effect, Onset

#: Least held-out gain of an adopted effect, always there or late [nats].
LEAST_GAIN = (50.0, 60.0)
#: Least share of the unexplained energy that the first effect must explain, always there or
#: late: where the rest is near the sensors' noise, and where much remains unexplained.
LEAST_SHARE = (0.003, 0.02)
LARGE_SHARE = (0.015, 0.06)
#: Energy per value of the rest from which much remains unexplained.
MUCH = 7.0
#: The same for a further effect: share, or smaller ones with a large gain.
FURTHER_SHARE = 0.2
FURTHER_GAIN = ((100.0, 0.06), (1000.0, 0.03))
#: Largest ratio of losses to gains over held-out blocks; of a change between recordings, where
#: what the model gets wrong in both adds to the losses.
UNSTABLE = (0.35, 0.45)
#: The same of effects whose state nobody sees: where in its play an idling gear lies when a
#: crossing begins differs from stretch to stretch.
UNSEEN = {'gear_backlash': 0.6}
#: A further effect with at least such a gain [nats] and share of the unexplained energy may lose
#: more over held-out blocks: up to the third number.
FURTHER_UNSTABLE = ((0.0, 0.5, 0.5), (1000.0, 0.15, 0.45))
#: Least share of the unexplained energy that a change between recordings must explain: with a
#: gain above the first and the second number of nats that follow.
CHANGE_SHARE = (0.035, 0.025)
CHANGE_GAIN = (80.0, 250.0)
#: Gain, share and largest instability of a further change. What the first one only approximates
#: helps in some stretches and harms in others; a small second effect must help wherever it acts.
FURTHER_CHANGE = ((80.0, 0.5, 0.45), (400.0, 0.2, 0.4), (180.0, 0.08, 0.1), (500.0, 0.03, 0.05))
#: Share by which an effect that scales all that the ground does must be better than others.
SWEEPING = 0.15
#: What an effect must relieve the recalibration of, and gain on held-out blocks with that, to be
#: adopted however small its gain: numbers that all had to leave their tolerance a little without
#: it hide it well [nats].
RELIEF, RELIEVED = 4.0, 18.0
#: Most that held-out blocks may gain, as a multiple of what all data do, and beyond it [nats].
CREDIBLE = (2.0, 20.0)
#: Part of the gain that must be left beside jitter of the commands.
KEPT = 0.5
#: What a late effect must gain more than the same one without an onset: nats and share.
LATER = (12.0, 0.15)


@dataclass(frozen=True, eq=False)
class Rival:
    """
    A candidate as it was refitted in one round.

    Parameters
    ----------
    effect : Effect
    onset : Onset or None
    fit : Fit
    gain : float
        Drop of the half sum of squares against the round's base, all data [nats].
    held_out : float
        The same on blocks that were not fitted [nats].
    relief : float
        By how much the recalibration leaves its tolerances less than without the effect [nats].
    beside_jitter : float
        The gain where every step of the command may come a little later by itself [nats].
    """

    effect: Effect
    onset: Onset | None
    fit: Fit
    gain: float
    held_out: float
    relief: float = 0.0
    beside_jitter: float = math.inf

    @property
    def evidence(self) -> float:
        """Held-out gain, if jitter of the commands does not explain most of it; else 0 [nats]."""
        return self.held_out if self.beside_jitter > KEPT * self.gain else 0.0


def most_credible(gain: float) -> float:
    """
    Return the largest held-out gain that is one.

    Where a number of the base shows in few blocks, leaving these out costs the base much, and
    whatever shares that burden seems to gain what it does not explain.

    Parameters
    ----------
    gain : float
        Of the same effect on all data, relief of the recalibration included [nats].

    Returns
    -------
    float
    """
    return CREDIBLE[0] * max(gain, 0.0) + CREDIBLE[1]


def rank(rival: Rival) -> float:
    """
    Return held-out gain less what an onset, or what scales the whole ground, must bring.

    Added is what the recalibration need not move: a wheel that reads 4 % too little is as good as
    the other one that reads 4 % too much with all wheels 4 % larger, which they are not.
    """
    effect = rival.effect
    much = SWEEPING * abs(rival.held_out) if (
        effect.id == 'terrain_change' and effect.shape == 'damping') else 0.0
    if rival.onset is None:
        return rival.held_out + rival.relief - much
    return rival.held_out + rival.relief - much - LATER[0] - LATER[1] * abs(rival.held_out)


def adopts(best: Rival, share: float, unstable: float, rest: float, number: int,
           change: bool) -> bool:
    """
    Return whether the best rival of a round is adopted.

    Parameters
    ----------
    best : Rival
    share : float
        Of the base's unexplained energy that it explains.
    unstable : float
        Losses over gains of its held-out blocks.
    rest : float
        Energy per value that it leaves, in units of the sensors' noise.
    number : int
        Effects that were adopted before.
    change : bool
        Whether changes between recordings are asked for.

    Returns
    -------
    bool
    """
    late = int(best.onset is not None and not change)
    found = best.fit.parameters
    if all(found[p.name] == found.entry(p.name).lower == 0.0
           for p in best.effect.parameters() if not p.fixed):
        return False
    if not change and number == 0 and unstable < UNSTABLE[0] and (
            best.relief > RELIEF and best.held_out + best.relief > RELIEVED):
        return True
    unsteady = max([UNSTABLE[change], *(
        most for gain, least, most in FURTHER_UNSTABLE
        if number > 0 and best.held_out > gain and share > least)])
    if min(best.held_out, best.beside_jitter) < LEAST_GAIN[late] or (
            unstable > UNSEEN.get(best.effect.id, unsteady)):
        return False
    if change and number > 0:
        return any(best.held_out > gain and share > least and unstable < most
                   for gain, least, most in FURTHER_CHANGE)
    if change:
        return best.held_out > CHANGE_GAIN[0] and share > CHANGE_SHARE[
            best.held_out > CHANGE_GAIN[1]]
    if number > 0:
        return share > FURTHER_SHARE or (rest < MUCH and any(
            best.held_out > gain and share > least for gain, least in FURTHER_GAIN))
    return share > (LARGE_SHARE if rest > MUCH else LEAST_SHARE)[late]
