# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Refuse wheel rates that no wheel can have: a wrong unit or a faulty driver, no physics."""

from __future__ import annotations

from lg_husky_sim.errors import DiagnosisError
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Part of a recording's wheel rates that may be anything; largest multiple of the model's rates
#: that is believed, and a rate that always is [rad/s]: 8 m/s on the Husky's wheels.
ODD, MULTIPLE, BELIEVED = 0.05, 10.0, 50.0


def check_wheel_rates(observations: Observations, nominal: ModelFile) -> None:
    """
    Refuse recordings whose wheels are said to turn faster than any do.

    Parameters
    ----------
    observations : Observations
    nominal : ModelFile
        The model in doubt: what it does with the same commands is the yardstick.

    Raises
    ------
    DiagnosisError
        If more than a few of a recording's wheel rates are beyond belief.
    """
    predicted = observations.predict(compile_model(nominal.structure).at(nominal.parameters))
    said: dict[tuple[str, str], list[FloatArray]] = {}
    done: dict[tuple[str, str], float] = {}
    for one in observations.slices:
        part = slice(one.first, one.last)
        if one.channel.startswith('wheel') and one.last > one.first:
            key = (observations.pieces[one.piece].recording, one.channel)
            said.setdefault(key, []).append(np.abs(observations.measured[part]))
            done[key] = max(done.get(key, 0.0), float(np.max(np.abs(predicted[part]))))
    for (recording, channel), values in said.items():
        rate = float(np.quantile(np.concatenate(values), 1.0 - ODD))
        most = max(BELIEVED, MULTIPLE * done[recording, channel])
        if rate > most:
            raise DiagnosisError(
                f'recording {recording}: {channel.replace("_", " ")} turns at {rate:.3g} rad/s; '
                f'up to {most:.3g} rad/s is possible: wheel rates must be in rad/s')
