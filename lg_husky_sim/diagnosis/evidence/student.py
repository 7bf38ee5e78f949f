# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Student's t of whitened innovations, under which single ones may be far off.

With nu degrees of freedom an innovation e costs c(e) more than one that is nought, and counts in a
reweighted least-squares step as much as its weight w(e)::

    c(e) = (nu + 1) / 2 log(1 + e^2 / nu),   w(e) = c'(e) / e = (nu + 1) / (nu + e^2)
"""

from __future__ import annotations

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
import numpy as np


def costs(whitened: FloatArray) -> FloatArray:
    """
    Return what each innovation costs.

    Parameters
    ----------
    whitened : numpy.ndarray
        Of any shape, in standard deviations.

    Returns
    -------
    numpy.ndarray
        Of the same shape [nats].

    """
    nu = setting('student')
    each: FloatArray = 0.5 * (nu + 1.0) * np.log1p(whitened * whitened / nu)
    return each


def cost(whitened: FloatArray) -> float:
    """Return what all innovations cost together [nats]."""
    return float(_cost(np.ravel(whitened), setting('student'), setting('product_full')))


def weights(whitened: FloatArray) -> FloatArray:
    """Return how much each innovation counts in a step, of the same shape."""
    nu = setting('student')
    each: FloatArray = (nu + 1.0) / (nu + whitened * whitened)
    return each


def reweighted(whitened: FloatArray, columns: FloatArray, sizes: FloatArray
               ) -> tuple[float, FloatArray, FloatArray]:
    """
    Return what is left beside columns costs, and the weighted least-squares problem there.

    Parameters
    ----------
    whitened : numpy.ndarray, shape (n,)
        Innovations, in standard deviations.
    columns : numpy.ndarray, shape (n, m)
        Whitened changes.
    sizes : numpy.ndarray, shape (m,)
        How much of each is taken off the innovations.

    Returns
    -------
    cost : float
        Of ``e - C s`` [nats].
    normal : numpy.ndarray, shape (m, m)
        ``C' W C`` with the weights of what is left.
    slope : numpy.ndarray, shape (m,)
        ``C' W e``

    """
    normal, slope = np.zeros((sizes.size, sizes.size)), np.zeros(sizes.size)
    spent = float(_reweighted(
        np.ascontiguousarray(whitened), np.ascontiguousarray(columns),
        np.ascontiguousarray(sizes), setting('student'), setting('product_full'), normal, slope))
    return spent, normal, slope


@jit
def _cost(whitened: FloatArray, nu: float, full: float) -> float:
    # Logarithms are dear: one of a product of as many terms as a number can hold.
    total, product = 0.0, 1.0
    for k in range(whitened.size):
        term = 1.0 + whitened[k] * whitened[k] / nu
        if term > full:
            total += np.log(term)
        else:
            product *= term
            if product > full:
                total += np.log(product)
                product = 1.0
    found: float = 0.5 * (nu + 1.0) * (total + np.log(product))
    return found


@jit
def _reweighted(whitened: FloatArray, columns: FloatArray, sizes: FloatArray, nu: float,
                full: float, normal: FloatArray, slope: FloatArray) -> float:
    total, product = 0.0, 1.0
    count = sizes.size
    for k in range(whitened.size):
        left = whitened[k]
        for i in range(count):
            left -= columns[k, i] * sizes[i]
        term = 1.0 + left * left / nu
        if term > full:
            total += np.log(term)
        else:
            product *= term
            if product > full:
                total += np.log(product)
                product = 1.0
        weight = (nu + 1.0) / (nu * term)
        for i in range(count):
            weighted = weight * columns[k, i]
            slope[i] += weighted * whitened[k]
            for j in range(i + 1):
                normal[i, j] += weighted * columns[k, j]
    for i in range(count):
        for j in range(i):
            normal[j, i] = normal[i, j]
    found: float = 0.5 * (nu + 1.0) * (total + np.log(product))
    return found
