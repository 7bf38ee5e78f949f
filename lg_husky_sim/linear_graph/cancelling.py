# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Common factors of two polynomials in many variables.

Dense images modulo a prime tell which variables a common factor has in it. A factor without a
variable divides each coefficient of the polynomials in that variable; so the greatest common
divisor is that of many small polynomials in few variables, or 1 without any further work.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lg_husky_sim.linear_graph.modular import generic_numbers, PRIME


def cancelled(above: Any, below: Any) -> tuple[Any, Any]:
    """
    Return numerator and denominator without common factors, the denominator's first term positive.

    Parameters
    ----------
    above, below : polynomials
        Elements of one of SymPy's sparse polynomial rings over the integers.

    """
    if not above:
        return above, above.ring.one
    factor = common_factor(above, below)
    above, below = _divided(above, factor), _divided(below, factor)
    return (-above, -below) if below.LC < 0 else (above, below)


def _divided(polynomial: Any, factor: Any) -> Any:
    if len(factor) > 1:
        return polynomial.exquo(factor)
    own, number = factor.LM, factor.LC      # the same term by term, which is much faster
    return polynomial.ring.from_dict({
        tuple(power - less for power, less in zip(powers, own, strict=True)): value // number
        for powers, value in polynomial.terms()})


def common_factor(one: Any, two: Any) -> Any:
    """Return the greatest common divisor of two polynomials that are not zero."""
    inside = _variables_of_common(one, two)
    found = one.ring.zero
    for part in sorted((*_coefficients(one, inside), *_coefficients(two, inside)), key=len):
        found = found.gcd(part)
        if found == 1:
            break
    return found


def _coefficients(polynomial: Any, inside: Sequence[int]) -> list[Any]:
    """Return the coefficients with respect to all other variables, as polynomials."""
    ring = polynomial.ring
    parts: dict[tuple[int, ...], dict[tuple[int, ...], Any]] = {}
    for powers, number in polynomial.terms():
        own = tuple(power if at in inside else 0 for at, power in enumerate(powers))
        rest = tuple(0 if at in inside else power for at, power in enumerate(powers))
        parts.setdefault(rest, {})[own] = number
    return [ring.from_dict(part) for part in parts.values()]


def _variables_of_common(one: Any, two: Any) -> tuple[int, ...]:
    """Return the variables that a common factor may have: all it has, by chance one more."""
    from sympy.polys.domains import ZZ
    from sympy.polys.galoistools import gf_gcd

    shared = [at for at, degrees in enumerate(zip(one.degrees(), two.degrees(), strict=True))
              if min(degrees) > 0]
    images = [_images(polynomial, shared) for polynomial in (one, two)]
    found = []
    for at in shared:
        pair = [image[at] for image in images]
        # where a first coefficient is zero modulo the prime, the image says nothing
        if not (pair[0][0] and pair[1][0]) or len(gf_gcd(*pair, PRIME, ZZ)) > 1:
            found.append(at)
    return tuple(found)


def _images(polynomial: Any, variables: Sequence[int]) -> dict[int, list[Any]]:
    """Return for each variable the coefficients, all others having generic numbers."""
    from sympy.polys.domains import ZZ

    numbers = generic_numbers(polynomial.ring.ngens)
    inverses = [pow(number, -1, PRIME) for number in numbers]
    found = {at: [0] * (polynomial.degrees()[at] + 1) for at in variables}
    for powers, number in polynomial.terms():
        value = int(number) % PRIME
        for base, power in zip(numbers, powers, strict=True):
            if power:
                value = value * pow(base, power, PRIME) % PRIME
        for at in variables:
            own = value * pow(inverses[at], powers[at], PRIME) % PRIME if powers[at] else value
            place = -1 - powers[at]
            found[at][place] = (found[at][place] + own) % PRIME
    return {at: [ZZ(value) for value in image] for at, image in found.items()}
