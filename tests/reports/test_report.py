import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import pytest
from omegaconf import DictConfig, OmegaConf

from pipeline.errors import ConfigError, TableError
from pipeline.evaluation.trials import write_episodes, write_trials
from pipeline.files import write_json, write_sum
from pipeline.reports.inputs import read_inputs
from pipeline.stages.report import report
from tests.reports.synthetic import REMARK, write_artifacts

VOID = {"meta", "img", "br", "hr", "link", "input"}


def config(artifacts: Path, **changes: object) -> DictConfig:
    return OmegaConf.create(
        {
            "seed": 7,
            "system": "subgoals",
            "artifacts": str(artifacts),
            "execution": {"workers": 1, "progress": False},
            "sensor": {"beams": 1024, "max_range_m": 12.0},
            "evaluate": {"split": "test"},
            "report": {"title": "Guided mazes", "episodes": 2, "dpi": 50} | changes,
        }
    )


class TagCounter(HTMLParser):
    """Fails on a tag that is closed before its children, and remembers which attributes load something."""

    def __init__(self) -> None:
        super().__init__()
        self.opened: list[str] = []
        self.loads: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag not in {"script", "link", "iframe"}
        self.loads += [value or "" for name, value in attrs if name in {"src", "href", "srcset", "data"}]
        if tag not in VOID:
            self.opened.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.opened.pop() == tag


@pytest.fixture(scope="module")
def artifacts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_artifacts(tmp_path_factory.mktemp("artifacts"))


@pytest.fixture(scope="module")
def page(artifacts: Path) -> str:
    report(config(artifacts))
    return (artifacts / "report/report.html").read_text(encoding="utf-8")


def copied(artifacts: Path, target: Path) -> Path:
    return Path(shutil.copytree(artifacts, target / "artifacts", ignore=shutil.ignore_patterns("report")))


def test_the_page_is_well_formed_and_loads_nothing(page: str) -> None:
    counter = TagCounter()
    counter.feed(page)
    counter.close()
    assert counter.opened == []
    assert counter.loads
    assert all(source.startswith("data:image/png;base64,") for source in counter.loads)
    assert not re.search(r"https?://|@import|url\(", page)


def test_every_part_is_on_the_page(page: str) -> None:
    for name in ("costs", "endings", "drives", "estimates", "buildings", "data", "training", "run"):
        assert f'<section id="{name}">' in page
    for words in (
        "80 paired trials in guided_maze", "trimmed slope", "RANSAC line", "known map (bound)", "best of the recorded",
        "worst of the recorded", REMARK, "inliers within 3 m", "Reliability of P_S", "building-3", "31,234",
        "<td>0.91</td>", "seed",
    ):  # fmt: skip
        assert words in page


def test_files_and_result(artifacts: Path, page: str, capsys: pytest.CaptureFixture[str]) -> None:
    result = report(config(artifacts))
    folder = artifacts / "report"
    figures = {path.name for path in (folder / "figures").iterdir()}
    assert figures == {
        "scatter_learned.png", "scatter_perfect.png", "scatter_known_map.png", "ratios.png", "calibration_learned.png",
        "training.png",
        "trajectories_0.png", "trajectories_1.png",
    }  # fmt: skip
    assert all(path.is_file() for path in result.files)
    assert 0.3 < result.metrics["learned/total_ratio"] < 1.0
    said = capsys.readouterr().out
    assert (folder / "cost_table.txt").read_text(encoding="utf-8").strip() in said
    assert str(folder / "report.html") in said
    assert (folder / "report.html").read_text(encoding="utf-8") == page, "the same files give the same page"


def test_figures_of_an_earlier_run_do_not_stay(artifacts: Path, tmp_path: Path) -> None:
    root = copied(artifacts, tmp_path)
    (root / "report/figures").mkdir(parents=True)
    (root / "report/figures/trajectories_7.png").touch()
    report(config(root, episodes=1))
    assert sorted(path.name for path in (root / "report/figures").glob("trajectories*")) == ["trajectories_0.png"]


OPTIONAL = {
    "evaluate/episodes.parquet": "no trajectories",
    "train/curves.parquet": "no training curves",
    "train/train.json": "no training summary",
    "harvest/harvest.json": "no counts of the data set",
}


@pytest.mark.parametrize("missing", OPTIONAL)
def test_a_missing_optional_file_is_noted(artifacts: Path, tmp_path: Path, missing: str) -> None:
    root = copied(artifacts, tmp_path)
    (root / missing).unlink()
    assert read_inputs(root).missing == [f"{missing} is not there: {OPTIONAL[missing]}."]


def test_trials_alone_make_a_page_that_says_what_is_missing(artifacts: Path, tmp_path: Path) -> None:
    root = copied(artifacts, tmp_path)
    for missing in OPTIONAL:
        (root / missing).unlink()
    assert report(config(root)).metrics["learned/finished"] == 80.0
    page = (root / "report/report.html").read_text(encoding="utf-8")
    assert all(f"{missing} is not there: {reason}." in page for missing, reason in OPTIONAL.items())


def test_empty_tables_make_a_page(artifacts: Path, tmp_path: Path) -> None:
    root = copied(artifacts, tmp_path)
    summary = json.loads((root / "evaluate/summary.json").read_text(encoding="utf-8"))
    summary["competitors"]["learned"]["measures"] = {}
    write_json(root / "evaluate/summary.json", summary)
    write_episodes(root / "evaluate/episodes.parquet", [])
    report(config(root))
    assert "No estimates were recorded" in (root / "report/report.html").read_text(encoding="utf-8")


def test_the_title_is_text_not_markup(artifacts: Path, tmp_path: Path) -> None:
    root = copied(artifacts, tmp_path)
    report(config(root, title="<b>A & B</b>", episodes=0))
    page = (root / "report/report.html").read_text(encoding="utf-8")
    assert "<h1>&lt;b&gt;A &amp; B&lt;/b&gt;</h1>" in page


def test_no_trials_is_an_error_and_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"trials.parquet: no such file"):
        report(config(tmp_path))
    write_trials(tmp_path / "evaluate/trials.parquet", [])
    with pytest.raises(TableError, match="holds no trial, expected at least one"):
        report(config(tmp_path))
    assert not (tmp_path / "report").exists()


BROKEN = {
    "train/train.json": ("{", "not readable JSON"),
    "harvest/harvest.json": ("[1]", "got a JSON list, expected an object"),
    "train/curves.parquet": ("PAR1", "not a readable"),
    "evaluate/summary.json": ('{"version": 1}', "of version 1 or of other trials"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_damaged_file_is_named(artifacts: Path, tmp_path: Path, name: str) -> None:
    root = copied(artifacts, tmp_path)
    content, message = BROKEN[name]
    (root / name).write_text(content)
    with pytest.raises(TableError, match=rf"{Path(name).name} is damaged"):
        report(config(root))
    write_sum(root / name)
    with pytest.raises(TableError, match=rf"{Path(name).name}.*{message}"):
        report(config(root))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"dpi": 3}, "report.dpi = 3: expected from 40 to 600"),
        ({"episodes": -1}, "report.episodes = -1"),
        ({"title": " "}, "report.title"),
        ({"epsodes": 3}, "unknown key report.epsodes.*report.episodes"),
    ],
)
def test_bad_settings_are_refused(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        report(config(tmp_path, **changes))
