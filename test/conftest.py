# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots with effects and a browser for every folder; the mark of tests that look at the clock."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
import html
from itertools import groupby
import json
from pathlib import Path
import re
import shutil
import subprocess
from typing import Any

from lg_husky_sim.husky.effects import Effect, Onset
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.testing.machine import PatientClock
import pytest

ROOT = Path(__file__).resolve().parent.parent
REALTIME = {
    'test_contract_live.py', 'test_contract_node.py', 'test_contract_process.py',
    'test_contract_standard.py',
}
"""Files whose tests measure time or talk to live processes: a busy machine would fail them.
A single such test in another file has the marker itself."""
CLOCKED = ('test/ros', 'test/diagnosis/test_twin.py')
"""Where ./check looks for tests that look at the clock, lest it imports all others once more."""

LONGEST = (
    (152, ('test_before_after_robot.py',)),
    (79, ('test_diagnosis_names.py', 'test_diagnosis_files.py', 'test_other_units.py')),
    (53, ('test_tour.py',)),
    (38, ('test_api.py',)),
    (33, ('test_diagnosis_seeds.py',)),
    (30, ('test_notebooks.py',)),
    (17, ('test_contract_tools.py',)),
    (16, ('test_trial.py',)),
    (12, ('test_base_clock.py',)),
    (11, ('test_evaluation_paper.py',)),
)
"""Files whose tests take longest, with their time [s]; those that share diagnoses together."""


def pytest_configure(config: pytest.Config) -> None:
    """Judge tests that look at the clock by what the machine allowed."""
    config.pluginmanager.register(PatientClock())


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]
                                  ) -> Generator[None]:
    """Give the tests of those files the marker realtime; deal out those that are selected."""
    for item in items:
        if item.path.name in REALTIME:
            item.add_marker(pytest.mark.realtime)
        if item.get_closest_marker('realtime') and not any(
                item.path.resolve().is_relative_to(ROOT / place) for place in CLOCKED):
            raise pytest.UsageError(f'{item.nodeid} looks at the clock, and ./check only has such '
                                    f'tests in {", ".join(CLOCKED)}')
    yield
    items[:] = dealt(items, getattr(config, 'workerinput', {}).get('workercount', 1))


def dealt(items: Sequence[pytest.Item], workers: int) -> list[pytest.Item]:
    """
    Return tests in an order of which each process gets an equal part, its longest ones first.

    xdist's worksteal cuts the list into as many parts as there are processes. One that is done
    takes tests from the end of another's part. So nobody waits for another's last test, and what
    is made once for a file, or for files that belong together, is made by one process.
    """
    place = {name: k for k, (_, names) in enumerate(LONGEST) for name in names}
    long = sorted((item for item in items if item.path.name in place),
                  key=lambda item: place[item.path.name])
    short = [item for item in items if item.path.name not in place]
    parts: list[list[pytest.Item]] = [[] for _ in range(workers)]
    loads = [0.0] * workers
    for k, together in groupby(long, lambda item: place[item.path.name]):
        least = loads.index(min(loads))
        parts[least] += together
        loads[least] += LONGEST[k][0]
    left = len(items)
    for k, part in enumerate(parts):
        more = max(left // (workers - k) - len(part), 0)
        part += short[:more]
        del short[:more]
        left -= len(part)
    return [item for part in parts for item in part]


def _robot(*effects: str | Effect, onset: Onset | None = None, **values: float) -> Plant:
    structure = Structure(onset=onset)
    for effect in effects:
        structure = structure.with_effect(Effect(effect) if isinstance(effect, str) else effect)
    own = [p.parameter() for effect in structure.effects for p in effect.parameters()]
    parameters = load_model().parameters.with_entries(*own).replacing(values)
    return compile_model(structure).at(parameters)


@pytest.fixture(scope='session')
def robot() -> Callable[..., Plant]:
    """Return a function that makes the paper's Husky with effects and other numbers."""
    return _robot


BROWSERS = ('chromium', 'chromium-browser', 'google-chrome')
VISIT = """
addEventListener('load', async () => {
  const wait = (time) => new Promise((done) => setTimeout(done, time));
  const $ = (name) => document.getElementById(name), seen = {};
  const all = (name) => [...document.querySelectorAll(`[data-${name}]`)];
  const drawn = (place) => ($(place) && $(place).data ? $(place).data.length : 0);
  const range = () => $('plot-signals').layout.xaxis.range.map(Number);
  const title = () => [...$('plot-signals').layout.annotations].map((one) => one.text)[0];
  for (let k = 0; k < 100 && !$('plot-signals')?.data; k += 1) await wait(100);
  seen.alive = document.body.classList.contains('alive');
  seen.size = [document.documentElement.scrollWidth, innerWidth];
  seen.cut = [...document.querySelectorAll('.wide')].map(
    (one) => one.scrollWidth - one.clientWidth);
  seen.dark = getComputedStyle(document.body).backgroundColor;
  seen.plots = [...document.querySelectorAll('.js-plotly-plot')].map(
    (one) => one.getBoundingClientRect().right);
  seen.drawn = ['plot-first', 'plot-signals', 'plot-path'].map(drawn);
  seen.recordings = [...$('recording').options].map((one) => one.text);
  seen.range = range();
  const press = async (button) => { button.click(); await wait(200); };
  for (const way of ['in', 'on', 'back', 'out', 'all']) {
    await press(all('zoom').find((one) => one.dataset.zoom === way));
    seen[way] = range();
  }
  await press(all('show').find((one) => one.dataset.show === 'errors'));
  seen.errors = [drawn('plot-signals'), title()];
  seen.signs = $('plot-signals').data.filter((one) => one.name).slice(0, 3).map(
    (one) => Math.sign(one.y[10]));
  await press(all('show').find((one) => one.dataset.show === 'values'));
  seen.values = [drawn('plot-signals'), title()];
  seen.coloured = [];
  for (const column of all('column')) {
    await press(column);
    const path = $('plot-path').data.find((one) => one.name === 'measured');
    seen.coloured.push(path.marker.color.length > 1
      ? Array.from(path.marker.color).filter(Number.isFinite).reduce((a, b) => a + b, 0) : null);
  }
  $('recording').selectedIndex = $('recording').options.length - 1;
  $('recording').dispatchEvent(new Event('change'));
  await wait(200);
  seen.chosen = range();
  if ($('plot-path')) {
    $('plot-path').emit('plotly_click', { points: [{ customdata: 6 }] });
    await wait(200);
    seen.clicked = range();
  }
  seen.jumps = [];
  for (const jump of all('jump')) {
    await press(jump);
    seen.jumps.push([$('recording').selectedOptions[0].text, ...range()]);
  }
  for (const one of document.querySelectorAll('details')) one.open = true;
  await wait(300);
  seen.charts = all('chart').map((one) => (one.data ? one.data.length : 0));
  document.body.dataset.seen = JSON.stringify(seen);
  parent.postMessage(document.body.dataset.seen, '*');
});
"""
"""What a reader does with a report, written down in the page itself."""
FRAME = """<!doctype html><body>
<iframe src="page.html" style="border: 0; height: 900px; width: {}px"></iframe>
<script>addEventListener('message', (one) => {{ document.body.dataset.seen = one.data; }});
</script></body>"""
"""A browser's window is 500 pixels wide at least; what is in a frame is as wide as the frame."""


@pytest.fixture(scope='session')
def visited(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., dict[str, Any]]:
    """Return a function that opens a report in a browser, uses every button and says what came."""
    pytest.importorskip('plotly')
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        pytest.skip(f'NO BROWSER ({", ".join(BROWSERS)}): the JavaScript of reports is not tested')

    def visit(page: Path, width: int = 1280, dark: bool = False) -> dict[str, Any]:
        folder = tmp_path_factory.mktemp('browser')
        text = page.read_text(encoding='utf-8')
        script = f'<script>{VISIT}</script></body>'
        (folder / 'page.html').write_text(text.replace('</body>', script), encoding='utf-8')
        (folder / 'frame.html').write_text(FRAME.format(width), encoding='utf-8')
        ran = subprocess.run([
            browser, '--headless=new', '--no-sandbox', '--disable-gpu', '--hide-scrollbars',
            f'--user-data-dir={folder / "profile"}', f'--window-size={width + 16},900',
            f'--blink-settings=preferredColorScheme={0 if dark else 1}',
            '--enable-logging=stderr', '--log-level=0', '--virtual-time-budget=60000',
            '--dump-dom', (folder / 'frame.html').as_uri()],
            capture_output=True, text=True, timeout=600, check=True)
        said = re.findall(r'CONSOLE[^\]]*\] (.*)', ran.stderr)
        assert not said, f'in the console of {page.name}: {said}'
        answer = re.search(r'data-seen="([^"]*)"', ran.stdout)
        assert answer is not None, f'{page.name} did not come to life'
        seen: dict[str, Any] = json.loads(html.unescape(answer.group(1)))
        return seen
    return visit
