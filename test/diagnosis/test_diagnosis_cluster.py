# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis on a cluster says the same as one here, bit for bit."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.result import diagnosis_data
from lg_husky_sim.diagnosis.workers import Workers
from lg_husky_sim.errors import FitError
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
import pytest


def test_a_cluster_gives_the_same(drive: Callable[..., Recording]) -> None:
    distributed = pytest.importorskip('distributed', reason='Dask is not installed')
    recordings = [drive('ahead', 'sensor', 1)]
    here = diagnose(recordings, load_model(), lambda text, share: None)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False,
                                  dashboard_address=None) as cluster:
        there = diagnose(recordings, load_model(), lambda text, share: None,
                         workers=Workers(scheduler=cluster.scheduler_address))
    assert here.diagnosis.findings[0].effect == 'gyro_scale'
    assert diagnosis_data(there.diagnosis) == diagnosis_data(here.diagnosis)


def test_a_scheduler_that_does_not_answer_is_one_line(
        drive: Callable[..., Recording], monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('distributed', reason='Dask is not installed')
    monkeypatch.setattr('lg_husky_sim.identification.executor.PATIENCE', 0.2)
    with pytest.raises(FitError, match=r"no Dask scheduler answers at 'tcp://127.0.0.1:9'"):
        diagnose([drive('ahead', 'nothing', 1)], load_model(), lambda text, share: None,
                 workers=Workers(scheduler='tcp://127.0.0.1:9'))
