# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Drives with commands at the ticks of their base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.clock_search import at_ticks, ClockSearch, Ticker
from lg_husky_sim.diagnosis.evidence.command_steps import Rates, steps_of
from lg_husky_sim.diagnosis.evidence.drives import Channel, Clock, Drive
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.measured_place import is_measured
from lg_husky_sim.diagnosis.evidence.observation import observe, simulate
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import TimeSeries
import numpy as np

_RATES = (Channel.WHEEL_LEFT, Channel.WHEEL_RIGHT, Channel.YAW_RATE)
_ANGLES = (Channel.ANGLE_LEFT, Channel.ANGLE_RIGHT)
_POSE = (Channel.X, Channel.Y, Channel.HEADING)


def _ticked(drive: Drive, clock: Clock) -> Drive:
    held = at_ticks(drive.commands, clock.period, clock.phase)
    return replace(drive, commands=held, logged=held, clock=clock)


def ticked_as(drive: Drive, known: Sequence[Drive]) -> Drive:
    """
    Return a drive with commands at the ticks of its base, where those are known.

    Parameters
    ----------
    drive : Drive
        With the commands as they come.
    known : sequence of Drive
        The one that is nearest in the same recording tells.

    Returns
    -------
    Drive

    """
    near = min((one for one in known if one.recording == drive.recording), default=None,
               key=lambda one: max(one.start - drive.start, drive.start - one.end))
    return drive if near is None or near.clock is None else _ticked(drive, near.clock)


def _rates(plant: Plant, drive: Drive, log: Reading) -> Rates:
    # Residuals of rates of wheels and yaw, or of what angles change by, each with its times.
    left, found = drive.measured - observe(simulate(plant, drive, log), drive, log), []
    for channel in (*_RATES, *_ANGLES):
        rows = drive.slice_of(channel)
        if rows.stop > rows.start:
            own, times = left[rows], drive.times[rows]
            found.append((own, times) if channel in _RATES else (np.diff(own), times[1:]))
    return found


def _without_pose(drive: Drive) -> Drive:
    # Rates do not need it, and each of its times is a row of a simulation.
    kept = ~np.isin(drive.channels, _POSE)
    return replace(drive, pose_times=drive.pose_times[:0], heading=drive.heading[:0],
                   measured=drive.measured[kept], channels=drive.channels[kept],
                   times=drive.times[kept], rounding=drive.rounding[kept])


def ticker_of(plant: Plant, drive: Drive, log: Reading, spread: float) -> Ticker | None:
    """
    Return what looks for the clock of a base in one drive, if it tells.

    Parameters
    ----------
    plant : Plant
        As it is in the drive's recording.
    drive : Drive
        With the commands as they come.
    log : Reading
        How the log was made: its delays and the windows of its rates.
    spread : float
        What the delays of commands vary by [s].

    Returns
    -------
    Ticker or None
        None where no rate shows a step of a command.

    """
    delay = log.get('command_delay')
    # A place is where the pose says.
    rates_only = drive if is_measured(drive, plant.onset) else _without_pose(drive)

    def read(tries: Sequence[tuple[TimeSeries, float]]) -> list[Rates]:
        return [_rates(plant, replace(rates_only, commands=commands, logged=commands),
                       log.replacing({'command_delay': delay + later}))
                for commands, later in tries]
    steps = steps_of(drive.commands, (drive.start, drive.end),
                     lambda held: read([(held, 0.0)])[0], delay, log.get('wheel_window'), spread)
    return None if steps is None else Ticker(drive.recording, drive.commands, read, steps, delay)


def ticking(evidence: Evidence, fit: Fit) -> list[list[Drive]]:
    """
    Return drives with commands at the likeliest ticks of their base, at one rate after another.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        With commands that are applied as they come.

    Returns
    -------
    list of list of Drive
        Those that differ most from none first. Empty where commands jitter, or are late in one
        recording more than in another, too little for it, are at ticks already, no drive tells,
        or rates are likelier without ticks.
        Whether these ticks make the drives likelier than none is for a fit to say.

    """
    # Where all commands of a recording are in step with the ticks, each has a delay of its own.
    own = [fit.point.log.get(d.own_lag) for d in evidence.drives]
    spread = max(evidence.noise.values['command_jitter'], max(own) - min(own))
    if spread < setting('clock_shows') or any(d.clock for d in evidence.drives):
        return []
    log = fit.point.log
    plants = evidence.plants(fit.point.plant)
    plain = [replace(d, commands=d.logged) for d in evidence.drives]
    tickers = [one for one in evidence.pool.map(
        lambda plant, drive: ticker_of(plant, drive, log, spread), plants, plain)
        if one is not None]
    if not tickers:
        return []
    return [[_ticked(drive, clocks[drive.recording]) if drive.recording in clocks else drive
             for drive in plain] for clocks in ClockSearch(tickers, evidence.pool).likeliest()]
