# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Efforts that repeat: with the angle of the wheels, the distance driven, the voltage.

Cogging, wheels out of round, waves of a floor, a driver with few levels of voltage: what acts is
an oscillation over some other quantity than time, too fast in it for a smooth function, and like
noise over time. With the scores s of an effort over time (:mod:`..evidence.adjoint`) and the
quantity q, its periodogram at a frequency f is::

    P(f) = |sum s(t) exp(2 pi i f q(t))|^2

Where only noise is left, P over its local level is exponentially distributed at each frequency,
whatever the spectrum. The sum over n drives, each with a phase of its own, over n times a level of
m neighbours follows an F distribution with 2 n and 2 m n degrees of freedom: the test for spectral
lines (Thomson 1982). The smallest probability p of F independent frequencies counts as a log
evidence of ``-ln(p F)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.evidence.adjoint import scores
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.observation import Motion, probe_times
from lg_husky_sim.diagnosis.evidence.whitener import respond
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import BALANCES, Effort
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy.special import fdtrc

#: Balance, and the quantity over which an effort there may repeat.
LOOKS = (('force', 'distance'), ('torque_left', 'angle'), ('torque_right', 'angle'),
         ('torque_left', 'voltage'), ('torque_right', 'voltage'))
#: The largest frequency over each.
FINEST = {'distance': 'line_finest_distance', 'angle': 'line_finest_angle',
          'voltage': 'line_finest_voltage'}
#: Samples of a periodogram for each of its independent frequencies.
DENSITY = 2


@dataclass(frozen=True, eq=False)
class Line(Effort):
    """
    An effort that repeats.

    Parameters
    ----------
    period : float
        Of the quantity [rad of the wheels' angle, m, V].

    """

    period: float


def _quantity(motion: Motion, balance: str, name: str) -> FloatArray:
    side = BALANCES[balance][2]
    return motion.column(name if side == 'none' else f'{name}_{side}', 'probe')


def _units(fit: Fit) -> dict[str, float]:
    # Sizes over which no robot differs from another: a radian of the wheels, the supply.
    numbers = fit.point.numbers
    return {'distance': numbers['wheel_radius'], 'angle': 1.0,
            'voltage': numbers['supply_voltage']}


def periodogram(values: FloatArray, quantity: FloatArray, step: float, count: int) -> FloatArray:
    """
    Return the periodogram of values over a quantity.

    Parameters
    ----------
    values, quantity : numpy.ndarray, shape (n,)
        At each sample: what may repeat, and over what (a time, a way or an angle).
    step : float
        Of the frequency [cycles per unit of the quantity].
    count : int
        Frequencies: one step, two, and so on.

    Returns
    -------
    numpy.ndarray, shape (count,)

    """
    turn = np.exp(2j * np.pi * step * quantity)
    now = np.ones_like(turn)
    found = np.empty(count)
    for place in range(count):
        now *= turn
        found[place] = abs(values @ now) ** 2
    return found


def chance_of_lines(spectra: Sequence[FloatArray]) -> FloatArray:
    """
    Return how likely the height of each frequency is where there is only noise.

    Parameters
    ----------
    spectra : sequence of numpy.ndarray, shape (n,)
        Periodograms of drives, with :data:`DENSITY` samples for each independent frequency.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Natural logarithm of the probability.

    """
    reach, gap = (DENSITY * int(setting(name)) for name in ('line_reach', 'line_gap'))
    total = np.zeros(spectra[0].size)
    for spectrum in spectra:
        total += spectrum / level(spectrum, reach, gap)
    # A mean of n logarithms of exponential variables tells as much as 6/pi^2 n variables do.
    neighbours = 2.0 * (reach - gap) / DENSITY * 6.0 / math.pi ** 2
    number = len(spectra)
    with np.errstate(divide='ignore'):
        return np.asarray(np.log(fdtrc(2 * number, 2.0 * neighbours * number, total / number)))


def level(spectrum: FloatArray, reach: int, gap: int) -> FloatArray:
    """
    Return the mean of a noise spectrum at each of its frequencies, by its neighbours.

    Parameters
    ----------
    spectrum : numpy.ndarray, shape (n,)
        At one step of frequency, two, and so on.
    reach, gap : int
        Samples on either side that count, and those next to each that do not.

    Returns
    -------
    numpy.ndarray, shape (n,)
        ``exp(a + b log f + gamma)`` at f, with the least-squares line a + b log f through the
        logarithms of the neighbours and Euler's constant gamma, by which the mean logarithm of an
        exponential variable is below that of its mean. A line among them hardly moves it.

    """
    logs = np.log(np.maximum(spectrum, 1e-300))
    x = np.log(np.arange(1.0, spectrum.size + 1.0))
    place = np.arange(spectrum.size)

    def around(values: FloatArray, width: int) -> FloatArray:
        total = np.concatenate([[0.0], np.cumsum(values)])
        found: FloatArray = (total[np.minimum(place + width + 1, spectrum.size)]
                             - total[np.maximum(place - width, 0)])
        return found
    n, sx, sy, sxx, sxy = (around(values, reach) - around(values, gap) for values in (
        np.ones(spectrum.size), x, logs, x * x, x * logs))
    slope = (n * sxy - sx * sy) / np.maximum(n * sxx - sx * sx, 1e-12)
    return np.asarray(np.exp((sy - slope * sx) / n + slope * x + np.euler_gamma),
                      dtype=np.float64)


def lines(evidence: Evidence, fit: Fit) -> tuple[Line, ...]:
    """
    Look for efforts that repeat in what a fit leaves.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        What it leaves of the recordings is searched.

    Returns
    -------
    tuple of Line
        The best period of each of :data:`LOOKS` that drives are long enough for, where it has any
        evidence; largest first.

    """
    projection = Projection(fit)
    motions, units = evidence.motions(fit.point, True), _units(fit)
    weights = np.split(projection.target, np.cumsum([
        w.frame.times.size for w in evidence.whiteners])[:-1])
    pushes = [scores(w, own) for w, own in zip(evidence.whiteners, weights, strict=True)]

    def spectra(balance: str, name: str) -> tuple[list[FloatArray], float]:
        quantities = [_quantity(motion, balance, name) / units[name] for motion in motions]
        spans = [float(np.ptp(q)) for q in quantities]
        if max(spans) <= 0.0:
            return [], 1.0
        step = 1.0 / (DENSITY * max(spans))
        count = int(setting(FINEST[name]) / step)
        if count < 2 * DENSITY * int(setting('line_reach')):
            return [], step
        row = BALANCES[balance][0]
        return [periodogram(push[:, row], q, step, count) for push, q, span in zip(
            pushes, quantities, spans, strict=True)
            if span > setting('line_span') * max(spans)], step

    found = []
    for balance, name in LOOKS:
        parts, step = spectra(balance, name)
        if not parts:
            continue
        logs = chance_of_lines(parts)
        edge = DENSITY * int(setting('line_least'))
        logs[:edge] = logs[-edge:] = 0.0
        place = int(np.argmin(logs))
        gain = -float(logs[place]) - math.log(logs.size / DENSITY)
        if gain > 0.0:
            found.append(_line(evidence, projection, motions, balance, name,
                               units[name] / (step * (place + 1)), gain))
    return tuple(sorted(found, key=lambda one: -one.evidence))


def _line(evidence: Evidence, projection: Projection, motions: Sequence[Motion],
          balance: str, name: str, period: float, gain: float) -> Line:
    # What it explains, and how large it is: by the responses to it, a phase for each drive.
    columns = np.zeros((evidence.count, 2 * len(motions)))
    top = 0
    for number, (motion, whitener) in enumerate(zip(motions, evidence.whiteners, strict=True)):
        frame, drive = whitener.frame, whitener.frame.drive
        phase = 2.0 * np.pi / period * _quantity(motion, balance, name)
        pushed = np.zeros((phase.size, 4, 2))
        pushed[:, BALANCES[balance][0]] = np.column_stack([np.cos(phase), np.sin(phase)])
        out = np.empty((frame.times.size, 2))
        respond(pushed, probe_times(drive), frame.times, drive.channels, frame.order,
                frame.cosine, frame.sine, whitener.model, setting('longest_step'), out)
        columns[top:top + len(out), 2 * number:2 * number + 2] = whitener.apply(out)
        top += frame.times.size
    normal, slope = projection.problem(columns)
    values = np.asarray(np.linalg.lstsq(normal, slope, rcond=1e-9)[0], dtype=np.float64)
    return Line(balance, name, gain, 0.5 * float(values @ slope), values,
                np.zeros(0), float(np.max(np.hypot(values[::2], values[1::2]))), period)
