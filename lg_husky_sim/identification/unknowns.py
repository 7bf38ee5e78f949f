# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which numbers an estimation varies, and from where it starts."""

from __future__ import annotations

from collections.abc import Sequence
import math

from lg_husky_sim.errors import FitError
from lg_husky_sim.husky.effects import EffectParameter
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile, packaged
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.husky.robot_size import size_of, speeds_of
from lg_husky_sim.identification.least_squares import effect_unknown, Unknown
from lg_husky_sim.identification.paper import paper
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.identification.settings import setting
from lg_husky_sim.identification.start_states import INITIAL_STATE, settle_of, start_unknowns
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Unknowns of a recording: unit, lower and upper bound, step of a difference.
NUISANCES: dict[str, tuple[str, float, float, float]] = {
    'latency': ('s', 0.0, 1.0, 0.01),
    'delay_wheels': ('s', -0.5, 0.5, 0.01),
    'delay_imu': ('s', -0.5, 0.5, 0.01),
    'delay_pose': ('s', -0.5, 0.5, 0.01),
    'gyro_bias': ('rad/s', -0.5, 0.5, 0.002),
}
#: Random starts lie within this factor of the given value: of one that nobody knows, such as a
#: damping, and of one that is known to its tolerance.
AROUND, NEAR = 6.0, 1.8


def free_names(model: ModelFile, asked: Sequence[str]) -> tuple[str, ...]:
    """
    Return the names to estimate.

    Parameters
    ----------
    model : ModelFile
        Says which parameters there are, and which are free by default.
    asked : sequence of str
        As the user asked; empty for the model's own choice.

    Returns
    -------
    tuple of str

    Raises
    ------
    FitError
        If nothing is free.
    ParameterError
        If a name is unknown.

    """
    if asked:
        for name in asked:
            model.parameters.entry(name)
        return tuple(dict.fromkeys(asked))
    names = [p.name for p in model.parameters.entries if p.free]
    names += [p.name for effect in model.structure.effects for p in effect.parameters()
              if not p.fixed]
    if not names:
        raise FitError('no parameter is free: mark one in the model file, or name some with '
                       '--free')
    return tuple(dict.fromkeys(names))


def check_profiles(model: ModelFile, free: Sequence[str], nuisance: Sequence[str],
                   profiles: Sequence[str]) -> None:
    """
    Check that what is to be profiled will be estimated.

    Parameters
    ----------
    model : ModelFile
        Says what is free by default.
    free, nuisance, profiles : sequence of str
        As the user asked.

    Raises
    ------
    FitError
        If one will not be estimated.

    """
    names = [*free_names(model, free), *(name for name in nuisance if name != INITIAL_STATE)]
    for name in profiles:
        if name not in names:
            raise FitError(f'no profile of {name!r}: it is not estimated '
                           f'(estimated: {", ".join(names)})')


def effect_parameters(model: ModelFile) -> dict[str, EffectParameter]:
    """Return the numbers of the model's effects by name."""
    return {p.name: p for effect in model.structure.effects for p in effect.parameters()}


def unknowns_of(model: ModelFile, names: Sequence[str], nuisance: Sequence[str],
                data: Observations | None = None) -> tuple[Unknown, ...]:
    """
    Return what a least-squares estimation varies.

    Parameters
    ----------
    model : ModelFile
        With the values and bounds of the parameters.
    names : sequence of str
        Parameters, of the robot or of its effects.
    nuisance : sequence of str
        Keys of :data:`NUISANCES`, or :data:`~.start_states.INITIAL_STATE`.
    data : Observations, optional
        Whose starts to estimate, if asked.

    Returns
    -------
    tuple of Unknown
        Positive parameters by their logarithm, with a weak prior.

    Raises
    ------
    FitError
        If a nuisance is unknown.

    """
    of_effects = effect_parameters(model)
    found = []
    for name in names:
        entry = model.parameters.entry(name)
        if name in of_effects and of_effects[name].lower <= 0.0:
            size = max(abs(entry.value), abs(of_effects[name].starts[0]))
            found.append(effect_unknown(of_effects[name], size))
        elif entry.lower > 0.0:
            found.append(Unknown(name, True, math.log(entry.value), setting('prior_deviation'),
                                 entry.lower,
                                 entry.upper, 0.01))
        else:
            step = 0.01 * max(abs(entry.value), 1e-3)
            found.append(Unknown(name, False, entry.value, math.inf, entry.lower, entry.upper,
                                 step))
    for name in nuisance:
        if name == INITIAL_STATE and data is not None:
            continue
        if name not in NUISANCES:
            known = ', '.join((*NUISANCES, INITIAL_STATE))
            raise FitError(f'unknown nuisance {name!r} (known: {known})')
        _, lower, upper, step = NUISANCES[name]
        found.append(Unknown(name, False, 0.0, math.inf, lower, upper, step, extra=True))
    if INITIAL_STATE in nuisance and data is not None:
        found += start_unknowns(data, compile_model(model.structure).at(model.parameters),
                                settle_of(model.structure, nuisance),
                                speeds_of(model.parameters, packaged().parameters))
    return tuple(found)


def starts_of(model: ModelFile, unknowns: Sequence[Unknown], count: int, seed: int
              ) -> list[dict[str, float]]:
    """
    Return values to start from.

    Parameters
    ----------
    model : ModelFile
        Whose values are the first start.
    unknowns : sequence of Unknown
        What is varied.
    count : int
        Number of starts; one is made at least.
    seed : int
        Of the spread.

    Returns
    -------
    list of dict
        The first is the model's own; in the others the robot's parameters are spread by a
        factor of :data:`AROUND` or :data:`NEAR` either way, evenly in the logarithm, and effects
        take the sizes of the catalogue in turn.

    """
    draws = np.random.default_rng(seed)
    of_effects = effect_parameters(model)
    result = []
    for number in range(max(1, count)):
        values: dict[str, float] = {}
        for unknown in unknowns:
            if unknown.local is not None:
                values[unknown.name] = 0.0
                continue
            shift = float(draws.uniform(-1.0, 1.0))
            if unknown.extra:
                values[unknown.name] = 0.0
                continue
            given = model.parameters[unknown.name]
            if number and unknown.name in of_effects:
                sizes = of_effects[unknown.name].starts
                given = sizes[number % len(sizes)] * 1.3 ** shift
            elif number and unknown.logarithmic:
                unsure = _unsure(model.parameters.entry(unknown.name))
                given *= (AROUND if unsure else NEAR) ** shift
            values[unknown.name] = min(max(given, unknown.lower), unknown.upper)
        result.append(values)
    return result


def search_bounds(parameters: Parameters, names: Sequence[str]
                  ) -> tuple[FloatArray, FloatArray]:
    """
    Return the box of a search by populations: the paper's bounds where it states them.

    They are in proportion to the robot: to the given value where that is known to some
    tolerance, to its size where nobody knows it. The given value is always inside.

    Parameters
    ----------
    parameters : Parameters
        Values and bounds of the robot.
    names : sequence of str
        Parameters that are searched, in the order of the bounds.

    Returns
    -------
    lower, upper : numpy.ndarray, shape (n_names,)

    """
    robot = size_of(parameters, packaged().parameters)
    rows = []
    for entry in map(parameters.entry, names):
        stated = paper().search.get(entry.name)
        if stated is None:
            rows.append((entry.lower, entry.upper))
            continue
        factor = robot.factor(stated.unit) if _unsure(entry) else entry.value / stated.result
        rows.append((max(entry.lower, min(factor * stated.lower, entry.value)),
                     min(entry.upper, max(factor * stated.upper, entry.value))))
    box = np.array(rows, dtype=np.float64).reshape(-1, 2)
    return box[:, 0], box[:, 1]


def _unsure(entry: Parameter) -> bool:
    return entry.tolerance >= 1.0
