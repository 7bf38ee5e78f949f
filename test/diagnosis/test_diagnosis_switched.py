# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects that begin late, from one simulation of what acts always."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.observation import observe
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.selection import onsets
from lg_husky_sim.diagnosis.selection.screening import Look, problems_of, Projection
from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


@pytest.mark.parametrize(('name', 'numbers'), [
    ('yaw_pull', {'pull_moment': 1.0}), ('slope', {'slope_x': 10.0, 'slope_y': 4.0}),
    ('gyro_scale', {'gyro_factor': 0.95}), ('encoder_scale', {'encoder_factor': 1.04})])
def test_whitening_a_switched_change_is_whitening_a_gated_simulation(
        name: str, numbers: dict[str, float], drive: Callable[..., Recording]) -> None:
    recording, model = drive('ahead', 'nothing', 1), load_model()
    if name == 'encoder_scale':
        # What it counts with the other factor does not move what it counted before.
        recording = replace(recording, streams={
            stream: series for stream, series in recording.streams.items() if stream != 'wheels'})
    drives = drives_of([recording])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    onset = Onset(OnsetKind.TIME, drives[0].start + 8.0, 'ahead')
    hypothesis = next(h for h in hypotheses(model.structure) if h.effect.id == name)
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        whitener, own = evidence.whiteners[0], drives[0]
        base, plain = evidence.motions(start, True)[0], evidence.predict(start)[0]
        gated = evidence.predict(hypothesis.at(onset).point(start, numbers))[0]
        always = hypothesis.point(start, numbers)
        motion = evidence.motions(always, True)[0]
    change = observe(motion, own, always.log) - plain
    times = whitener.frame.times[whitener.frame.order]
    on = (times >= onset.value).astype(np.uint8)[:, None]
    states = onsets._built_up(own, motion, base, change, whitener.frame)
    found = whitener.switched(change, states, on)[:, 0]
    truth = whitener.apply(gated - plain)
    assert np.linalg.norm(truth) > 3.0
    assert not np.any(found[times < onset.value])
    assert np.linalg.norm(found - truth) < 0.1 * np.linalg.norm(truth)
    assert float(found @ truth) > 0.99 * np.linalg.norm(found) * np.linalg.norm(truth)


def test_each_onset_has_the_products_that_it_would_have_alone(
        drive: Callable[..., Recording], monkeypatch: pytest.MonkeyPatch) -> None:
    """Nearly all onsets of one recording are alike in another one, and are whitened once there."""
    names = ['first', 'second']
    drives = drives_of([drive(name, 'nothing', k) for k, name in enumerate(names)])
    model = load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    hypothesis = next(h for h in hypotheses(model.structure) if h.effect.id == 'yaw_pull')
    with Threads(1) as pool:
        evidence = evidence_of(drives, names, start, first_guess(drives), pool)
        base = evidence.fit(start, rounds=1)
        projection, every = Projection(base), onsets.onsets_of(evidence)
        motions = evidence.motions(base.point, True)
        changes = onsets._changes(evidence, base, motions, hypothesis, hypothesis.trials()[0])
        assert changes is not None

        def patterns(some: list[Onset]) -> list[onsets._Patterns]:
            return [onsets._patterns(evidence, d, m, w.frame.times[w.frame.order], some)
                    for d, m, w in zip(drives, motions, evidence.whiteners, strict=True)]
        shared = patterns(every)
        assert all(one.different.shape[1] < len(every) for one in shared)
        normals, slopes = problems_of(onsets._products(projection, evidence, changes, shared))
        for k, onset in enumerate(every):
            columns = np.vstack([
                np.column_stack([w.switched(*of_number[d], alone.different)
                                 for of_number in changes])
                for d, (w, alone) in enumerate(zip(
                    evidence.whiteners, patterns([onset]), strict=True))])
            normal, slope = projection.problem(columns)
            np.testing.assert_allclose(normals[k], normal, rtol=1e-9, atol=1e-12)
            np.testing.assert_allclose(slopes[k], slope, rtol=1e-9, atol=1e-9)
        late = next(h for h in hypotheses(model.structure) if h.effect.id == 'command_latency')
        # A size that gains something always is taken on; one that gains nothing tells nothing.
        tiny = {'latency': 1e-4}
        free, poor, good = (onsets.onset_looks(evidence, base, [late], [
            Look(late, tiny, gain) for gain in gains]) for gains in ([], [0.1], [30.0]))
        assert free == poor
        assert free != good
        monkeypatch.setattr(onsets, 'onsets_of', lambda _: [])
        assert onsets.onset_looks(evidence, base, [hypothesis], []) == []
