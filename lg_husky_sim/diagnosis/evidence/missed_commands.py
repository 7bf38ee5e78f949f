# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Single commands that a base missed, by what its wheels did after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import Channel
from lg_husky_sim.diagnosis.evidence.frames import Frame
from lg_husky_sim.diagnosis.evidence.noise import Whitener
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np


def with_missed_commands(frames: Sequence[Frame], whiteners: Sequence[Whitener],
                         whitened: FloatArray) -> list[Frame]:
    """
    Return frames that expect what single commands did which the base missed or got twice.

    A step of the command after which the wheels leave the simulation by far more than noise is
    taken for one that the base missed, as long as there are few of them: up to a stated share.

    Parameters
    ----------
    frames : sequence of Frame
    whiteners : sequence of Whitener
        That made the innovations.
    whitened : numpy.ndarray, shape (n,)
        Of all drives, one after the other.
    """
    spots: list[list[list[float]]] = []
    commands, place = 0, 0
    for whitener in whiteners:
        frame = whitener.frame
        e = whitened[place:place + frame.times.size]
        place += frame.times.size
        times = frame.times[frame.order]
        channels = frame.drive.channels[frame.order]
        wheel = channels <= int(Channel.WHEEL_RIGHT)
        stamps = frame.drive.commands.times
        commands += stamps.size
        own: list[list[float]] = []
        if stamps.size > 3 and np.any(wheel):
            usual = float(np.median(np.diff(stamps)))
            far = wheel & (np.abs(e) > setting('far'))
            for stamp in np.unique(np.searchsorted(stamps, times[far], side='right') - 1):
                begin = float(stamps[max(int(stamp), 0)])
                if own and begin - own[-1][0] < 2.0 * usual:
                    continue
                near = wheel & (times >= begin) & (times <= begin + 2.0 * usual)
                sizes = [float(np.max(np.abs((e * whitener.scale)[near & (channels == side)]),
                                      initial=0.0)) ** 2 for side in (0, 1)]
                own.append([begin, *sizes])
        spots.append(own)
    if sum(map(len, spots)) > setting('missed_share') * commands + 1.0:
        return list(frames)
    found = []
    for frame, own in zip(frames, spots, strict=True):
        usual = (float(np.median(np.diff(frame.drive.commands.times)))
                 if frame.drive.commands.times.size > 3 else 0.0)
        more = np.array([row for spot in own for row in (
            spot, [spot[0] + usual, *spot[1:]])]).reshape(-1, 3)
        kicks = np.vstack([frame.kicks, more])
        found.append(replace(frame, kicks=kicks[np.argsort(kicks[:, 0], kind='stable')]))
    return found
