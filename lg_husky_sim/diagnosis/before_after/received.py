# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Drives with the commands that their base got: at its own ticks, without those it missed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.fitting import fit_set, Prior
from lg_husky_sim.diagnosis.before_after.prediction import CHANNELS, residual
from lg_husky_sim.diagnosis.before_after.recording_fits import by_recording, RecordingFits
from lg_husky_sim.diagnosis.before_after.whitening import Noise, noise_of, surprise
from lg_husky_sim.diagnosis.evidence.clock_search import (
    at_ticks,
    ClockSearch,
    gain_by_chance,
    Ticker,
)
from lg_husky_sim.diagnosis.evidence.command_steps import Rates, steps_of
from lg_husky_sim.diagnosis.evidence.drives import Clock
from lg_husky_sim.diagnosis.evidence.repaired_commands import repaired
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
from scipy.stats import norm


def as_received(fits: RecordingFits, pool: Threads) -> tuple[Drive, ...] | None:
    """
    Return the drives with the commands that their base seems to have got.

    Ticks are accepted where they are likelier than none. The likelihood is that of residuals whose
    noise is estimated: with s standard deviations of the n residuals of a channel, ticks gain
    ``n log(s without / s with)``, summed over channels.

    Parameters
    ----------
    fits : RecordingFits
        With commands that are applied as they come, and the wheels not as measured.
    pool : Threads

    Returns
    -------
    tuple of Drive or None
        None where it got all commands as they came.
    """
    plain = _fitted(fits, fits.places, {}, pool)
    search = _search(fits, fits.places, pool)
    rivals = search.likeliest() if any(
        one.steps.scatter > setting('clock_shows') for one in search.tickers) else ()
    best = max((plain, *(_fitted(fits, fits.places, clocks, pool) for clocks in rivals)),
               key=lambda one: -one.surprise)
    step = fits.base.settings.simulation['step']
    lengths = [own[-1].start + step * own[-1].steps - own[0].start
               for own in by_recording(fits.drives).values()]
    if plain.surprise - best.surprise <= gain_by_chance(lengths):
        best = plain
    else:
        # Ticks by what is known of the robot with them.
        clocks = _search(fits, best.places, pool).sharp({
            name: replace(clock, late=0.0) for name, clock in best.clocks.items()})
        best = _fitted(fits, best.places, clocks, pool)
    found = tuple(pool.map(lambda drive: _repaired(
        fits.base, drive, best.places[drive.recording], best.noise), best.drives))
    return None if all(one.command is drive.command for one, drive in zip(
        found, fits.drives, strict=True)) else found


def likelier(one: RecordingFits, other: RecordingFits) -> RecordingFits:
    """Return those fits that leave less, each under the noise of what it leaves."""
    return min((one, other), key=lambda fits: _judged(fits)[1])


@dataclass(frozen=True, eq=False)
class _Fitted:
    # The recordings fitted with commands at some ticks, and their negative log likelihood [nats].
    drives: tuple[Drive, ...]
    clocks: Mapping[str, Clock]
    places: Mapping[str, FloatArray]
    noise: Noise
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
    def read(commands: TimeSeries, later: float) -> Rates:
        left = residual(base, replace(drive, command=commands), _later(base, z, later))
        found = []
        if 'wheels' in left:
            times = drive.bins['wheels'].centres()
            found += [(column, times) for column in left['wheels'].T]
        if 'imu' in left:
            found.append((left['imu'][:, 0], drive.bins['imu'].centres()))
        return found
    value = dict(zip(base.names, base.values(z), strict=True))
    settings = base.settings
    steps = steps_of(
        drive.command, (drive.start, drive.start + drive.steps * settings.simulation['step']),
        lambda held: read(held, 0.0), value['dead_time'],
        value['wheels_window'] + settings.bins['wheels'], settings.fit['tick_spread'])
    return None if steps is None else Ticker(
        drive.recording, drive.command, read, steps, value['dead_time'])


def _fitted(fits: RecordingFits, begin: Mapping[str, FloatArray], clocks: Mapping[str, Clock],
            pool: Threads) -> _Fitted:
    # From places where each recording was fitted.
    base, numbers = fits.base, fits.base.settings.fit
    wide = np.array([np.hypot(q.recording, q.change) for q in base.settings.quantities])
    free = fits.prior.free & np.array([
        q.name not in base.settings.runs_as for q in base.settings.quantities])
    groups = by_recording([_ticked(drive, clocks) for drive in fits.drives])

    def refitted(name: str) -> FloatArray:
        late = clocks[name].late if name in clocks else 0.0
        start = _later(base, begin[name], late)
        return fit_set(base, groups[name], Prior(start, wide, free), fits.noise, start,
                       int(numbers['steps']), numbers['roughly'], map).z
    places = dict(zip(groups, pool.map(refitted, groups), strict=True))
    drives = tuple(drive for own in groups.values() for drive in own)
    return _Fitted(drives, clocks, places, *_judged(
        replace(fits, drives=drives, places=places)))


def _judged(fits: RecordingFits) -> tuple[Noise, float]:
    # The noise of what fits leave, and the negative log likelihood under it [nats].
    left = [residual(fits.base, drive, fits.places[drive.recording]) for drive in fits.drives]
    vigours = [drive.vigour for drive in fits.drives]
    noise = noise_of(left, vigours, fits.base.settings, fits.base.given).among(fits.noise.sd)
    return noise, surprise(noise, left, vigours)


def _ticked(drive: Drive, clocks: Mapping[str, Clock]) -> Drive:
    clock = clocks.get(drive.recording)
    return drive if clock is None else replace(
        drive, command=at_ticks(drive.command, clock.period, clock.phase))


def _repaired(base: Base, drive: Drive, z: FloatArray, noise: Noise) -> Drive:
    rates = {'left', 'right', 'yaw'}

    def left(commands: TimeSeries) -> dict[str, FloatArray]:
        return residual(base, replace(drive, command=commands), z)
    # A few commands that were missed widen a standard deviation, not the scale of most residuals;
    # that at rest is no scale.
    streams = {name: stream for stream, names in CHANNELS.items() for name in names}
    usual = noise.wider({
        name: float(np.median(np.abs(moving)) / norm.ppf(0.75))
        for name, own in noise.by_channel(left(drive.command), drive.vigour).items()
        if np.any(moving := own[~np.isnan(drive.vigour[streams[name]][-own.size:, 0])])})
    rows = usual.by_channel(left(drive.command), drive.vigour)
    centres = {name: drive.bins[streams[name]].centres() for name in rows}
    got = repaired(
        drive.command, np.concatenate(list(rows.values())),
        np.concatenate([np.full(own.size, name in rates) for name, own in rows.items()]),
        np.concatenate([centres[name][centres[name].size - own.size:]
                        for name, own in rows.items()]),
        lambda commands: usual.white(left(commands), drive.vigour))
    return drive if got is drive.command else replace(drive, command=got)
