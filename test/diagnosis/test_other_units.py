# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
No sensor knows units of mass and voltage.

A robot of thirty times the mass, inertia and friction at twice the voltages moves like the one
that it is made of. So the answer has to be the same, with its numbers in proportion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import chain

from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.diagnose import Case, diagnose
from lg_husky_sim.husky.model_file import load_model, ModelFile
from lg_husky_sim.husky.robot_size import RobotSize
from lg_husky_sim.recording import Recording
import pytest

LARGE = RobotSize(mass=30.0, voltage=2.0)


def enlarged() -> ModelFile:
    """Return the nominal robot in other units of mass and voltage."""
    model = load_model()
    return replace(model, parameters=model.parameters.with_entries(*(
        replace(entry, value=times * entry.value, lower=times * entry.lower,
                upper=times * entry.upper)
        for entry in model.parameters.entries for times in (LARGE.factor(entry.unit),))))


@pytest.mark.parametrize('part', ['drivetrain', 'electrical', 'nothing'])
def test_the_answer_depends_on_no_unit_of_mass_or_voltage(
        part: str, drive: Callable[..., Recording], diagnosed: Callable[[str], Case],
        short: float) -> None:
    usual = diagnosed(part).diagnosis
    recordings = [drive('ahead', part, 1, share=short),
                  drive('back', part, 2, backwards=True, share=short)]
    large = diagnose(recordings, enlarged(), lambda text, share: None).diagnosis
    assert large.verdict is usual.verdict
    assert [(f.effect, f.side) for f in large.findings] == [
        (f.effect, f.side) for f in usual.findings]
    for here, there in zip(large.findings, usual.findings, strict=True):
        assert here.held_out_gain == pytest.approx(there.held_out_gain, rel=0.001, abs=0.01)
        for one, other in zip(here.parameters, there.parameters, strict=True):
            assert one.value == pytest.approx(LARGE.factor(one.unit) * other.value, rel=0.001)


def test_the_base_of_a_comparison_is_in_proportion() -> None:
    """What is estimated as a logarithm differs by as much of it."""
    usual = settings()
    large = usual.of(LARGE)
    assert usual.of(RobotSize()) == usual
    for here, there in zip(large.quantities, usual.quantities, strict=True):
        factor = LARGE.factor(there.unit)
        assert (here.lower, here.upper) == (factor * there.lower, factor * there.upper)
        assert here.change == (1.0 if there.logarithmic else factor) * there.change
    names = {q.name: q for q in usual.quantities}
    for one, other in zip(chain(*large.starts), chain(*usual.starts), strict=True):
        for name, value in other.items():
            assert one[name] == value * (1.0 if names[name].logarithmic
                                         else LARGE.factor(names[name].unit))
