"""Report: figures, the cost table and one self-contained page, from the files of earlier stages only."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from pipeline.evaluation.cost_table import format_cost_table
from pipeline.evaluation.summary import flat_metrics
from pipeline.files import sum_path, write_text
from pipeline.parts import resolve
from pipeline.settings import require
from pipeline.stages.door import StageResult, launch, typed, workspace
from pipeline.stages.jobs import nothing_to_do, system_of
from pipeline.tracking.revision import revision_tags

# Sections shown on the page, in the order of the stages.
SECTIONS = ("plans", "rasterize", "sensor", "robot", "planner", "harvest", "train", "evaluate")


@dataclass(frozen=True, kw_only=True)
class ReportConfig:
    """What the page shows (conf/report/)."""

    title: str | None = None
    """Heading of the page; null: what the system is called."""
    episodes: int = 3
    """Recorded trials that are drawn: the best, the worst, and evenly between."""
    dpi: int = 150
    """Resolution of the figures [dots per inch]."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(self.title is None or bool(self.title.strip()), "report.title", repr(self.title), "some text or null")
        require(0 <= self.episodes <= 50, "report.episodes", self.episodes, "from 0 to 50")
        require(40 <= self.dpi <= 600, "report.dpi", self.dpi, "from 40 to 600 dots per inch")


def report(raw: DictConfig) -> StageResult:
    """Write ``artifacts/report``: report.html, cost_table.txt and figures/; print the table and where things are.

    A system that compares nobody has no page; report.json says so.
    """
    from pipeline.reports.figures import SystemFigures, draw_figures
    from pipeline.reports.inputs import read_inputs
    from pipeline.reports.page import PageContent, render_page

    config, work, system = typed(ReportConfig, raw, "report"), workspace(raw), system_of(raw)
    if system.contest is None:
        _clear(work.folder("report"))
        return nothing_to_do("report", work.folder("report"), f"{system.title} compares nobody")
    own: SystemFigures = resolve(system.figures) if system.figures else SystemFigures()
    inputs = read_inputs(work.root)
    target, summary = work.folder("report"), inputs.summary
    _clear(target)
    figures = draw_figures(inputs, own, target / "figures", episodes=config.episodes, dpi=config.dpi)
    page = render_page(
        PageContent(
            title=config.title or system.title,
            summary=summary,
            figures=figures,
            sections=own.sections(inputs),
            settings=_sections(raw, leave_out=("harvest", "train") if inputs.elsewhere else ()),
            provenance=_provenance(inputs.harvest, inputs.train),
            harvest=inputs.harvest,
            train=inputs.train,
            missing=inputs.missing,
            elsewhere=inputs.elsewhere,
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


def _clear(target: Path) -> None:
    """Remove what an earlier run left: a page of fewer drives, or none, would leave stale figures beside it."""
    leftovers = (target / name for name in ("report.html", "cost_table.txt", "report.json"))
    for leftover in (*(target / "figures").glob("*.png"), *leftovers):
        leftover.unlink(missing_ok=True)
        sum_path(leftover).unlink(missing_ok=True)


def _sections(raw: DictConfig, leave_out: Sequence[str]) -> dict[str, Any]:
    """Return the sections of the configuration that decided the numbers, but for those to leave out."""
    content = OmegaConf.to_container(raw, resolve=True)
    assert isinstance(content, dict)
    return {name: content[name] for name in SECTIONS if name not in leave_out and content.get(name) is not None}


def _provenance(harvest: dict[str, Any], train: dict[str, Any]) -> dict[str, str]:
    """Return where the numbers come from: code revision and digests of the data."""
    found = {"code, git revision": _revision()}
    if digest := harvest.get("digest"):
        found["harvest, SHA-256"] = str(digest)
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
