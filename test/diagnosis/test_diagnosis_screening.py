# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a first look promises, and what no name explains."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of, hypotheses
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection.rounds import attempt
from lg_husky_sim.diagnosis.selection.screening import look, problems_of, Projection
from lg_husky_sim.diagnosis.selection.tried import numbers_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest
from scipy.stats import norm

#: Weaker than every size from which a look begins.
MILD = {'slew_forward': 14.0, 'slew_yaw': 28.0}


@pytest.fixture(scope='module')
def base(record: Callable[..., Recording], steps: Sequence[tuple[float, float, float]]
         ) -> Iterator[tuple[Evidence, Fit]]:
    """Return the evidence of a drive with a mild limit of acceleration, and the fit without."""
    model, effect = load_model(), Effect('command_slew', shape='both')
    plant = compile_model(model.structure.with_effect(effect)).at(
        model.parameters.with_entries(*entries_of(effect, MILD)))
    drives = drives_of([record('ahead', plant, steps, 3)])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        yield evidence, evidence.fit(start, rounds=3)


def test_looks_go_on_below_the_weakest_size(base: tuple[Evidence, Fit]) -> None:
    evidence, fit = base
    pool = hypotheses(fit.point.structure)
    slews = [h for h in pool if h.effect.id == 'command_slew']
    weakest = max(p.starts[-1] for h in slews for p in h.free if p.name == 'slew_forward')
    assert weakest < MILD['slew_forward']
    found = look(evidence, fit, pool)
    # It is a drive ahead: whether the yaw rate is limited, too, does not show.
    assert found[0].hypothesis.label in ('command_slew:both', 'command_slew:forward')
    assert found[0].gain > 20.0


def test_looks_end_where_an_effect_is_too_little_to_count(
        base: tuple[Evidence, Fit], monkeypatch: pytest.MonkeyPatch) -> None:
    evidence, fit = base
    sizes: list[float] = []
    predict = Evidence.predict

    def noted(self: Evidence, point: Point) -> tuple[FloatArray, ...]:
        sizes.append(point.values['slew_yaw'])
        return predict(self, point)
    monkeypatch.setattr(Evidence, 'predict', noted)
    one = next(h for h in hypotheses(fit.point.structure) if h.label == 'command_slew:yaw')
    look(evidence, fit, [one])
    (parameter,) = one.free
    assert sum(size >= parameter.none_from for size in sizes) == 1


def test_a_number_at_its_bound_takes_nothing_from_a_look(
        record: Callable[..., Recording], steps: Sequence[tuple[float, float, float]]) -> None:
    """What a gyro's factor may be without being called wrong is not all of this one."""
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    whole = record('ahead', plant, steps, 3)
    imu = whole.streams['imu']
    scaled = imu.values * np.array([0.95 if name == 'yaw_rate' else 1.0 for name in imu.names])
    drives = drives_of([replace(whole, streams={**whole.streams, 'imu': TimeSeries(
        imu.times, scaled, imu.names)})])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    gain = next(k for k, u in enumerate(start.unknowns) if u.name == 'gyro_gain')
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        fit = evidence.fit(start)
        assert fit.point.places[gain] == start.unknowns[gain].lower
    left = np.sum(Projection(fit).apart(fit.jacobian) ** 2, axis=0) / np.sum(
        fit.jacobian ** 2, axis=0)
    assert left[gain] > 0.9
    # Of a free one only what its prior weighs beside the data.
    free = next(k for k, u in enumerate(start.unknowns) if u.name == 'turn_ratio')
    assert left[free] < 1e-3


def test_a_limit_that_acts_for_moments_is_seen(record: Callable[..., Recording]) -> None:
    # Its errors are many times the noise and weigh next to nothing; the next stronger size from
    # which a look begins clips nearly all the time.
    model, effect = load_model(), Effect('voltage_saturation')
    volts = model.parameters['command_gain'] * model.parameters['supply_voltage']
    steps = [(2.0, 0.0, 0.0), *((duration, voltage / volts, yaw) for duration, voltage, yaw in (
        (2.0, 8.0, 0.0), (2.0, 20.9, 0.0), (2.0, 13.0, 0.3), (2.0, -20.9, 0.0), (0.6, -22.4, 0.0),
        (2.0, -13.0, -0.5), (2.0, 20.9, 0.0), (0.4, 22.4, 0.0), (2.0, 17.0, 0.1),
        (2.0, -20.9, 0.0), (2.0, 5.0, -0.4)))]
    plant = compile_model(model.structure.with_effect(effect)).at(
        model.parameters.with_entries(*entries_of(effect, {'clip_voltage': 21.4})))
    drives = drives_of([record('clipped', plant, steps, 3)])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['clipped'], start, first_guess(drives), pool)
        fit = evidence.fit(start, rounds=3)
        found = look(evidence, fit, [h for h in hypotheses(
            fit.point.structure) if h.effect == effect])
        assert found[0].gain > 20.0
        fitted = attempt(evidence, fit, found[0].hypothesis, [(fit.point, found[0].numbers)])
    assert fitted is not None
    assert numbers_of(fitted)['clip_voltage'] == pytest.approx(21.4, abs=0.1)


def test_products_are_those_of_columns_without_what_the_base_explains(
        base: tuple[Evidence, Fit]) -> None:
    evidence, fit = base
    columns = np.random.default_rng(4).standard_normal((evidence.count, 6))
    columns[:, 0] += 3.0 * fit.jacobian[:, 0]
    normal, slope = Projection(fit).problem(columns)
    wanted, pulled = _least_squares(fit, columns)
    np.testing.assert_allclose(normal, wanted, rtol=1e-8, atol=1e-8 * np.max(wanted))
    np.testing.assert_allclose(slope, pulled, rtol=1e-7, atol=1e-8 * np.max(np.abs(pulled)))
    first = evidence.drives[0].measured.size // 3
    halves = [Projection(fit).products(columns[some].reshape(-1, 2, 3), top)
              for some, top in ((slice(first), 0), (slice(first, None), first))]
    explained, with_target, with_each_other = (a + b for a, b in zip(*halves, strict=True))
    normals, slopes = problems_of((explained, with_target, with_each_other))
    for place in range(3):
        own = [place, place + 3]
        np.testing.assert_allclose(normals[place], normal[np.ix_(own, own)], rtol=1e-9)
        np.testing.assert_allclose(slopes[place], slope[own], rtol=1e-9)


def _least_squares(fit: Fit, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    # The base and its priors taken out by numpy's least squares.
    nu = setting('student')
    root = np.sqrt((nu + 1.0) / (nu + fit.whitened ** 2))[:, None]
    base = np.vstack([root * fit.jacobian, np.diag(fit.point.weights)])
    padded = np.vstack([root * columns, np.zeros((base.shape[1], columns.shape[1]))])
    target = np.concatenate([root[:, 0] * fit.whitened, -fit.point.prior_residuals])
    left = padded - base @ np.linalg.lstsq(base, padded, rcond=None)[0]
    return left.T @ left, left.T @ target


def test_gusts_at_scattered_times_are_unknown(
        record: Callable[..., Recording], steps: Sequence[tuple[float, float, float]]) -> None:
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    long = [*steps, *steps]
    recordings = [gusty(record('ahead', plant, long, 1), (4.3, 11.8, 22.9, 31.5)),
                  gusty(record('back', plant, long[::-1], 2), (3.2, 13.7, 20.1, 34.4))]
    found = diagnose(recordings, model, lambda text, share: None).diagnosis
    assert found.verdict is Verdict.UNKNOWN
    assert found.findings[0].subsystem == 'rotation'
    assert 'scattered times' in found.findings[0].statement


def gusty(recording: Recording, moments: Sequence[float]) -> Recording:
    """Return a recording of a robot that gusts turned, now to the left and now to the right."""
    gyro, pose = recording.streams['imu'], recording.streams['pose']
    heading = np.zeros(pose.times.size)
    rates = np.zeros(gyro.times.size)
    for place, moment in enumerate(moments):
        gust = norm(loc=moment, scale=0.3)
        size = 0.12 * (-1.0) ** place
        rates += size * gust.pdf(gyro.times - gyro.times[0])
        heading += size * gust.cdf(pose.times - pose.times[0])
    values = np.array(pose.values)
    x, y, yaw = (pose.names.index(name) for name in ('x', 'y', 'heading'))
    step = np.diff(values[:, x] + 1j * values[:, y]) * np.exp(1j * heading[1:])
    path = np.concatenate([[0.0], np.cumsum(step)]) + values[0, x] + 1j * values[0, y]
    values[:, x], values[:, y], values[:, yaw] = path.real, path.imag, values[:, yaw] + heading
    turned = np.array(gyro.values)
    turned[:, gyro.names.index('yaw_rate')] += rates
    return replace(recording, streams={
        **recording.streams, 'imu': TimeSeries(gyro.times, turned, gyro.names),
        'pose': TimeSeries(pose.times, values, pose.names)})
