"""Report: figures, the cost table and one self-contained page, from the files of earlier stages only."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from omegaconf import DictConfig, OmegaConf

from pipeline.evaluation.cost_table import format_cost_table
from pipeline.evaluation.ransac import THRESHOLD_M
from pipeline.evaluation.summary import flat_metrics, summarise
from pipeline.files import write_text
from pipeline.stages.door import StageResult, launch, typed, workspace
from pipeline.stages.settings import require
from pipeline.tracking.revision import revision_tags

if TYPE_CHECKING:
    from pipeline.reports.inputs import ReportInputs

# Sections shown on the page, in the order of the stages.
SECTIONS = ("plans", "rasterize", "sensor", "robot", "planner", "harvest", "train", "evaluate")


@dataclass(frozen=True, kw_only=True)
class ReportConfig:
    """What the page shows (conf/report/)."""

    title: str = "Learned subgoal planning"
    episodes: int = 3
    """Recorded trials that are drawn: the best, the worst, and evenly between."""
    dpi: int = 150
    """Resolution of the figures [dots per inch]."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(bool(self.title.strip()), "report.title", repr(self.title), "some text")
        require(0 <= self.episodes <= 50, "report.episodes", self.episodes, "from 0 to 50")
        require(40 <= self.dpi <= 600, "report.dpi", self.dpi, "from 40 to 600 dots per inch")


def report(raw: DictConfig) -> StageResult:
    """Write ``artifacts/report``: report.html, cost_table.txt and figures/; print the table and where things are."""
    from pipeline.reports.figures import draw_figures
    from pipeline.reports.inputs import read_inputs
    from pipeline.reports.page import PageContent, render_page

    config, work = typed(ReportConfig, raw, "report"), workspace(raw)
    inputs = read_inputs(work.root)
    target = work.folder("report")
    _clear(target / "figures")
    summary = _summarise(inputs, work.seed)
    figures = draw_figures(
        inputs, summary, target / "figures", seed=work.seed, episodes=config.episodes, dpi=config.dpi
    )
    page = render_page(
        PageContent(
            title=config.title,
            summary=summary,
            figures=figures,
            settings=_sections(raw),
            provenance=_provenance(inputs.harvest, inputs.train),
            harvest=inputs.harvest,
            train=inputs.train,
            missing=inputs.missing,
        )
    )
    table = format_cost_table(summary)
    write_text(target / "report.html", page)
    write_text(target / "cost_table.txt", table + "\n")
    print(f"\n{table}\n\nreport   {_place(target / 'report.html')}\nfigures  {_place(target / 'figures')}")
    return StageResult(
        metrics=flat_metrics(summary),
        files=[target / "report.html", target / "cost_table.txt", *(figure.path for figure in figures)],
    )


def _summarise(inputs: "ReportInputs", seed: int) -> dict[str, Any]:
    """Return the summary as the evaluate stage forms it: with its settings, and the remarks that it made."""
    settings = inputs.evaluate.get("settings", {})
    return summarise(
        inputs.trials,
        inputs.estimates,
        seed,
        ransac_threshold_m=float(settings.get("ransac_threshold_m", THRESHOLD_M)),
        remarks=inputs.evaluate.get("remarks", ()),
        network=inputs.evaluate.get("network"),
    )


def _clear(figures: Path) -> None:
    """Remove the figures of an earlier run: a page of fewer drives would leave stale ones beside it."""
    for leftover in figures.glob("*.png"):
        leftover.unlink()


def _sections(raw: DictConfig) -> dict[str, Any]:
    """Return the sections of the configuration that decided the numbers, as plain values."""
    content = OmegaConf.to_container(raw, resolve=True)
    assert isinstance(content, dict)
    return {name: content[name] for name in SECTIONS if content.get(name) is not None}


def _provenance(harvest: dict[str, Any], train: dict[str, Any]) -> dict[str, str]:
    """Return where the numbers come from: code revision and digests of the data."""
    found = {"code, git revision": _revision()}
    if digest := harvest.get("digest"):
        found["datum table, SHA-256"] = str(digest)
    for key in ("fingerprint", "digest"):
        if isinstance(train.get(key), str):
            found[f"training, {key}"] = train[key]
    return found


def _revision() -> str:
    tags = revision_tags(Path(__file__).resolve().parents[2])
    changed = " with uncommitted changes" if tags.get("git.dirty") == "true" else ""
    return tags["git.revision"] + changed


def _place(path: Path) -> str:
    """Return ``path`` absolute, so that it can be opened from anywhere."""
    return str(path.resolve())


if __name__ == "__main__":
    launch("report", report)
