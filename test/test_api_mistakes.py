# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is missing or out of range in a call is said in one line, and not by Python's own error."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.errors import CommandError, RecordingError
import pytest


@pytest.fixture(scope='module')
def husky() -> lg.Husky:
    return lg.Husky()


@pytest.fixture(scope='module')
def drive(husky: lg.Husky) -> lg.Recording:
    return husky.simulate('s_bend')


@pytest.mark.parametrize('ask', [
    lambda husky: husky.diagnose([]), lambda husky: husky.identify([]),
    lambda husky: husky.compare([]), lambda husky: lg.compare([], husky),
    lambda husky: husky.diagnose(iter(()))])
def test_no_recording_is_called_so(husky: lg.Husky, ask: Callable[[lg.Husky], object]) -> None:
    with pytest.raises(RecordingError, match=r'^no recording given$'):
        ask(husky)


@pytest.mark.parametrize('none', [[], (), {}])
def test_no_model_is_called_so(drive: lg.Recording, none: Any) -> None:
    with pytest.raises(CommandError, match=r'^no model given$'):
        lg.compare(drive, none)


def test_recordings_and_models_may_come_from_an_iterator(husky: lg.Husky, drive: lg.Recording
                                                         ) -> None:
    found = lg.compare(iter([drive]), (one for one in [husky]))   # type: ignore[arg-type]
    assert len(found.outcomes) == len(found.plants) == 1


@pytest.mark.parametrize('jobs', [0, -1])
def test_fewer_than_one_job_is_refused(husky: lg.Husky, drive: lg.Recording, jobs: int) -> None:
    line = rf'^jobs = {jobs}: at least 1 is needed$'
    with pytest.raises(CommandError, match=line):
        husky.diagnose(drive, jobs=jobs)
    with pytest.raises(CommandError, match=line):
        husky.identify(drive, ['mass'], jobs=jobs)
    with pytest.raises(CommandError, match=r'^starts = 0: at least 1 is needed$'):
        husky.identify(drive, ['mass'], starts=0)


#: What a type checker would not let pass.
_ANY: Any = lg


@pytest.mark.parametrize(('ask', 'said'), [
    (lambda husky, drive: _ANY.read(['drive']), "['drive'] is no recording, nor the path of one"),
    (lambda husky, drive: _ANY.read(''), "'' is no recording: the path is empty"),
    (lambda husky, drive: husky.compare(''), "'' is no recording: the path is empty"),
    (lambda husky, drive: _ANY.compare(3), '3 is no recording, nor the path of one'),
    (lambda husky, drive: _ANY.compare(drive, rivals=3), '3 is no recording, nor the path of one'),
    (lambda husky, drive: _ANY.read('x', topics='x'), "topics = 'x' is no mapping of roles"),
    (lambda husky, drive: _ANY.Husky(5), '5 is no model, nor the path of a model file'),
    (lambda husky, drive: _ANY.compare(drive, 5), '5 is no model, nor the path of a model file'),
    (lambda husky, drive: _ANY.compare(drive, [husky, 5]), '5 is no model, nor the path'),
    (lambda husky, drive: _ANY.compare(drive, horizon='a'), "horizon = 'a' s must be 0, or"),
    (lambda husky, drive: _ANY.compare(drive, settings='mass'), "settings = 'mass' is no mapping"),
    (lambda husky, drive: _ANY.compare(drive, {'a': husky, '': husky}),
     "labels of models must be words: 'a', ''"),
    (lambda husky, drive: husky.identify(drive, seed=-1), 'seed = -1: a whole number of at least'),
    (lambda husky, drive: husky.identify(drive, seed=0.5), 'seed = 0.5: a whole number of at'),
    (lambda husky, drive: husky.identify(drive, seed='a'), "seed = 'a': a whole number of at"),
    (lambda husky, drive: _ANY.graph(42), '42 is no linear graph: lg.graph takes a netlist file'),
    (lambda husky, drive: husky.right_hand_side()(0.0, [1.0], [0.0, 0.0]),
     '1 state(s) given; the graph has 6: '),
    (lambda husky, drive: husky.right_hand_side().output([1.0], [0.0, 0.0]),
     '1 state(s) given; the graph has 6: '),
    (lambda husky, drive: husky.right_hand_side()(0.0, 'abc', [0.0, 0.0]),
     "states = 'abc' are no numbers"),
    (lambda husky, drive: husky.right_hand_side()(0.0, [0.0] * 6, [1.0]),
     '1 input(s) given; the graph has 2: '),
    (lambda husky, drive: _ANY.list_effects(3), 'unknown effect 3 (known: '),
    (lambda husky, drive: husky.with_effect(3), 'unknown effect 3 (known: '),
    (lambda husky, drive: husky.with_effect('payload', payload_mass='a'),
     "payload_mass = 'a' is not a number"),
    (lambda husky, drive: husky.with_effect('coulomb_drivetrain', shape='x'),
     'coulomb_drivetrain has no shapes'),
    (lambda husky, drive: husky.with_effect('payload', side='x'), 'payload has no sides'),
    (lambda husky, drive: husky.simulate('circle', rate='a'), "rate = 'a' Hz must be positive"),
    (lambda husky, drive: husky.diagnose(drive, jobs='a'), "jobs = 'a': at least 1 is needed"),
    (lambda husky, drive: husky.parameters['mas'], "unknown parameter 'mas'; did you mean mass?"),
    (lambda husky, drive: husky.identify(drive, free='mas'), "unknown parameter 'mas'; did you"),
    (lambda husky, drive: husky.identify(drive, effects='paylod'), "unknown effect 'paylod'"),
    (lambda husky, drive: husky.identify(drive, nuisance='late'), "unknown nuisance 'late'"),
    (lambda husky, drive: husky.identify(drive, profiles='mass'), "no profile of 'mass'")])
def test_what_cannot_be_used_is_said_in_one_line(
        husky: lg.Husky, drive: lg.Recording, ask: Callable[[Any, Any], object], said: str,
) -> None:
    with pytest.raises(lg.LgHuskyError) as caught:
        ask(husky, drive)
    assert str(caught.value).startswith(said)
    assert '\n' not in str(caught.value)


def test_an_unknown_parameter_is_missing_as_in_any_mapping(husky: lg.Husky) -> None:
    assert 'mas' not in husky.parameters
    assert husky.parameters.get('mas', 1.0) == 1.0


@pytest.mark.parametrize(('text', 'said'), [
    ('elements: {}', 'this is a linear graph, which only derive and lg.graph take'),
    ('steps: []', 'schema is missing, expected the line schema: lg_husky_sim/')])
def test_a_file_of_another_kind_is_called_so(
        husky: lg.Husky, tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / 'file.yaml'
    path.write_text(text)
    readers: list[Callable[[Path], object]] = [lg.Husky, husky.simulate]
    for read in readers:
        with pytest.raises(lg.LgHuskyError) as caught:
            read(path)
        assert str(caught.value).startswith(f'{path}: {said}')
