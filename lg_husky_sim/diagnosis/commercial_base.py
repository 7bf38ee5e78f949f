# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
A commercial base as one hypothesis, where an open-loop voltage is refuted.

The base of :mod:`~lg_husky_sim.diagnosis.before_after` (limited commands, dead time, wheel-speed
loop, tyres that saturate) is fitted to one set of recordings, and the linear graph that runs like
it to the same ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.before_after.base import Base, base_of
from lg_husky_sim.diagnosis.before_after.drives import all_drives
from lg_husky_sim.diagnosis.before_after.fitting import fit_set, Prior, raced
from lg_husky_sim.diagnosis.before_after.prediction import residual
from lg_husky_sim.diagnosis.before_after.runnable import fitted, started
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.before_after.starts import starts_from
from lg_husky_sim.diagnosis.before_after.whitening import first_noise, noise_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.recording import Recording
from lg_husky_sim.recording.recording import Segment
import numpy as np


@dataclass(frozen=True)
class CommercialBase:
    """
    The fitted base.

    Parameters
    ----------
    model : ModelFile
        A linear graph that runs like it.
    values : mapping of str to float
        Parameters of the base, as in ``config/before_after.yaml`` [units there].

    """

    model: ModelFile
    values: Mapping[str, float]

    @property
    def words(self) -> str:
        """Return what the base does, in words."""
        dead = f'{self.values["dead_time"]:.2f}'
        late = '' if float(dead) == 0.0 else f', acts {dead} s late'
        return ('a base that limits its acceleration at '
                f'{self.values["slew_forward"]:.3g} m/s² and '
                f'{self.values["slew_yaw"]:.3g} rad/s²{late} and closes a wheel-speed loop')


def commercial_base(recordings: Sequence[Recording], parts: Sequence[Segment],
                    nominal: ModelFile, late: Mapping[str, float], about: str,
                    pool: Executor) -> CommercialBase | None:
    """
    Fit a commercial base.

    Parameters
    ----------
    recordings : sequence of Recording
        In which `parts` lie.
    parts : sequence of Segment
        To be fitted.
    nominal : ModelFile
        Sizes and masses to begin with, and faults of sensors.
    late : mapping of str to float
        Numbers of the sensors that are known, by their names in ``config/before_after.yaml``.
    about : str
        Of the model that is returned.
    pool : Executor
        Threads to fit with.

    Returns
    -------
    CommercialBase or None
        None where nothing is long enough, or not driven.

    """
    nominal = nominal.in_proportion()
    known = settings().of(nominal.structure.robot)
    parts = _shortened(parts)
    cut = [replace(r, streams={name: series.slice(p.start, p.end)
                               for name, series in r.streams.items()})
           for r in recordings for p in parts if p.recording == r.name]
    drives = all_drives(cut, known.simulation['step'], known.bins, known.fit['settle'],
                        known.fit['shortest'])
    if not drives:
        return None
    intervals = [float(np.median(np.diff(d.wheels.times))) for d in drives
                 if d.wheels.times.size > 1]
    base = base_of(known, nominal.parameters, False, max(intervals, default=0.0))
    start = np.array(base.start)
    for name, value in late.items():
        start[base.names.index(name)] = value
    for name, least in _limits(base, parts).items():
        start[base.names.index(name)] = max(start[base.names.index(name)], np.log(least))
    base = replace(base, start=start)
    prior = Prior(base.start, base.sd, np.ones(start.size, dtype=np.bool_))
    noise = first_noise(known)
    steps, rough = int(known.fit['steps']), known.fit['roughly']
    z = raced(base, drives, prior, noise, starts_from(base, prior.free, base.start), rough,
              pool.map).z
    noise = noise_of([residual(base, d, z) for d in drives],
                     [d.vigour for d in drives], known, base.given)
    z = fit_set(base, drives, prior, noise, z, steps, rough, pool.map).z
    values = dict(zip(base.names, map(float, base.values(z)), strict=True))
    model = fitted([started(nominal, values, known)], parts, int(known.fit['evaluations']), about)
    return CommercialBase(model, values)


def _limits(base: Base, parts: Sequence[Segment]) -> dict[str, float]:
    # Limits that the recording refutes before any fit: what is driven is within them.
    room = setting('base_room')

    def largest(stream: str, name: str) -> float:
        return max((float(np.max(np.abs(p.streams[stream].column(name)), initial=0.0))
                    for p in parts if stream in p.streams), default=0.0)
    volts = base.values(base.start)[base.names.index('loop_feedforward')]
    wheel = max(largest('wheels', 'left'), largest('wheels', 'right'))
    found = {'limit_forward': room * largest('command', 'forward'),
             'limit_yaw': room * largest('command', 'yaw'), 'voltage_limit': room * volts * wheel}
    return {name: value for name, value in found.items() if value > 0.0}


def _shortened(parts: Sequence[Segment]) -> list[Segment]:
    # As much as tells a base: what comes first, up to a total length.
    kept, left = [], setting('base_longest')
    for part in parts:
        if left < settings().fit['shortest']:
            break
        end = min(part.end, part.start + left)
        kept.append(part if end == part.end else replace(part, end=end, streams={
            name: series.slice(part.start, end) for name, series in part.streams.items()}))
        left -= end - part.start
    return kept
