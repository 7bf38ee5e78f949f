# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A further effect is not what the law of the one before is off by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of, hypotheses
from lg_husky_sim.diagnosis.selection import laws
from lg_husky_sim.diagnosis.selection.laws import Laws
from lg_husky_sim.diagnosis.selection.rounds import calibrated
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

BAND = Effect('driver_deadband', 'none', 'zone')


@pytest.mark.parametrize('exact', [False, True])
def test_what_a_law_is_off_by_is_no_further_effect(
        exact: bool, record: Callable[..., Recording],
        steps: Sequence[tuple[float, float, float]], monkeypatch: pytest.MonkeyPatch) -> None:
    """
    A dead band that acts more at high speeds than at low ones hides no effect that it is not.

    One of a sensor is exact: what looks like a part of its own is another effect.
    """
    model = load_model()
    effect, size = (Effect('gyro_scale'), {'gyro_factor': 1.1}) if exact else (
        BAND, {'dead_voltage': 1.5})
    plant = compile_model(model.structure.with_effect(BAND)).at(
        model.parameters.with_entries(*entries_of(BAND, {'dead_voltage': 1.5})))
    recording = record('ahead', plant, steps, 5)
    imu = recording.streams['imu']
    faster = replace(imu, values=imu.values * [1.1 if exact else 1.0, *(1.0,) * (
        imu.values.shape[1] - 1)])
    drives = drives_of([replace(recording, streams={**recording.streams, 'imu': faster})])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    found = next(h for h in hypotheses(model.structure) if h.effect == effect)
    bias = next(h for h in hypotheses(model.structure) if h.effect.id == 'gyro_bias')
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        evidence, base = calibrated(evidence, found.point(start, size), 1)
        without = evidence.residuals(evidence.predict(base.point.at(np.append(
            base.point.places[:-1], float(exact))))) - base.whitened
        times = evidence.whiteners[0].frame.times[evidence.whiteners[0].frame.order]
        rates = np.interp(times, drives[0].wheel_times, np.abs(drives[0].measured[
            :drives[0].wheel_times.size]))
        biased = base.whitened - evidence.residuals(evidence.predict(
            bias.point(base.point, {'gyro_bias': 0.002})))

        def part(change: np.ndarray, seen: np.ndarray) -> float:
            # Of what gains by a change, where the innovations have another one in them.
            there: Fit = replace(base, whitened=base.whitened + seen)
            other = replace(base, whitened=there.whitened - change)
            none, one = Laws(start, [found]).gains_left(
                evidence, there, [other, other], [0.0, 1.0])
            assert none == 0.0
            return one
        off = 0.1 * without * (rates / rates.max())
        assert part(biased, biased) > 0.9
        if exact:
            assert part(off, off) == 1.0
        else:
            assert part(off, off) < 0.2
            assert part(biased, biased + off) > 0.5
            # Whatever a law is off by is less than its change: what shows elsewhere is something
            # else, however large that is.
            sizes = np.abs(without)
            chance = np.random.default_rng(1).standard_normal(sizes.size)
            least, most = np.quantile(sizes, [0.2, 0.9])
            assert most > 10.0 * least
            loud, quiet = (np.where(where, chance, 0.0)
                           for where in (sizes > most, sizes < least))
            monkeypatch.setattr(laws, 'setting', lambda name: {
                'form_off': 2.0 / most, 'law_off': 0.0}.get(name, setting(name)))
            assert part(quiet, quiet) > 0.9
            assert part(loud, loud) < 0.5


@pytest.mark.parametrize(('names', 'sides'), [
    (['command_slew'], False), (['driver_deadband'], True),
    (['gyro_scale', 'command_slew'], False), (['command_slew', 'driver_deadband'], True)])
def test_what_a_command_does_depends_on_no_side(
        names: Sequence[str], sides: bool, drive: Callable[..., Recording],
        monkeypatch: pytest.MonkeyPatch) -> None:
    model = load_model()
    drives = drives_of([drive('ahead', 'nothing', 1)])
    start = point = beginning(model.structure, base_unknowns(model.parameters, drives),
                              model.parameters, Reading())
    found = []
    for name in names:
        found.append(next(h for h in hypotheses(point.structure) if h.effect.id == name))
        point = found[-1].point(point, found[-1].starts[0])
    asked: list[Sequence[str]] = []
    shapes = laws._shapes

    def noted(evidence: Evidence, base: Fit, which: Sequence[str]) -> FloatArray:
        asked.append(which)
        return shapes(evidence, base, which)
    monkeypatch.setattr(laws, '_shapes', noted)
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        base = evidence.fit(point, rounds=1)
        Laws(start, found).gains_left(evidence, base, [base], [1.0])
    assert [any(name.endswith('_left') for name in which) for which in asked] == [sides]


def test_what_begins_somewhere_may_act_always(
        drive: Callable[..., Recording], monkeypatch: pytest.MonkeyPatch) -> None:
    """What it would do elsewhere is no further effect, if laws are exact otherwise, too."""
    monkeypatch.setattr(laws, 'setting', lambda name: 0.0 if name in (
        'form_off', 'law_off') else setting(name))
    model = load_model()
    drives = drives_of([drive('ahead', 'nothing', 1)])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    always = next(h for h in hypotheses(model.structure) if h.effect == BAND)
    late = always.at(Onset(OnsetKind.TIME, 9.0, 'ahead'))
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        for found, most, least in ((late, 0.2, 0.0), (always, 1.0, 0.8)):
            base = evidence.fit(found.point(start, {'dead_voltage': 0.5}), rounds=0)
            base = replace(base, jacobian=evidence.fit(base.point, rounds=1).jacobian)
            change = evidence.residuals(evidence.predict(
                always.point(start, {'dead_voltage': 0.5}))) - evidence.residuals(
                    evidence.predict(late.point(start, {'dead_voltage': 0.5})))
            # Half of it is in the readings.
            there = replace(base, whitened=base.whitened + 0.5 * change)
            other = replace(base, whitened=base.whitened)
            part, = Laws(start, [found]).gains_left(evidence, there, [other], [1.0])
            assert least <= part <= most


def test_a_robot_that_runs_away_without_what_was_found_is_judged_all_the_same(
        drive: Callable[..., Recording], monkeypatch: pytest.MonkeyPatch) -> None:
    model = load_model()
    drives = drives_of([drive('ahead', 'nothing', 1)])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    found = next(h for h in hypotheses(model.structure) if h.effect == BAND)

    def runs_away(evidence: Evidence, point: Point) -> tuple[FloatArray, ...]:
        raise LgHuskyError('the simulation runs away')
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        base = evidence.fit(found.point(start, {'dead_voltage': 0.1}), rounds=0)
        monkeypatch.setattr(Evidence, 'predict', runs_away)
        assert Laws(start, [found]).gains_left(evidence, base, [base], [7.0]) == [7.0]
