# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What an effect does to the model stands in one place."""

from __future__ import annotations

import ast
from pathlib import Path

from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
import lg_husky_sim.husky
from lg_husky_sim.husky.edits import edits
from lg_husky_sim.husky.effects import catalogue, descriptions
from lg_husky_sim.husky.model import Structure


def test_each_entry_of_the_catalogue_has_one_edit_and_each_edit_an_entry() -> None:
    assert set(edits()) == {*catalogue(), *descriptions()}


def test_only_its_own_module_names_an_effect() -> None:
    """The model's code says what an effect does in one place: the module that has its edit."""
    folder = Path(lg_husky_sim.husky.__file__).parent
    places: dict[str, set[str]] = {name: set() for name in catalogue()}
    for path in folder.rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Constant) and node.value in places:
                places[str(node.value)].add(path.relative_to(folder).as_posix())
    for name, found in places.items():
        numbers = {p.name for p in catalogue()[name].parameters}
        # An effect that is one number of the command or the sensors shares its name with it.
        allowed = 1 if name not in numbers else 3
        assert len([one for one in found if one.startswith('edits/')]) == 1, (name, found)
        assert len(found) <= allowed, (name, found)


#: Files of the package that name effects all the same, and why.
MAY_NAME = {
    'proof': 'the blind trial has the catalogue in equations of its own, on purpose',
    'diagnosis/before_after/runnable.py': 'writes the base of a comparison as a model of effects',
    'diagnosis/before_after/conclusion.py': 'a factor that turns negative is another effect',
    'diagnosis/conclusion.py': 'the sign of one number says to which side it pulls',
    'diagnosis/wording.py': 'a stream is no side, and stands in the sentence as its subject',
}


def test_no_other_package_names_an_effect() -> None:
    """What is so of one effect stands in ``config/effects.yaml``, or beside its reason above."""
    folder = Path(lg_husky_sim.__file__).parent
    # An effect that is one number shares its name with it, which is no name of the effect.
    names = {name for name, kind in catalogue().items()
             if name not in {p.name for p in kind.parameters}}
    found: dict[str, set[str]] = {}
    for path in folder.rglob('*.py'):
        place = path.relative_to(folder).as_posix()
        if place.startswith('husky/'):      # see above
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and (
                    node.value.partition(':')[0] in names):
                found.setdefault('proof' if place.startswith('proof/') else place, set()).add(
                    node.value)
    assert not found.keys() - MAY_NAME.keys(), found
    assert not MAY_NAME.keys() - found.keys(), 'no longer needed'


def test_a_diagnosis_tries_what_the_catalogue_says() -> None:
    """All but what has too much in common with other entries, or with physics outside of it."""
    tried = {one.effect.id for one in hypotheses(Structure())}
    assert tried == {name for name, kind in catalogue().items() if kind.tried}
    assert set(catalogue()) - tried == {'static_friction', 'tyre_windup'}
