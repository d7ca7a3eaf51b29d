"""The guides to parts of one's own, from nothing: their files are written, their commands run, word for word."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from pipeline.errors import HinterlandError
from pipeline.stages.compose import check
from pipeline.stages.composing import composed
from pipeline.stages.door import find_parts
from pipeline.systems.system import find_system
from tests.docs.pages import DOCS, commands, refusals, write_files

ROOT = DOCS.parent
PAGES = ("own-planner.md", "own-estimator.md", "own-system.md")
CODE = ("conf", "pipeline", "models", "hinterland", ".dvcignore", "dvc.yaml", "params.yaml", "pyproject.toml")
LATE = ("made a ", "scan 1: ")  # what only a part that is made or asked can show


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder of own parts, outside of the checkout, with what all pages show in it."""
    monkeypatch.setattr("sys.path", list(sys.path))
    for page in PAGES:
        write_files(page, tmp_path)
    yield tmp_path / "lab"
    for name in [name for name in sys.modules if name.partition(".")[0] in ("my_planners", "my_estimators", "detours")]:
        del sys.modules[name]


def run(command: list[str], checkout: Path) -> subprocess.CompletedProcess[str]:
    """Run a command of a page in ``checkout``."""
    program = {"hinterland": ["-m", "pipeline"], "python": []}[command[0]]
    return subprocess.run(
        [sys.executable, *program, *command[1:]],
        cwd=checkout,
        env=os.environ | {"PYTHONPATH": str(checkout), "MLFLOW_DISABLE_TELEMETRY": "true"},
        capture_output=True,
        text=True,
        timeout=400,
    )


def done(command: list[str], checkout: Path) -> str:
    found = run(command, checkout)
    assert found.returncode == 0, f"{' '.join(command)}: {found.stdout[-2000:]}{found.stderr[-2000:]}"
    return found.stdout + found.stderr


@pytest.mark.slow
def test_the_pages_from_nothing(lab: Path) -> None:
    checkout = lab.parent / "checkout"
    copy_checkout(checkout)
    (through_dvc,) = commands("own-planner.md", "hinterland")
    said = done(through_dvc, checkout)
    assert costs(checkout).keys() == {"optimistic", "learned", "perfect", "known_map", "greedy", "patient"}
    assert costs(checkout)["greedy"] >= costs(checkout)["known_map"]
    assert (checkout / "artifacts/report/cost_table.txt").read_text(encoding="utf-8").strip() in said

    edited_planner_drives_anew(lab / "my_planners" / "greedy.py", checkout)

    # The other pages go on with what this run has drawn, harvested and trained.
    (compare, picture) = commands("own-estimator.md", "python")
    assert "by detours" in done(compare, checkout)
    estimates = pq.read_table(checkout / "artifacts/evaluate/estimates.parquet").to_pandas()
    own = estimates[estimates["competitor"] == "doubt"]
    assert len(own) > 0
    assert set(own["exploration_m"]) == {5.0}
    done(picture, checkout)
    late_refusals(checkout)

    steps = commands("own-system.md", "python")
    broken_system(lab / "detours" / "learning.py", steps[0], checkout)
    for command in steps:
        done(command, checkout)
    assert costs(checkout).keys() == {"optimistic", "detours", "known_map"}
    assert "One number for detours" in (checkout / "artifacts/report/report.html").read_text(encoding="utf-8")


def copy_checkout(checkout: Path) -> None:
    for name in CODE:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, checkout / name)  # compiled kernels too
        else:
            shutil.copy(ROOT / name, checkout / name)
    shutil.copytree(ROOT / ".dvc", checkout / ".dvc", ignore=shutil.ignore_patterns("tmp", "cache", "config.local"))


def edited_planner_drives_anew(planner: Path, checkout: Path) -> None:
    """Edit the planner and repeat the request: it drives with the code of now; what it cannot change is found."""
    before = costs(checkout)
    planner.write_text(planner.read_text(encoding="utf-8").replace("np.argmin", "np.argmax"), encoding="utf-8")
    said = done(["hinterland"], checkout)
    assert "(own); all units are made anew" in said
    assert "(2 were there already)" in said
    after = costs(checkout)
    assert after["greedy"] > before["greedy"]
    assert (after["optimistic"], after["learned"]) == (before["optimistic"], before["learned"])


def broken_system(learning: Path, harvest: list[str], checkout: Path) -> None:
    """A unit of an own harvest that fails in a worker is one sentence, and leaves nothing half done."""
    whole = learning.read_text(encoding="utf-8")
    learning.write_text(whole.replace("rows = []", "rows = [][3]"), encoding="utf-8")
    found = run([*harvest, "execution.workers=2"], checkout)
    assert found.returncode == 1
    assert "error: detours.learning:HARVEST failed: IndexError: list index out of range (learning.py, line 2" in (
        found.stderr
    )
    assert "Traceback" not in found.stderr
    assert not list((checkout / "artifacts/harvest/drives").glob("part-*"))
    learning.write_text(whole, encoding="utf-8")


def late_refusals(checkout: Path) -> None:
    """What is wrong with a part that is made, or asked, is one sentence as well."""
    for page, experiment in (("own-planner.md", "mine"), ("own-estimator.md", "doubt")):
        for given, expected in refusals(page):
            if any(word in expected for word in LATE):
                mine = f"+evaluate.competitors.mine={{{given}}}"
                stage = ["python", "-m", "pipeline.stages.evaluate", "parts=../lab", f"experiment={experiment}", mine]
                found = run(stage, checkout)
                assert found.returncode == 1
                assert "Traceback" not in found.stderr
                sentence = found.stderr.splitlines()[-1]
                assert sentence.startswith("error: evaluate.competitors.mine.")
                assert expected in sentence


def costs(checkout: Path) -> dict[str, float]:
    trials = pq.read_table(checkout / "artifacts/evaluate/trials.parquet").to_pandas()
    return dict(trials.groupby("competitor")["cost_m"].sum())


@pytest.mark.parametrize(
    ("given", "expected"),
    [pair for page in PAGES[:2] for pair in refusals(page) if not any(word in pair[1] for word in LATE)],
)
def test_what_is_wrong_is_one_sentence_before_anything_runs(given: str, expected: str, lab: Path) -> None:
    raw = composed([f"parts={lab}", "experiment=tiny", f"+evaluate.competitors.mine={{{given}}}"])
    find_parts(raw)
    with pytest.raises(HinterlandError) as refusal:
        check(raw)
    assert expected in str(refusal.value)
    assert "evaluate.competitors.mine" in str(refusal.value)


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page_are_accepted(page: str, lab: Path) -> None:
    (command,) = commands(page, "hinterland")
    raw = composed([entry.replace("../lab", str(lab)) for entry in command[1:]])
    find_parts(raw)
    check(raw)


def test_an_own_system_checks_its_own_settings(lab: Path) -> None:
    for override, expected in (
        ("+train.trm=0.2", "unknown key train.trm. Did you mean train.trim?"),
        ("train.trim=0.7", "trim = 0.7: expected from 0 to below 0.5"),
    ):
        raw = composed([f"parts={lab}", "experiment=detours", override])
        find_parts(raw)
        with pytest.raises(HinterlandError) as refusal:
            check(raw)
        assert expected in str(refusal.value)
    with pytest.raises(HinterlandError, match=r"module detours\.system has no 'SYSTM'\. Did you mean SYSTEM\?"):
        find_system("detours.system:SYSTM")
    with pytest.raises(HinterlandError, match=r"detours\.learning:HARVEST is a Harvest, expected a System"):
        find_system("detours.learning:HARVEST")


def test_a_lost_folder_of_parts_is_named(tmp_path: Path) -> None:
    with pytest.raises(HinterlandError, match=r"parts = .*/gone: no such folder\. Expected the folder of your own"):
        composed([f"parts={tmp_path / 'gone'}", "experiment=tiny"])
