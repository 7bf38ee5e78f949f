# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The base robot of one nominal model: where its parameters begin, and what is known of them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

from lg_husky_sim.diagnosis.before_after.base_names import FIXED
from lg_husky_sim.diagnosis.before_after.settings import Quantity, Settings
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Streams, of which the delays of others are against the first that is there.
STREAMS = ('pose', 'imu', 'wheels')


@dataclass(frozen=True, eq=False)
class Base:
    """
    The base robot of one nominal model.

    Parameters
    ----------
    settings : Settings
    start, sd : numpy.ndarray, shape (n,)
        Means and standard deviations of the priors, on the scale of the estimates.
    fixed : numpy.ndarray
        Numbers that are not estimated.
    kinds : tuple of mapping of str to float
        Values of robots of other kinds, from which a fit begins as well.
    reference : int
        Index of the delay of the stream against which those of the others are.
    given : bool
        Whether the wheels turn as measured, which leaves the body's motion to be explained.

    """

    settings: Settings
    start: FloatArray
    sd: FloatArray
    fixed: FloatArray
    kinds: tuple[Mapping[str, float], ...]
    reference: int
    given: bool = False

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(q.name for q in self.settings.quantities)

    @cached_property
    def _logarithmic(self) -> NDArray[np.bool_]:
        return np.array([q.logarithmic for q in self.settings.quantities])

    def values(self, z: FloatArray) -> FloatArray:
        """Return parameters [their units] from the scale of the estimates."""
        logs = self._logarithmic
        return np.where(logs, np.exp(np.where(logs, z, 0.0)), z)

    def place(self, name: str, value: float) -> float:
        """Return a parameter on the scale of the estimates."""
        quantity = self.settings.quantities[self.names.index(name)]
        return float(np.log(value)) if quantity.logarithmic else value

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the bounds on the scale of the estimates."""
        def scaled(q: Quantity, value: float) -> float:
            return float(np.log(value)) if q.logarithmic else value
        quantities = self.settings.quantities
        return (np.array([scaled(q, q.lower) for q in quantities]),
                np.array([scaled(q, q.upper) for q in quantities]))


def base_of(settings: Settings, nominal: Parameters, given: bool = False,
            interval: float = 0.0, streams: Collection[str] = STREAMS) -> Base:
    """
    Return the base for the model in doubt.

    Parameters
    ----------
    settings : Settings
        Quantities with their starts and deviations, and constants of the simulation.
    nominal : Parameters
        Of the model in doubt; where quantities without a start of their own begin.
    given : bool
        Whether the wheels turn as measured.
    interval : float
        Of the wheel rates [s].
    streams : collection of str
        That every drive has: delays are against the pose, or else the IMU, or else the wheels.

    Returns
    -------
    Base

    """
    start = [nominal[q.nominal] if q.start is None else q.start for q in settings.quantities]
    logs = [q.logarithmic for q in settings.quantities]
    z = np.array([np.log(x) if log else x for x, log in zip(start, logs, strict=True)])
    names = [q.name for q in settings.quantities]
    late = names.index('wheels_late')
    z[late] += 0.5 * interval
    sd = np.array([q.sd for q in settings.quantities])
    sd[late] += 0.5 * interval
    reference = next((one for one in STREAMS if one in streams), STREAMS[0])
    against = names.index(f'{reference}_late')
    sd[against] = settings.fit['reference']
    numbers = {**settings.simulation,
               'wheelbase': nominal['wheelbase'], 'wheel_radius': nominal['wheel_radius'],
               'motor_resistance': nominal['motor_resistance'],
               'transmission': nominal['torque_constant'] * nominal['gear_ratio']}
    # Without a speed loop the model in doubt says what voltage a command gives.
    voltages = {
        'loop_feedforward':
            nominal['supply_voltage'] * nominal['command_gain'] * nominal['wheel_radius'],
        'turn_width': 2.0 * nominal['turn_ratio'], 'yaw_damping': nominal['yaw_damping']}
    return Base(settings, z, sd, np.array([numbers[name] for name in FIXED]),
                tuple({**kind, **voltages} for kind in settings.kinds), against, given)
