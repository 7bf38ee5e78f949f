# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Read lists of names and effects as they are given on the command line."""

from __future__ import annotations

from collections.abc import Sequence

from lg_husky_sim.husky.effects import check_distinct, Effect
from lg_husky_sim.husky.model_file import ModelFile


def names_in(texts: Sequence[str]) -> tuple[str, ...]:
    """Return the names in texts such as ``a,b``, in order and once each."""
    found = (name.strip() for text in texts for name in text.split(','))
    return tuple(dict.fromkeys(name for name in found if name))


def effect_in(text: str) -> Effect:
    """
    Return an effect given as ``id``, ``id:side`` or ``id:shape`` or ``id:side:shape``.

    Raises
    ------
    ParameterError
        If the id, side or shape is unknown.

    """
    name, *rest = text.split(':', 2)
    kind = Effect(name).kind
    if len(rest) == 1:
        formed = rest[0] in kind.shapes or (kind.sides == ('none',) and any(kind.shapes))
        return Effect(name, '', rest[0]) if formed else Effect(name, rest[0])
    side, shape = rest if rest else ('', '')
    return Effect(name, side, shape)


def with_effects(model: ModelFile, texts: Sequence[str]) -> ModelFile:
    """
    Return a model with effects added, at the catalogue's first sizes.

    Parameters
    ----------
    model : ModelFile
        That effects are added to.
    texts : sequence of str
        As :func:`effect_in` reads them; those that are in the model already are passed over.

    Raises
    ------
    ParameterError
        If one is unknown or does not fit, or two share a parameter.

    """
    structure, parameters = model.in_proportion().structure, model.parameters
    for name in names_in(texts):
        effect = effect_in(name)
        if effect in structure.effects:
            continue
        structure = structure.with_effect(effect)
        parameters = parameters.with_entries(*(
            p.parameter() for p in structure.effects[-1].parameters()
            if p.name not in parameters))
    check_distinct(structure.effects)
    return ModelFile(structure, parameters, model.about)
