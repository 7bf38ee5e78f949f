# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A model of the linear graph that runs like the base robot, for simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lg_husky_sim.comparison.metrics import channel_errors, measured_channels, predicted_at
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.diagnosis.before_after.settings import Settings
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy.optimize import least_squares

#: What a base adds to the graph's command path, drivetrains and tyres.
ADDED = (Effect('command_latency'), Effect('command_slew', shape='both'),
         Effect('traction_saturation', shape='circle'))
#: What is fitted after the numbers of the base are put in, all positive.
FITTED = ('wheel_damping', 'yaw_damping', 'traction_torque', 'command_gain', 'turn_ratio',
          'loop_gain', 'dry_torque')
#: Channels that it is fitted to.
_RATES = ('wheel_left', 'wheel_right', 'yaw_rate')


def started(nominal: ModelFile, base: Mapping[str, float], settings: Settings) -> ModelFile:
    """
    Return the nominal model with the limits, the loop and the grip of a base.

    Parameters
    ----------
    nominal : ModelFile
        In doubt; what is not set from the base stays as it is.
    base : mapping of str to float
        Parameters of the base robot [their units].
    settings : Settings
        Constants of the simulation and of the fits.

    Returns
    -------
    ModelFile

    """
    parameters = nominal.parameters
    transmission = parameters['torque_constant'] * parameters['gear_ratio']
    radius = 0.5 * (base['radius_left'] + base['radius_right'])
    load = base['mass'] * settings.simulation['gravity'] / 4.0
    loop = base['loop_gain'] + base['loop_integral'] * settings.fit['settle'] > (
        settings.fit['loop_shows'] * base['loop_feedforward'])
    volts = transmission if loop else base['loop_feedforward']
    values = {
        'latency': base['dead_time'], 'slew_forward': base['slew_forward'],
        'slew_yaw': base['slew_yaw'], 'loop_lag': base['reference_lag'],
        'loop_gain': base['loop_gain'], 'loop_integral': base['loop_integral'],
        'loop_forward_share': base['loop_feedforward'] / transmission,
        'traction_torque': base['grip_along'] * load * radius,
        'wheel_radius': radius, 'mass': base['mass'], 'yaw_inertia': base['yaw_inertia'],
        'wheel_inertia': base['wheel_inertia'],
        'command_gain': base['speed_gain'] * volts / (
            parameters['supply_voltage'] * parameters['wheel_radius']),
        'turn_ratio': 0.5 * base['turn_width'] / base['speed_gain'],
        'wheel_damping': settings.fit['slip_damping'] * parameters['wheel_damping'],
        'yaw_damping': settings.fit['slip_damping'] * parameters['yaw_damping']}
    effects = [*ADDED, *([Effect('speed_loop')] if loop else [])]
    dry, radii = (tuple(base[f'{name}_{side}'] for side in ('left', 'right'))
                  for name in ('dry', 'radius'))
    if abs(dry[0] - dry[1]) > settings.fit['one_sided'] * sum(dry):
        effects.append(Effect('coulomb_drivetrain', 'left' if dry[0] > dry[1] else 'right'))
        values['dry_torque'] = abs(dry[0] - dry[1])
    else:
        effects.append(Effect('coulomb_drivetrain', 'both'))
        values['dry_torque'] = 0.5 * sum(dry)
    if abs(radii[1] / radii[0] - 1.0) > settings.fit['radii_differ']:
        effects.append(Effect('wheel_radius_mismatch', 'right'))
        values |= {'wheel_radius': radii[0], 'radius_change': radii[1] / radii[0] - 1.0}
    if base['current_limit'] < settings.fit['current_shows']:
        effects.append(Effect('current_limit'))
        values['current_limit'] = base['current_limit']
    if max(abs(base['slope_x']), abs(base['slope_y'])) > settings.fit['slope_shows']:
        effects.append(Effect('slope'))
        values |= {name: -base['mass'] * base[name] for name in ('slope_x', 'slope_y')}
    return _with(nominal, effects, values)


def having(model: ModelFile, changed: Mapping[str, float], settings: Settings) -> ModelFile:
    """Return a model with what the robot did not have before, by parameters of the base."""
    brought = {name: settings.runs_as[name] for name in changed if name in settings.runs_as}
    return _with(model, [Effect(effect, side) for effect, _, side in brought.values()],
                 {number: changed[name] for name, (_, number, _) in brought.items()})


def _with(model: ModelFile, effects: Sequence[Effect], values: Mapping[str, float]) -> ModelFile:
    # Effects that the model has already keep theirs, with these values.
    structure, parameters = model.structure, model.parameters
    entries: list[Parameter] = []
    for effect in effects:
        if any(there.id == effect.id for there in structure.effects):
            continue
        structure = structure.with_effect(effect)
        entries.extend(p.parameter() for p in structure.effects[-1].parameters())
    known = parameters.with_entries(*entries)
    inside = {name: float(np.clip(value, known.entry(name).lower, known.entry(name).upper))
              for name, value in values.items() if name in known}
    return ModelFile(structure, known.replacing(inside), model.about)


def carried(model: ModelFile, before: ModelFile, fit_before: ModelFile) -> ModelFile:
    """
    Return a model with what a fit changed in another one, as factors.

    Parameters
    ----------
    model, before : ModelFile
        By :func:`started`, after and before.
    fit_before : ModelFile
        The latter, fitted.

    Returns
    -------
    ModelFile

    """
    values = {}
    for name in FITTED:
        if name in model.parameters and name in before.parameters:
            entry = model.parameters.entry(name)
            factor = fit_before.parameters[name] / max(before.parameters[name], 1e-9)
            values[name] = float(np.clip(entry.value * factor, entry.lower, entry.upper))
    return ModelFile(model.structure, model.parameters.replacing(values), model.about)


def _residual(structure: Structure, parameters: Parameters, segments: Sequence[Segment],
              scale: Mapping[str, float]) -> FloatArray:
    plant = compile_model(structure).at(parameters)
    parts = []
    for segment in segments:
        prediction = replay(plant, segment)
        for name, series in measured_channels(segment).items():
            if name not in scale:
                continue
            error = predicted_at(prediction, name, series.times) - series.values[:, 0]
            parts.append(np.nan_to_num(error) / scale[name])
    return np.concatenate(parts)


def fitted(options: Sequence[ModelFile], segments: Sequence[Segment], evaluations: int,
           about: str) -> ModelFile:
    """
    Fit dampings, grip and the ratios of the command to segments.

    Parameters
    ----------
    options : sequence of ModelFile
        Where the fit may begin; it does where the segments are met best.
    segments : sequence of Segment
        Measured stretches, with their commands.
    evaluations : int
        Steps at most.
    about : str
        Of the model that is returned.

    Returns
    -------
    ModelFile
        The same numbers where the fit breaks down.

    """
    first = compile_model(options[0].structure).at(options[0].parameters)
    sums = [channel_errors(s, replay(first, s)) for s in segments]
    scale = {name: max(float(np.sqrt(sum(one[name].total for one in sums if name in one) / max(
        sum(one[name].count for one in sums if name in one), 1))), 1e-3)
        for name in _RATES if any(name in one for one in sums)}

    def bounded(error: FloatArray) -> FloatArray:
        return np.where(np.isfinite(error), np.clip(error, -1e3, 1e3), 1e3)

    def begun(option: ModelFile) -> float:
        error = bounded(_residual(option.structure, option.parameters, segments, scale))
        return float(np.sum(np.sqrt(1.0 + error ** 2)))
    model = min(options, key=begun) if len(options) > 1 else options[0]
    entries = [model.parameters.entry(name) for name in FITTED if name in model.parameters]

    def at(logs: FloatArray) -> Parameters:
        return model.parameters.replacing({
            e.name: float(np.clip(np.exp(x), e.lower, e.upper))
            for e, x in zip(entries, logs, strict=True)})

    def error(logs: FloatArray) -> FloatArray:
        return bounded(_residual(model.structure, at(logs), segments, scale))
    begin = np.log([max(e.value, 1e-3) for e in entries])
    lower = np.log([max(e.lower, 1e-6) for e in entries]) - 1e-9
    upper = np.log([e.upper for e in entries]) + 1e-9
    try:
        solved = least_squares(error, begin, bounds=(lower, upper), diff_step=0.02,
                               x_scale=np.full(len(entries), 0.1), loss='soft_l1',
                               max_nfev=evaluations)
    except (LgHuskyError, ValueError, np.linalg.LinAlgError):
        return ModelFile(model.structure, model.parameters, about)
    return ModelFile(model.structure, at(solved.x), about)
