# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Drives with commands at the ticks of their base, if it has any.

Commands that seem to be missed or late are not repaired here, as in the search for one set: what a
limit of the current does to a few hard starts would pass for them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.fitting import fit_set, Prior
from lg_husky_sim.diagnosis.before_after.prediction import residual, residuals
from lg_husky_sim.diagnosis.before_after.recording_fits import by_recording, RecordingFits
from lg_husky_sim.diagnosis.before_after.whitening import noise_of, surprise
from lg_husky_sim.diagnosis.evidence.clock_search import (
    at_ticks,
    ClockSearch,
    gain_by_chance,
    Ticker,
)
from lg_husky_sim.diagnosis.evidence.command_steps import Rates, steps_of
from lg_husky_sim.diagnosis.evidence.drives import Clock
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np


def at_own_ticks(fits: RecordingFits, pool: Threads) -> tuple[Drive, ...] | None:
    """
    Return the drives with commands at the likeliest ticks of their base.

    Ticks are accepted where they are likelier than none, by more than chance, as the fits are and
    with the robots fitted anew. The likelihood is that of residuals whose
    noise is estimated: with s standard deviations of the n residuals of a channel, ticks gain
    ``n log(s without / s with)``, summed over channels.

    Parameters
    ----------
    fits : RecordingFits
        With commands that are applied as they come, and the wheels not as measured.
    pool : Threads
        Threads for the search and the fits.

    Returns
    -------
    tuple of Drive or None
        None where none are likelier than commands that are applied as they come.

    """
    step = fits.base.settings.simulation['step']
    chance = gain_by_chance([own[-1].start + step * own[-1].steps - own[0].start
                             for own in by_recording(fits.drives).values()])
    search = _search(fits, fits.places, pool)
    rivals = search.likeliest(chance) if any(
        one.steps.scatter > setting('clock_shows') for one in search.tickers) else ()
    if not rivals:
        return None
    plain = _fitted(fits, {}, pool)
    best = min((_fitted(fits, clocks, pool) for clocks in rivals), key=lambda one: one.surprise)
    if plain.surprise - best.surprise <= chance:
        return None
    # Ticks by what is known of the robot with them.
    clocks = _search(fits, best.places, pool).sharp({
        name: replace(clock, late=0.0) for name, clock in best.clocks.items()})
    return tuple(_ticked(drive, clocks) for drive in fits.drives)


def likelier(one: RecordingFits, other: RecordingFits) -> RecordingFits:
    """Return those fits that leave less, each under the noise of what it leaves."""
    return min((one, other), key=_surprise)


@dataclass(frozen=True, eq=False)
class _Fitted:
    # The recordings fitted with commands at some ticks, and their negative log likelihood [nats].
    clocks: Mapping[str, Clock]
    places: Mapping[str, FloatArray]
    surprise: float


def _search(fits: RecordingFits, places: Mapping[str, FloatArray], pool: Threads) -> ClockSearch:
    return ClockSearch([one for one in pool.map(
        lambda drive: _ticker(fits.base, drive, places[drive.recording]), fits.drives)
        if one is not None], pool)


def _later(base: Base, z: FloatArray, by: float) -> FloatArray:
    # With commands that act later.
    found = np.array(z)
    found[base.names.index('dead_time')] += by
    return found


def _ticker(base: Base, drive: Drive, z: FloatArray) -> Ticker | None:
    def read(tries: Sequence[tuple[TimeSeries, float]]) -> list[Rates]:
        every = residuals(base, drive, [_later(base, z, later) for _, later in tries],
                          [commands for commands, _ in tries])
        found: list[Rates] = []
        for left in every:
            rates = []
            if 'wheels' in left:
                times = drive.bins['wheels'].centres()
                rates += [(column, times) for column in left['wheels'].T]
            if 'imu' in left:
                rates.append((left['imu'][:, 0], drive.bins['imu'].centres()))
            found.append(rates)
        return found
    value = dict(zip(base.names, base.values(z), strict=True))
    settings = base.settings
    steps = steps_of(
        drive.command, (drive.start, drive.start + drive.steps * settings.simulation['step']),
        lambda held: read([(held, 0.0)])[0], value['dead_time'],
        value['wheels_window'] + settings.bins['wheels'], settings.fit['tick_spread'])
    return None if steps is None else Ticker(
        drive.recording, drive.command, read, steps, value['dead_time'])


def _fitted(fits: RecordingFits, clocks: Mapping[str, Clock], pool: Threads) -> _Fitted:
    # From where each recording was fitted with commands as they come.
    base, numbers = fits.base, fits.base.settings.fit
    wide = np.array([np.hypot(q.recording, q.change) for q in base.settings.quantities])
    free = fits.prior.free & np.array([
        q.name not in base.settings.runs_as for q in base.settings.quantities])
    groups = by_recording([_ticked(drive, clocks) for drive in fits.drives])

    def refitted(name: str) -> FloatArray:
        late = clocks[name].late if name in clocks else 0.0
        start = _later(base, fits.places[name], late)
        return fit_set(base, groups[name], Prior(start, wide, free), fits.noise, start,
                       int(numbers['steps']), numbers['roughly'], map).z
    places = dict(zip(groups, pool.map(refitted, groups), strict=True))
    drives = tuple(drive for own in groups.values() for drive in own)
    return _Fitted(clocks, places, _surprise(replace(fits, drives=drives, places=places)))


def _surprise(fits: RecordingFits) -> float:
    # The negative log likelihood of what fits leave, under the noise of that [nats].
    left = [residual(fits.base, drive, fits.places[drive.recording]) for drive in fits.drives]
    vigours = [drive.vigour for drive in fits.drives]
    noise = noise_of(left, vigours, fits.base.settings, fits.base.given).among(fits.noise.sd)
    return surprise(noise, left, vigours)


def _ticked(drive: Drive, clocks: Mapping[str, Clock]) -> Drive:
    clock = clocks.get(drive.recording)
    return drive if clock is None else replace(
        drive, command=at_ticks(drive.command, clock.period, clock.phase))
