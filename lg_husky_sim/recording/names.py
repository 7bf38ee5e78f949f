# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Names of recordings read together: results go by name, and bags are called alike."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
import os
from pathlib import PurePath

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording.recording import Recording


def named_apart(*groups: Sequence[Recording]) -> tuple[tuple[Recording, ...], ...]:
    """
    Return recordings of which no two have one name.

    Parameters
    ----------
    *groups : sequence of Recording
        The first keeps its names where they differ among themselves; a later one may not use
        them again.

    Returns
    -------
    tuple of tuple of Recording
        The groups; in front of names that are not enough stand the folders that make them
        differ, as in ``before/drive``; those that never lay in a file get a number behind.

    Raises
    ------
    RecordingError
        If a recording is given twice.

    """
    everything = [recording for group in groups for recording in group]
    places = [os.path.realpath(recording.path) for recording in everything if recording.path]
    for place in places:
        if places.count(place) > 1:
            raise RecordingError(f'recording {place} is given twice')
    for recording in everything:
        if sum(recording is other for other in everything) > 1:
            raise RecordingError(f'recording {recording.name} is given twice')
    taken: set[str] = set()
    found = []
    for group in _numbered(groups):
        names = _apart(group, taken)
        taken.update(names)
        found.append(tuple(
            recording if name == recording.name else replace(recording, name=name)
            for recording, name in zip(group, names, strict=True)))
    return tuple(found)


def named_as_in(recordings: Sequence[Recording], known: Collection[str]
                ) -> tuple[Recording, ...]:
    """
    Return recordings under the names that a model's onset knows them by.

    Parameters
    ----------
    recordings : sequence of Recording
        Under the names of their folders or files.
    known : collection of str
        Names of recordings in a model file, some with the folders that told them apart.

    Returns
    -------
    tuple of Recording
        Each with the longest known name that its place ends in; with its own if there is none.

    """
    found = []
    for recording in recordings:
        name = next((one for one in reversed(_ladder(recording)) if one in known),
                    recording.name)
        found.append(recording if name == recording.name else replace(recording, name=name))
    return tuple(found)


def printable(text: str) -> str:
    """Return the name of a file as pages and JSON can hold it: not all such names are UTF-8."""
    return text.encode('utf-8', 'replace').decode()


def _numbered(groups: Sequence[Sequence[Recording]]) -> list[list[Recording]]:
    # What was simulated has no folder that could tell it from its namesakes.
    seen: dict[str, int] = {}
    found: list[list[Recording]] = []
    for group in groups:
        found.append([])
        for recording in group:
            count = 0 if recording.path else seen.get(recording.name, 0) + 1
            seen[recording.name] = max(count, seen.get(recording.name, 0))
            found[-1].append(recording if count < 2 else replace(
                recording, name=f'{recording.name} {count}'))
    return found


def _apart(group: Sequence[Recording], taken: set[str]) -> list[str]:
    # Each with as few folders as tell it from the others and from what is taken.
    ladders = [_ladder(recording) for recording in group]
    names = []
    for number, ladder in enumerate(ladders):
        others = set(taken).union(*(one for k, one in enumerate(ladders) if k != number))
        names.append(next((one for one in ladder if one not in others), ladder[-1]))
    return names


def _ladder(recording: Recording) -> list[str]:
    # The name alone, then with more and more of the folders in which the recording lies; the
    # last is where it really lies, which no two share.
    if not recording.path:
        return [recording.name]
    place = PurePath(os.path.realpath(recording.path))
    folders = place.parent.parts[1:]
    return [recording.name,
            *('/'.join((*folders[-count:], recording.name))
              for count in range(1, len(folders) + 1)),
            f'{place.parent}/{recording.name}', str(place)]
