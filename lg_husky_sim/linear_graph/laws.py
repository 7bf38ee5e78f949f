# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Named characteristics: laws of friction, drag and mixing with their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.expressions import parse, substituted


@dataclass(frozen=True)
class Law:
    """
    A law in arguments z1, z2, ... and parameters p1, p2, ...

    Parameters
    ----------
    expression : str
        The law.
    arguments, parameters : int
        How many it takes.
    about : str
        What it is, with its source.

    """

    expression: str
    arguments: int
    parameters: int
    about: str


LAWS: Mapping[str, Law] = {
    'proportional': Law('p1*z1', 1, 1, 'linear modulation by a gain p1'),
    'coulomb': Law('p1*tanh(z1/p2)', 1, 2,
                   'Coulomb friction of level p1, smoothed over the speed p2'),
    'viscous_coulomb': Law('p1*z1 + p2*tanh(z1/p3)', 1, 3,
                           'viscous p1 plus Coulomb p2 smoothed over p3'),
    'stribeck': Law('(p1 + (p2 - p1)*exp(-(z1/p3)**2))*tanh(z1/p4)', 1, 4,
                    'Coulomb p1, breakaway p2, Stribeck speed p3, smoothing p4'),
    'quadratic': Law('p1*z1*abs(z1)', 1, 1, 'turbulent drag or orifice loss p1 z|z|'),
    'orifice': Law('p1*z1/sqrt(abs(z1) + p2)', 1, 2,
                   'orifice flow p1 sqrt(P), regularised below the pressure p2'),
    'diode': Law('p1*(exp(z1/p2) - 1)', 1, 2, 'Shockley diode, saturation p1, voltage p2'),
    'cubic': Law('p1*z1 + p2*z1**3', 1, 2, 'hardening p1 z + p2 z^3'),
    'saturation': Law('p1*tanh(z1/p1)', 1, 1, 'unit slope, saturating at p1'),
    'product': Law('p1*z1*z2', 2, 1, 'modulation of z1 by z2 with a gain p1'),
}


def expression_of(law: str, arguments: int, parameters: tuple[str, ...]) -> str:
    """
    Return a law as an expression in z1, z2, ... and the given parameters.

    Raises
    ------
    GraphError
        If a named law takes another number of arguments or parameters, or the text is neither
        the name of a law nor an expression.

    """
    known = LAWS.get(law)
    if known is None:
        try:
            parse(law)
        except GraphError as error:
            raise GraphError(f'law {law!r} is neither one of {", ".join(LAWS)} nor an expression: '
                             f'{error}') from error
        return substituted(law, {'z': 'z1'})
    if (known.arguments, known.parameters) != (arguments, len(parameters)):
        raise GraphError(
            f'law {law!r} takes {known.arguments} argument(s) and {known.parameters} '
            f'parameter(s), not {arguments} and {len(parameters)}')
    return substituted(known.expression, {
        f'p{index + 1}': name for index, name in enumerate(parameters)})
