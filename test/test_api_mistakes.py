# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is missing or out of range in a call is said in one line, and not by Python's own error."""

from __future__ import annotations

from collections.abc import Callable
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
