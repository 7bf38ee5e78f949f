# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a fit; each draws into a figure of its own and saves nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from lg_husky_sim.comparison.figures import STYLE
from lg_husky_sim.identification.profile import LEVEL, Profile
from lg_husky_sim.identification.result import Estimated, FitResult
from lg_husky_sim.signals import FloatArray
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BEST = '#0072b2'
MEAN = '#d55e00'
#: Correlations below this are coloured, not written.
SHOWN = 0.1


def convergence_figure(history: FloatArray, title: str = '') -> Figure:
    """
    Make the paper's Fig. 12: best and mean cost of each generation.

    Parameters
    ----------
    history : numpy.ndarray, shape (n_generations + 1, 2)
        Best and mean cost [m].
    title : str

    Returns
    -------
    matplotlib Figure
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(STYLE):
        figure = Figure(figsize=(7.2, 4.0), layout='constrained')
        axes = figure.subplots()
        generations = np.arange(len(history))
        axes.semilogy(generations, history[:, 1], '.', color=MEAN, markersize=4,
                      label='mean of the population')
        axes.semilogy(generations, history[:, 0], '.-', color=BEST, markersize=4,
                      linewidth=1.0, label='best')
        axes.set_xlabel('generation')
        axes.set_ylabel('objective of eq. (23) [m]')
        axes.set_title(title or f'Best: {history[-1, 0]:.4g} m, mean: {history[-1, 1]:.4g} m')
        axes.legend()
    return figure


def certainty_figure(result: FitResult) -> Figure:
    """
    Draw the intervals relative to the estimates, and the correlations.

    Parameters
    ----------
    result : FitResult

    Returns
    -------
    matplotlib Figure
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    count = len(result.estimates)
    names = [one.name for one in result.estimates]
    with rc_context(STYLE):
        figure = Figure(figsize=(11.0, 2.0 + 0.42 * count), layout='constrained')
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.1))
        draw_intervals(left, result.estimates)
        right.grid(visible=False)
        image = right.imshow(result.correlation, cmap='RdBu_r', vmin=-1.0, vmax=1.0)
        for i in range(count):
            for j in range(count):
                value = float(result.correlation[i, j])
                if abs(value) >= SHOWN:
                    right.text(j, i, f'{value:+.2f}', ha='center', va='center', fontsize=7.0,
                               color='white' if abs(value) > 0.6 else 'black')
        right.set_xticks(range(count), names, rotation=40, ha='right')
        right.set_yticks(range(count), names)
        right.set_title('Correlation')
        figure.colorbar(image, ax=right, fraction=0.046, pad=0.04)
    return figure


def profile_figure(profiles: Sequence[Profile]) -> Figure:
    """
    Draw likelihood profiles with their 95 % level.

    Parameters
    ----------
    profiles : sequence of Profile
        At least one.

    Returns
    -------
    matplotlib Figure
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(STYLE):
        figure = Figure(figsize=(3.6 * len(profiles), 3.2), layout='constrained')
        for axes, one in zip(np.atleast_1d(figure.subplots(1, len(profiles))), profiles,
                             strict=True):
            axes.plot(one.values, one.rise, '.-', color=BEST)
            axes.axhline(LEVEL, color=MEAN, linestyle='--', linewidth=1.0, label='95 %')
            axes.set_xlabel(one.name)
            axes.set_ylabel('rise of the cost [nats]')
            axes.set_ylim(0.0, 4.0 * LEVEL)
            axes.legend()
    return figure


def draw_intervals(axes: Axes, estimates: Sequence[Estimated]) -> None:
    for row, one in enumerate(estimates):
        scale = max(abs(one.value), 1e-12)
        low, high = (one.low - one.value) / scale, (one.high - one.value) / scale
        axes.plot([100.0 * low, 100.0 * high], [row, row], color=BEST, linewidth=3.0)
        axes.plot(0.0, row, 'o', color=BEST, markersize=6)
    axes.axvline(0.0, color='#333333', linewidth=0.8)
    axes.set_yticks(range(len(estimates)),
                    [f'{one.name} = {one.value:.4g} {one.unit}' for one in estimates])
    axes.invert_yaxis()
    axes.set_xlabel('95 % interval about the estimate [%]')
    axes.set_xscale('symlog', linthresh=10.0)
    axes.xaxis.set_major_formatter('{x:g}')
    axes.set_title('Estimates')
