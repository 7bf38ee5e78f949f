# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The side of an effect follows the log as it is read in the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.selection.rounds import Round, Tried
from lg_husky_sim.diagnosis.selection.sides import on_likelier_sides
from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


@pytest.mark.parametrize('adopted', ['left', 'right'])
def test_an_encoder_that_counts_too_much_is_that_and_not_the_other_one(
        adopted: str, drive: Callable[..., Recording]) -> None:
    """With smaller wheels, the other side's counting too little is all but the same."""
    recording, model = drive('ahead', 'nothing', 1), load_model()
    wheels = recording.streams['wheels']
    more = np.array([1.04 if 'left' in name else 1.0 for name in wheels.names])
    wrong = replace(recording, streams={**recording.streams, 'wheels': replace(
        wheels, values=wheels.values * more)})
    drives = drives_of([wrong])
    plain = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    sides = {h.effect.side: h for h in hypotheses(plain.structure)
             if h.effect.id == 'encoder_scale'}
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], plain, first_guess(drives), pool)
        first = {side: evidence.fit(one.point(plain, {
            'encoder_factor': 1.04 if side == 'left' else 1.0 / 1.04}))
            for side, one in sides.items()}
        base = evidence.fit(plain)
        tried = {side: Tried(one, first[side], base.cost - first[side].cost, evidence.count)
                 for side, one in sides.items()}
        other = 'right' if adopted == 'left' else 'left'
        for seen in ((tried[adopted], tried[other]), (tried[adopted],)):
            fit, rounds, found = on_likelier_sides(
                evidence, plain, first[adopted], [Round(evidence, base, seen, True, 1e-9)],
                [sides[adopted]])
            assert [one.effect.side for one in found] == ['left']
            assert fit.cost <= min(one.cost for one in first.values()) + 0.1
            assert fit.point.values['encoder_factor'] == pytest.approx(1.04, abs=0.005)
            assert rounds[0].tried[0].hypothesis == sides['left']
            assert rounds[0].adopted


def test_a_side_stays_where_the_others_do_not_go_without_it(
        drive: Callable[..., Recording], monkeypatch: pytest.MonkeyPatch) -> None:
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    plain = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    one = next(h for h in hypotheses(plain.structure) if h.effect.id == 'encoder_scale')

    def runs_away(*_: object) -> None:
        raise ParameterError('it runs away')
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], plain, first_guess(drives), pool)
        final = evidence.fit(one.point(plain, one.starts[0]), rounds=1)
        rounds = [Round(evidence, final, (), True, 1e-9)]
        monkeypatch.setattr(Evidence, 'fit', runs_away)
        assert on_likelier_sides(evidence, plain, final, rounds, [one]) == (final, rounds, [one])
