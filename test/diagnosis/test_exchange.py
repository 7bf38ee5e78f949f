# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects give their places to likelier ones beside the others, as the log is read in the end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.selection.exchange import exchanged
from lg_husky_sim.diagnosis.selection.rounds import Round
from lg_husky_sim.diagnosis.selection.tried import Tried
from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


@pytest.fixture
def counting(drive: Callable[..., Recording]) -> Iterator[tuple[Evidence, Point]]:
    """Evidence of a robot whose left encoder counts 4 % too much, and its model without that."""
    recording, model = drive('ahead', 'nothing', 1), load_model()
    wheels = recording.streams['wheels']
    more = np.array([1.04 if 'left' in name else 1.0 for name in wheels.names])
    wrong = replace(recording, streams={**recording.streams, 'wheels': replace(
        wheels, values=wheels.values * more)})
    drives = drives_of([wrong])
    plain = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        yield evidence_of(drives, ['ahead'], plain, first_guess(drives), pool), plain


@pytest.mark.parametrize('adopted', ['left', 'right'])
def test_an_encoder_that_counts_too_much_is_that_and_not_the_other_one(
        adopted: str, counting: tuple[Evidence, Point]) -> None:
    """With smaller wheels, the other side's counting too little is all but the same."""
    evidence, plain = counting
    sides = {h.effect.side: h for h in hypotheses(plain.structure)
             if h.effect.id == 'encoder_scale'}
    first = {side: evidence.fit(one.point(plain, {
        'encoder_factor': 1.04 if side == 'left' else 1.0 / 1.04}))
        for side, one in sides.items()}
    base = evidence.fit(plain)
    tried = {side: Tried(one, first[side], base.cost - first[side].cost, evidence.count)
             for side, one in sides.items()}
    other = 'right' if adopted == 'left' else 'left'
    for seen in ((tried[adopted], tried[other]), (tried[adopted],)):
        fit, rounds, found = exchanged(
            evidence, plain, first[adopted], [Round(evidence, base, seen, True, 1e-9)],
            [sides[adopted]])
        assert [one.effect.side for one in found] == ['left']
        assert fit.cost <= min(one.cost for one in first.values()) + 0.1
        assert fit.point.values['encoder_factor'] == pytest.approx(1.04, abs=0.005)
        assert rounds[0].tried[0].hypothesis == sides['left']
        assert rounds[0].adopted


@pytest.mark.parametrize('seen', [False, True])
def test_an_effect_gives_its_place_to_a_likelier_rival_of_its_round(
        seen: bool, counting: tuple[Evidence, Point]) -> None:
    evidence, plain = counting
    pool = {h.label: h for h in hypotheses(plain.structure)}
    radius, encoder = pool['wheel_radius_mismatch:left:soft'], pool['encoder_scale:left']
    base = evidence.fit(plain)
    first = evidence.fit(radius.point(plain, radius.starts[0]))
    rival = evidence.fit(encoder.point(plain, encoder.starts[0]), rounds=1)
    # The rival was fitted badly in its round.
    tried = (Tried(radius, first, base.cost - first.cost, evidence.count),
             Tried(encoder, rival, 20.0, evidence.count))
    fit, rounds, found = exchanged(
        evidence, plain, first,
        [Round(evidence, base, tried if seen else tried[:1], True, 1e-9)], [radius])
    assert [one.effect.id for one in found] == [(encoder if seen else radius).effect.id]
    assert rounds[0].tried[0].hypothesis == found[0]
    if seen:
        assert set(rounds[0].tried) == set(tried)
        assert fit.cost < first.cost
        assert fit.point.values['encoder_factor'] == pytest.approx(1.04, abs=0.005)


def test_a_rival_does_not_move_the_onset_of_another_effect(
        counting: tuple[Evidence, Point]) -> None:
    """A model has one onset: the rival would have moved the friction's from 8 s to 3 s."""
    evidence, plain = counting
    pool = {h.label: h for h in hypotheses(plain.structure)}
    scrub = pool['yaw_scrub_coulomb']
    friction = pool['coulomb_drivetrain:left'].at(Onset(OnsetKind.TIME, 8.0, 'ahead'))
    encoder = pool['encoder_scale:left'].at(Onset(OnsetKind.TIME, 3.0, 'ahead'))
    base = evidence.fit(plain)
    with_scrub, with_encoder = (evidence.fit(one.point(plain, one.starts[0]), rounds=2)
                                for one in (scrub, encoder))
    both = evidence.fit(friction.point(with_scrub.point, friction.starts[0]), rounds=2)
    rounds = [
        Round(evidence, base, tuple(Tried(one, fit, base.cost - fit.cost, evidence.count)
                                    for one, fit in ((scrub, with_scrub),
                                                     (encoder, with_encoder))), True, 1e-9),
        Round(evidence, with_scrub, (Tried(friction, both, 1.0, evidence.count),), True, 1e-9)]
    fit, _, found = exchanged(evidence, plain, both, rounds, [scrub, friction])
    assert fit.point.structure.onset == friction.onset
    assert {one.onset for one in found} <= {None, friction.onset}


def test_an_effect_that_acts_always_begins_nowhere(counting: tuple[Evidence, Point]) -> None:
    """It was adopted with an onset before others were found."""
    evidence, plain = counting
    pool = {h.label: h for h in hypotheses(plain.structure)}
    late = pool['encoder_scale:left'].at(Onset(OnsetKind.TIME, 8.0, 'ahead'))
    base = evidence.fit(plain)
    final = evidence.fit(late.point(plain, late.starts[0]))
    tried = Tried(late, final, base.cost - final.cost, evidence.count)
    fit, rounds, found = exchanged(
        evidence, plain, final, [Round(evidence, base, (tried,), True, 1e-9)], [late])
    assert [(one.effect.id, one.onset) for one in found] == [('encoder_scale', None)]
    assert fit.point.structure.onset is None
    assert fit.cost < final.cost
    assert rounds[0].tried[0].hypothesis == found[0]


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
        assert exchanged(evidence, plain, final, rounds, [one]) == (final, rounds, [one])
