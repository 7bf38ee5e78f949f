# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the docs are those of today: drawn anew, or with the figures that the text gives."""

from __future__ import annotations

from pathlib import Path
import re
import shutil

from click.testing import CliRunner
from lg_husky_sim.cli.main import cli
from lg_husky_sim.proof import outcomes
from lg_husky_sim.proof.scoring import judge
from lg_husky_sim.proof.summary import rates
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='pictures need matplotlib (the extra "plot")')
Image = pytest.importorskip('PIL.Image')  # comes with matplotlib

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / 'docs'
PICTURES = DOCS / 'pictures'
#: Side of the blocks whose means are compared [pixels], and the largest difference in grey
#: levels of 255: letters of another version of matplotlib move by a pixel, bars by more.
BLOCK, ALIKE = 16, 30.0
#: Files of outcomes that the page of the blind trial is made of: the report of today, the exams,
#: earlier reports.
REPORTS = sorted((path.stem for path in DOCS.glob('proof_report_*.jsonl')), reverse=True)
OUTCOMES = ('proof_report', 'proof_exam', 'proof_exam_2', 'proof_exam_3', 'proof_exam_4',
            'proof_exam_5', 'proof_exam_6', 'proof_exam_7', 'proof_exam_8', 'proof_exam_9',
            'proof_exam_10', 'proof_exam_11', 'proof_exam_12', 'proof_exam_13', 'proof_exam_14',
            'proof_exam_15', 'proof_exam_16', 'proof_exam_17', 'proof_exam_18', 'proof_exam_19',
            *REPORTS,
            'proof_validation')


def blocks(path: Path) -> FloatArray:
    """Return the mean grey of each block of a picture."""
    grey = np.asarray(Image.open(path).convert('L'), dtype=np.float64)
    rows, columns = (size // BLOCK * BLOCK for size in grey.shape)
    parts = grey[:rows, :columns].reshape(rows // BLOCK, BLOCK, columns // BLOCK, BLOCK)
    means: FloatArray = parts.mean(axis=(1, 3))
    return means


def texts(svg: Path) -> list[str]:
    """Return all texts of a picture."""
    return sorted(re.findall(r'<text[^>]*>([^<]+)</text>', svg.read_text(encoding='utf-8')))


def said(name: str) -> str:
    """Return what a picture's file says of itself."""
    picture = Image.open(PICTURES / name)
    assert isinstance(picture.info.get('Description'), str), f'{name} is of an old version'
    return str(picture.info['Description'])


def passage(page: Path, first: str, last: str) -> str:
    """Return the text of a page from one place to another."""
    text = page.read_text(encoding='utf-8')
    return text[text.index(first):text.index(last, text.index(first))]


@pytest.fixture(scope='module')
def proof(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the page of the blind trial from its outcomes, as it says itself."""
    folder = tmp_path_factory.mktemp('proof') / 'docs'
    folder.mkdir()
    sources = [folder / f'{name}.jsonl' for name in OUTCOMES]
    for source in sources:
        shutil.copy(DOCS / source.name, source)
    result = CliRunner().invoke(cli, ['prove', *(word for source in sources
                                                 for word in ('--from', str(source))),
                                      '--page', str(folder / 'proof.md')])
    assert result.exit_code == 0, result.output
    return folder


def test_the_page_of_the_blind_trial_is_that_of_its_outcomes(proof: Path) -> None:
    made = (proof / 'proof.md').read_text(encoding='utf-8')
    for name in OUTCOMES:
        made = made.replace((proof / name).as_posix(), f'docs/{name}')
    assert (DOCS / 'proof.md').read_text(encoding='utf-8') == made


@pytest.mark.parametrize('name', ['proof_rates', 'proof_reliability', 'proof_confusion'])
def test_pictures_of_the_blind_trial_are_those_of_its_outcomes(proof: Path, name: str) -> None:
    ours, made = blocks(PICTURES / f'{name}.png'), blocks(proof / 'pictures' / f'{name}.png')
    assert ours.shape == made.shape
    assert np.abs(ours - made).max() < ALIKE


def test_the_picture_of_the_graph_is_that_of_todays_graph(tmp_path: Path) -> None:
    result = CliRunner().invoke(cli, ['derive', '--picture', str(tmp_path / 'husky.svg')])
    assert result.exit_code == 0, result.output
    assert len(texts(tmp_path / 'husky.svg')) > 20
    assert texts(PICTURES / 'husky_graph.svg') == texts(tmp_path / 'husky.svg')


@pytest.mark.parametrize(('page', 'first', 'last'), [
    ('README.md', 'The finding: its', 'Clearpath'),
    ('docs/real_recordings.md', 'that\n\n- the base', 'A backlash would'),
])
def test_text_and_picture_of_the_real_diagnosis_give_the_same_figures(
        page: str, first: str, last: str) -> None:
    figures = re.findall(r'\d+\.\d+', passage(ROOT / page, first, last))
    figures = [figure for figure in figures if figure != '1.0']  # Clearpath's own
    assert len(figures) >= 2
    description = said('diagnosis.png')
    known = {f'{float(number):.3g}' for number in re.findall(r'\d+(?:\.\d+)?', description)}
    assert {f'{float(figure):.3g}' for figure in figures} <= known


def test_the_table_of_the_real_diagnosis_is_that_of_its_picture() -> None:
    page = passage(DOCS / 'real_recordings.md', '| root mean square error, second', 'Here the')
    rows = re.findall(r'^\| .+? \| \**([\d.]+)\** \| \**([\d.]+)\** \|$', page, re.MULTILINE)
    assert len(rows) == 6
    held = re.findall(r'^Held-out data, .+ recalibrated ([\d.]+), with finding ([\d.]+)$',
                      said('diagnosis.png'), re.MULTILINE)

    def rounded(seen: str, value: str) -> bool:
        # To the digits of the page, of a figure that is rounded to four itself.
        last = 10.0 ** -len(seen.partition('.')[2])
        return abs(float(seen) - float(value)) <= 0.5001 * last
    for row in rows:
        assert any(all(map(rounded, row, known)) for known in held), row


@pytest.mark.parametrize('name', ['compare_tile_responses.png', 'compare_tile_trajectory.png'])
def test_table_and_pictures_of_the_comparison_give_the_same_figures(name: str) -> None:
    rows = passage(DOCS / 'simulate_and_compare.md', '| wheel rate [rad/s] | 2.',
                   '| position, with')
    table = re.findall(r'^\| (.+?) \| ([\d.]+) \| ([\d.]+) \|', rows, re.MULTILINE)
    assert len(table) == 4
    description = said(name)
    for quantity, grass, tile in table:
        for recording, figure in (('husky_wet_grass', grass), ('husky_deflated_tile', tile)):
            found = re.search(rf'^{recording}, {re.escape(quantity)}: paper ([\d.]+)$',
                              description, re.MULTILINE)
            assert found, quantity
            assert float(f'{float(found[1]):.{len(figure.replace(".", "").lstrip("0"))}g}') == (
                float(figure)), (recording, quantity)


def test_each_picture_stands_on_a_page_with_its_command() -> None:
    pages = {page: page.read_text(encoding='utf-8') for page in DOCS.glob('*.md')}
    for picture in PICTURES.iterdir():
        assert any(f'pictures/{picture.name}' in text for text in pages.values()), picture.name
    source = {name: Image.open(PICTURES / name).info.get('Source', '') for name in (
        'diagnosis.png', 'compare_tile_responses.png', 'compare_tile_trajectory.png')}
    assert source['diagnosis.png'].startswith('lg_husky diagnose husky_wet_grass')
    assert source['compare_tile_responses.png'] == source['compare_tile_trajectory.png'] == (
        'lg_husky compare husky_wet_grass husky_deflated_tile --out result')


def test_the_readme_counts_what_the_outcomes_of_all_trials_and_exams_say() -> None:
    """Each sum is that of the files of outcomes."""
    trials = sorted(DOCS.glob('proof_report*.jsonl'))
    exams = sorted(DOCS.glob('proof_exam*.jsonl'))
    asked = {'named': 'single effects: named right', 'changed': 'what changed: named right',
             'flagged': 'clean robots: named, called unknown or failed (false alarm)',
             'unchanged': 'what changed: an unchanged robot flagged',
             'outside': 'outside the catalogue: unknown, or part right'}
    three = [DOCS / f'{name}.jsonl' for name in OUTCOMES if name.startswith('proof_exam')][-3:]

    def counted(files: list[Path], question: str) -> str:
        found = rates([judge(row) for path in files for row in outcomes.read(path)[1]])
        rate = next(one for one in found if one.name == asked[question])
        return f'{rate.hits:g} of {rate.count}'
    text = ' '.join(passage(ROOT / 'README.md', 'successive [blind trials]', '- Without').split())
    last = [DOCS / 'proof_report.jsonl']
    for claim in (
            f'named {counted(trials, "named")} single effects ({counted(last, "named")} in the',
            f'alarms on {counted(trials, "flagged")} clean robots ({counted(last, "flagged")})',
            f'it named {counted(last, "changed")} in the last one',
            f'named {counted(exams, "named")} single effects and {counted(exams, "changed")} '
            f'changes ({counted(three[-1:], "changed")} changes in the last exam',
            f'alarms on {counted(exams, "flagged")} clean robots ({counted(three, "flagged")} in',
            f'outside the catalogue it saw {counted(three, "outside")} in the last three',
            f'called {counted(exams, "unchanged")} unchanged robots changed'):
        assert claim in text
