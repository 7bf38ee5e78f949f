# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How late streams are against a baseline, as they say of each other, without a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.sensors.relations import by_names, relations
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import FloatArray
import numpy as np


def lags_of(recordings: Sequence[Recording], baseline: Sequence[Recording], base: Base
            ) -> Mapping[str, FloatArray]:
    """
    Return by how much the streams of each recording are later than in the baseline.

    Parameters
    ----------
    recordings, baseline : sequence of Recording
        After and before the change.
    base : Base
        Says which parameters are delays, and against which stream they are.

    Returns
    -------
    mapping of str to numpy.ndarray, shape (n,)
        By recording, on the scale of the estimates; zero where they are as late as before, and for
        all but delays. Where both other streams are early, it is that of reference which is late.

    """
    known = {one.name: by_names(relations(segments(one))) for one in (*baseline, *recordings)}
    reference = base.names[base.reference].removesuffix('_late')
    lags = {name: np.zeros(base.start.size) for name in known}
    for stream in ('wheels', 'imu'):
        found = {name: one['yaw rate', stream, reference] for name, one in known.items()
                 if ('yaw rate', stream, reference) in one}
        before = [found[one.name].late.value for one in baseline if one.name in found]
        for name, relation in found.items() if before else ():
            more = relation.late.value - float(np.median(before))
            if abs(more) > max(setting('late_tolerance'), relation.interval):
                lags[name][base.names.index(f'{stream}_late')] = more
    if reference == 'pose':
        both = [base.names.index(f'{stream}_late') for stream in ('wheels', 'imu')]
        for lag in lags.values():
            shared = float(np.median([0.0, *lag[both]]))
            lag[both] -= shared
            lag[base.reference] -= shared
    return lags
