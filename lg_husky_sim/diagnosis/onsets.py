# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When and where an effect may begin: onsets to try, as groups of values."""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Time between two moments at which an onset is tried [s].
ONSET_STEP = 1.5
#: Data that must lie on either side of an onset [s].
ONSET_MARGIN = 3.0
#: Places at which an onset is tried.
PLACES = 16


@dataclass(frozen=True, eq=False)
class Onsets:
    """
    Onsets to try, as unions of groups of values.

    Parameters
    ----------
    groups : numpy.ndarray of int64, shape (n_values,)
    count : int
        Number of groups.
    onsets : tuple of (Onset, numpy.ndarray of bool, shape (n_groups,))
        Each with the groups that lie after it.
    placebos : tuple of numpy.ndarray of bool, shape (n_groups,)
        Groups in which an effect is switched on for comparison.
    given : bool
        Whether the onset is known and not looked for.
    """

    groups: NDArray[np.int64]
    count: int
    onsets: tuple[tuple[Onset, NDArray[np.bool_]], ...]
    placebos: tuple[NDArray[np.bool_], ...] = ()
    given: bool = False


def _places(observations: Observations) -> tuple[NDArray[np.int64], FloatArray]:
    # Recording number and x of every value.
    owner = np.zeros(observations.times.size, dtype=np.int64)
    x = np.full(observations.times.size, np.nan)
    for one in observations.slices:
        piece = observations.pieces[one.piece]
        owner[one.first:one.last] = observations.recordings.index(piece.recording)
        if piece.pose is not None:
            x[one.first:one.last] = np.interp(observations.times[one.first:one.last],
                                              piece.pose.times, piece.pose.column('x'))
    return owner, x


def time_onsets(observations: Observations) -> Onsets:
    """
    Return onsets in time.

    Parameters
    ----------
    observations : Observations

    Returns
    -------
    Onsets
        In each recording (later recordings lie after it), and at the same time in all of them.
    """
    owner, _ = _places(observations)
    times = observations.times
    cells = np.maximum(0, np.floor(times / ONSET_STEP).astype(np.int64))
    width = int(cells.max(initial=0)) + 1
    names = observations.recordings
    number = np.repeat(np.arange(len(names)), width)
    begins = np.tile(np.arange(width) * ONSET_STEP, len(names))
    found: list[tuple[Onset, NDArray[np.bool_]]] = []
    ends = [times[owner == i].max() for i in range(len(names))]
    for i, name in enumerate(names):
        for moment in begins[:width]:
            if ONSET_MARGIN <= moment <= ends[i] - ONSET_MARGIN or (i > 0 and moment == 0.0):
                found.append((Onset(OnsetKind.TIME, float(moment), name),
                              (number > i) | ((number == i) & (begins >= moment))))
    if len(names) > 1:
        for moment in begins[:width]:
            if ONSET_MARGIN <= moment <= min(ends) - ONSET_MARGIN:
                found.append((Onset(OnsetKind.TIME, float(moment)), begins >= moment))
    return Onsets(owner * width + cells, width * len(names), tuple(found))


def change_onsets(observations: Observations, change: Onset, found: Onset | None = None
                  ) -> tuple[Onsets, ...]:
    """
    Return the onsets of a change between recordings.

    Parameters
    ----------
    observations : Observations
    change : Onset
        The beginning of the first later recording.
    found : Onset, optional
        Where a change was found before: a further one begins there too.

    Returns
    -------
    tuple of Onsets
        The beginning of the later recordings, or what was found; and, unless something was found,
        moments inside them and places in them. Placebos are single earlier recordings.
    """
    if found is not None and found.kind is not OnsetKind.TIME:
        return (_later_places(observations, found.recording, found),)
    inside = time_onsets(observations)
    names = observations.recordings
    number = names.index(change.recording)
    width = inside.count // len(names)
    owner, begins = np.divmod(np.arange(inside.count), width)
    placebos = tuple(owner == i for i in range(number))
    start = found or change
    first = names.index(start.recording)
    after = (owner > first) | ((owner == first) & (
        (begins + 0.5) * ONSET_STEP >= start.value if found else True))
    given = Onsets(inside.groups, inside.count, ((start, after),), placebos, True)
    if found:
        return (given,)
    later = tuple((onset, groups) for onset, groups in inside.onsets
                  if onset.recording in names[number:]
                  and (onset.recording != change.recording or onset.value > change.value))
    return (given, Onsets(inside.groups, inside.count, later, placebos),
            _later_places(observations, change.recording))


def _later_places(observations: Observations, recording: str, found: Onset | None = None
                  ) -> Onsets:
    # Places that matter from a recording on: all that are tried, or the one that was found.
    owner, x = _places(observations)
    names = observations.recordings
    number = names.index(recording)
    known = x[np.isfinite(x) & (owner >= number)]
    edges = _spaced(known) if known.size else np.zeros(0)
    if found is not None:
        edges = np.array([found.value])
    elif edges.size == 0 or edges[-1] - edges[0] < 1.0:
        return Onsets(np.zeros(x.size, dtype=np.int64), 1, ())
    width = edges.size + 2
    cell = np.where(np.isfinite(x), np.searchsorted(edges, x, side='right'), width - 1)
    group_owner, group_cell = np.divmod(np.arange(width * len(names)), width)
    placebos = tuple(group_owner == i for i in range(number))
    tried: list[tuple[Onset, NDArray[np.bool_]]] = []
    for i, edge in enumerate(edges):
        sides = {OnsetKind.PLACE_ABOVE: (group_cell > i) & (group_cell < width - 1),
                 OnsetKind.PLACE_BELOW: group_cell <= i}
        tried.extend((Onset(kind, float(edge), recording), side & (group_owner >= number))
                     for kind, side in sides.items() if found is None or kind is found.kind)
    if found is not None:
        tried = [(found, groups) for _, groups in tried]
    return Onsets(owner * width + cell, width * len(names), tuple(tried), placebos,
                  found is not None)


def _spaced(known: FloatArray) -> FloatArray:
    low, high = np.quantile(known, [0.1, 0.9])
    return np.linspace(float(low), float(high), PLACES)


def place_onsets(observations: Observations) -> Onsets:
    """
    Return onsets along x, from above and from below.

    Parameters
    ----------
    observations : Observations

    Returns
    -------
    Onsets
        Empty where there is no pose, or it does not move by a metre.
    """
    _, x = _places(observations)
    known = x[np.isfinite(x)]
    edges = _spaced(known) if known.size else np.zeros(0)
    if edges.size == 0 or edges[-1] - edges[0] < 1.0:
        return Onsets(np.zeros(x.size, dtype=np.int64), 1, ())
    groups = np.where(np.isfinite(x), np.searchsorted(edges, x, side='right'), PLACES + 1)
    found: list[tuple[Onset, NDArray[np.bool_]]] = []
    cells = np.arange(PLACES + 2)
    for i, edge in enumerate(edges):
        above = (cells >= i + 1) & (cells <= PLACES)
        found.append((Onset(OnsetKind.PLACE_ABOVE, float(edge)), above))
        found.append((Onset(OnsetKind.PLACE_BELOW, float(edge)), cells <= i))
    return Onsets(groups, PLACES + 2, tuple(found))
