# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A model that runs away, of which ever shorter steps would see no end."""

from __future__ import annotations

from lg_husky_sim.errors import ParameterError

#: Speed [m/s] and yaw rate [rad/s] that no base reaches.
RUNAWAY = 1000.0


def refuse_runaway(steps: int) -> None:
    """
    Refuse what the kernel could not drive to its end.

    Parameters
    ----------
    steps : int
        What the kernel returned.

    Raises
    ------
    ParameterError
        If the base gets faster than :data:`RUNAWAY`: an effort that grows with the speed, as of
        a scrub less than that of no speed, has no other end.

    """
    if steps < 0:
        raise ParameterError(f'with these parameters the model is unstable: it exceeds '
                             f'{RUNAWAY:g} m/s or rad/s')
