# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether recordings are of a robot that is driven at all."""

from __future__ import annotations

from collections.abc import Sequence

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording.recording import Recording
import numpy as np


def check_driven(recordings: Sequence[Recording]) -> None:
    """
    Check that a command of some recording is not zero.

    Parameters
    ----------
    recordings : sequence of Recording
        That are judged together.

    Raises
    ------
    RecordingError
        If all are, or one has no commands.

    """
    if not any(np.any(recording.stream('command').values) for recording in recordings):
        raise RecordingError(f'{", ".join(r.name for r in recordings)}: all commands are zero; a '
                             'robot that is not driven shows nothing of its physics')
