# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether a base applies commands at ticks of its own, once the likeliest ticks are known.

What else a robot lacks may distort its numbers with and without ticks: then they are looked at
again when that has been found.

Ticks explain why some commands act later than others, not that all are late, which slow ticks of
the right phase can mimic where a drive has few steps of the commands. So both have what all
commands are late as free as the slowest ticks would make it, and ticks must be likelier by more
than the best of so many would be by chance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.clock_search import gain_by_chance
from lg_husky_sim.diagnosis.evidence.drives import Drive
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.unknowns import start_of, tick_unknowns
from lg_husky_sim.diagnosis.selection.rounds import calibrated
from lg_husky_sim.diagnosis.settings import setting
import numpy as np


def ticked(evidence: Evidence, point: Point, drives: Sequence[Drive]) -> tuple[Evidence, Point]:
    """Return evidence and a point of drives with commands at ticks of unknown phases."""
    own = tick_unknowns(drives)
    last = sum(u.kind == 'effect' for u in point.unknowns)
    place = len(point.unknowns) - last
    wider = replace(
        point, unknowns=(*point.unknowns[:place], *own, *point.unknowns[place:]),
        places=np.concatenate([point.places[:place], start_of(own), point.places[place:]]))
    return evidence_of(drives, evidence.names, wider, evidence.noise, evidence.pool), wider


def likelier_ticks(first: Evidence, plain: tuple[Evidence, Fit], starts: Sequence[Point],
                   rivals: Sequence[Sequence[Drive]]) -> Sequence[Drive] | None:
    """
    Return drives with commands at the likeliest of some ticks, if these are likelier than none.

    Parameters
    ----------
    first : Evidence
        Under a first guess of the noise.
    plain : tuple of Evidence and Fit
        Of commands that are applied as they come.
    starts : sequence of Point
        Where the fits begin.
    rivals : sequence of sequence of Drive
        With commands at ticks of one rate or another.

    """
    afresh = [(evidence, evidence.fit(point).bare) for evidence, point in (
        ticked(first, start, drives) for drives in rivals for start in starts)]
    best = min(range(len(afresh)), key=lambda k: afresh[k][1].cost)
    near = calibrated(afresh[best][0], afresh[best][1].point, 1)
    drives = rivals[best // len(starts)]
    return drives if ticks_are_likelier(plain, near, drives) else None


def ticks_are_likelier(plain: tuple[Evidence, Fit], ticked: tuple[Evidence, Fit],
                       drives: Sequence[Drive]) -> bool:
    """
    Return whether ticks are accepted.

    Parameters
    ----------
    plain, ticked : tuple of Evidence and Fit
        Without and with them.
    drives : sequence of Drive
        With the ticks that are likeliest.

    """
    before, after = (evidence.surprise(fit) for evidence, fit in (
        calibrated(evidence, any_lateness(fit.point), 1) for evidence, fit in (plain, ticked)))
    spans: dict[str, list[float]] = {}
    for drive in drives:
        if drive.clock is not None:
            spans.setdefault(drive.recording, []).extend((drive.start, drive.end))
    return before - after > gain_by_chance([max(one) - min(one) for one in spans.values()])


def any_lateness(point: Point) -> Point:
    """Return a point whose commands may be as late as the slowest ticks would make them."""
    late = setting('clock_longest')
    return replace(point, unknowns=tuple(
        replace(u, deviation=late, own=late, room=late, lower=u.prompt - late,
                upper=u.prompt + late) if u.name == 'command_delay' else u
        for u in point.unknowns))
