# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Predict the motor currents and the supply voltage that a diagnosis was not shown.

    python benchmarks/concealed_channels.py REC --model model.yaml

The diagnosis reads commands, wheels, gyro and pose only. Here its model drives with the recorded
commands, and the topics that were concealed are opened: supply-side current of each driver
against the recorded one, which side draws more, and the fall of the supply with the total.
"""

from __future__ import annotations

import argparse

from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import read_recording, segments
import numpy as np

#: Time over which currents are averaged [s]: the driver's currents come at 6.7 Hz.
WINDOW = 0.5
#: Commanded speed and yaw rate below which there is none [m/s, rad/s].
STILL = 0.05


def main() -> None:
    """Print correlation, error and the share of moments at which the stronger side is right."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('recording')
    parser.add_argument('--model', default=None)
    parser.add_argument('--from-second', type=float, default=0.0,
                        help='use only what comes after this time of the recording [s]')
    arguments = parser.parse_args()
    model = load_model(arguments.model)
    plant = compile_model(model.structure).at(model.parameters)
    supply = model.parameters['supply_voltage']
    recording = read_recording(arguments.recording)
    currents, voltage = recording.stream('currents'), recording.stream('voltage')
    measured, predicted, bus, kinds = [], [], [], []
    for segment in segments(recording):
        if segment.start < arguments.from_second:
            continue
        seen = replay(plant, segment)
        for begin in np.arange(segment.start, segment.end - WINDOW, WINDOW):
            rows = currents.slice(begin, begin + WINDOW).values
            volts = voltage.slice(begin, begin + WINDOW).values
            inside = seen.slice(begin, begin + WINDOW)
            if not len(rows) or not len(volts) or len(inside) < 2:
                continue
            drawn = [float(np.mean(np.abs(inside.column(f'voltage_{side}') / supply
                                          * inside.column(f'current_{side}'))))
                     for side in ('left', 'right')]
            command = segment.streams['command']
            at = max(int(np.searchsorted(command.times, begin, side='right')) - 1, 0)
            forward, yaw = command.values[at]
            kinds.append('turning' if abs(yaw) > STILL else
                         'straight' if abs(forward) > STILL else 'rest')
            measured.append(np.abs(rows).mean(axis=0))
            predicted.append(drawn)
            bus.append(float(volts.mean()))
    truth, guess = np.array(measured), np.array(predicted)
    kind, supply_seen = np.array(kinds), np.array(bus)
    print(f'{len(truth)} windows of {WINDOW:g} s')
    for side, name in enumerate(('left', 'right')):
        scale = float(truth[:, side] @ guess[:, side] / max(guess[:, side] @ guess[:, side], 1e-9))
        alike = np.corrcoef(truth[:, side], guess[:, side])[0, 1]
        print(f'{name:6} current: correlation {alike:.2f}, '
              f'predicted mean {guess[:, side].mean():.2f} A, '
              f'recorded {truth[:, side].mean():.2f} A, best factor on the prediction {scale:.2f}')
    apart = np.abs(truth[:, 0] - truth[:, 1]) > 1.0
    for regime in ('turning', 'straight'):
        chosen = apart & (kind == regime)
        if chosen.any():
            right = np.mean((truth[chosen, 0] > truth[chosen, 1])
                            == (guess[chosen, 0] > guess[chosen, 1]))
            print(f'{regime}: the side that draws more is predicted right in {100 * right:.0f} % '
                  f'of {int(chosen.sum())} windows where they differ by more than 1 A')
    total, drawn_total = truth.sum(axis=1), guess.sum(axis=1)
    slope = np.polyfit(total, supply_seen, 1)[0]
    print(f'supply: falls by {-slope:.3f} V per recorded ampere; correlation with the predicted '
          f'total current {np.corrcoef(drawn_total, supply_seen)[0, 1]:.2f}, with the recorded '
          f'{np.corrcoef(total, supply_seen)[0, 1]:.2f}')


if __name__ == '__main__':
    main()
