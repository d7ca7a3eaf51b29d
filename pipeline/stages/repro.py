"""The command ``hinterland``: check the whole configuration, run all stages through DVC, say what came out."""

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from omegaconf import DictConfig, OmegaConf

from pipeline.errors import HinterlandError, one_line
from pipeline.files import write_text
from pipeline.parts import add_to_path
from pipeline.stages.compose import NO_PARTS, check, checked_request, system_folder, watched_data
from pipeline.stages.composing import CONF, composed
from pipeline.stages.door import refuse
from pipeline.stages.recording import tracker
from pipeline.stages.requests import described, fallbacks, last_request, requested, trying
from pipeline.stages.stopping import Stopped, ending_by_signal, run_below
from pipeline.tracking import RUN_VARIABLE, forget_outages, kept, known_outage

_ARTIFACTS = Path("artifacts")

_USAGE = """Usage: hinterland [experiment=NAME] [key=value ...] [-- dvc repro options]

Runs compose -> plans -> rasterize -> harvest -> train -> evaluate -> report through `dvc repro`: only what changed
since the last run is run again. Without arguments it runs the last request again, which params.yaml holds; arguments
change it: what they do not name stays. experiment=NAME starts anew. A request that is refused is not kept.

Experiments: {experiments}

  hinterland                                          the last request again: does nothing if nothing changed
  hinterland experiment=guided_maze train.steps=5000  another experiment, one value changed
  hinterland train.steps=9000                         the last experiment, that value changed, the others as they were
  hinterland ~train.steps                             that change taken back
  hinterland train.steps=9 -- --dry                   what would run; nothing is kept
  hinterland experiment=mit_floors plans.root=DIR     real floors
  hinterland evaluate NETWORK FLOORS                  a trained network on other floors, nothing trained: see --help
  hinterland plan --help                              look at floor plans, convert them, list the formats
  python -m pipeline.stages.harvest --help            one stage, and every key of the configuration
"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 when all stages are done, 1 with one line when something is refused."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if any(flag in given for flag in ("-h", "--help")):
        print(_USAGE.format(experiments=", ".join(sorted(file.stem for file in (CONF / "experiment").glob("*.yaml")))))
        return
    overrides, dvc_options = _split(given)
    try:
        os.chdir(CONF.parent)
        with ending_by_signal():
            code = _run(overrides, dvc_options)
    except (HinterlandError, OSError) as error:
        refuse(error)
    except KeyboardInterrupt as stop:
        print("\nstopped, with all stages below: run hinterland again to continue", file=sys.stderr)
        code = stop.exit_code if isinstance(stop, Stopped) else 130
    sys.exit(code)


def _run(overrides: Sequence[str], dvc_options: Sequence[str]) -> int:
    """Run what ``overrides`` ask for; return the exit code. A refused request and a dry one leave params.yaml alone."""
    last = last_request()
    request = requested(overrides, last) if overrides else checked_request(last)
    if request.parts != NO_PARTS:
        add_to_path(Path(request.parts))
    raw = composed(request.as_overrides())
    check(raw)
    request = replace(request, system=system_folder(raw), data=watched_data(raw, request))
    for line in (*fallbacks(overrides, raw, request), described(request, last)):
        print(f"hinterland: {one_line(line)}", flush=True)
    dry = "--dry" in dvc_options
    with trying(request) as trial:
        try:
            code = reproduce(dvc_options)
        except KeyboardInterrupt:
            trial.keep = not dry
            raise
        # A stage that fails after compose is the request's own: it is what runs again once the cause is mended.
        trial.keep = not dry and (code == 0 or _begun(raw))
    if code == 0 and not dry:
        print(closing_words(raw) if _all_done(dvc_options) else "(not all stages are up to date: no table yet)")
    return code


def _begun(raw: DictConfig) -> bool:
    written = _ARTIFACTS / "config.yaml"
    return written.is_file() and written.read_text(encoding="utf-8") == OmegaConf.to_yaml(raw, resolve=True)


def _all_done(dvc_options: Sequence[str]) -> bool:
    """Return whether the table belongs to this request: with options or targets, DVC may have run a part."""
    if not dvc_options:
        return True
    asked = [sys.executable, "-m", "dvc", "status", "--quiet", "--with-deps", "report"]
    return subprocess.run(asked, env=environment(), capture_output=True).returncode == 0


def reproduce(options: Sequence[str] = ()) -> int:
    """Run ``dvc repro`` with the Python of this process first on the path; return its exit code."""
    without_git = subprocess.run(["git", "rev-parse", "--git-dir"], capture_output=True).returncode != 0
    if without_git:
        # An exported tree: DVC otherwise refuses to work outside git.
        write_text(Path(".dvc/config.local"), "[core]\n    no_scm = true\n")
    return run_below([sys.executable, "-m", "dvc", "repro", *options], environment())


def environment() -> dict[str, str]:
    """Return the environment of the stages below: this Python first, no telemetry, one run for the tracking store."""
    return os.environ | {
        "PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", ""))),
        "DVC_NO_ANALYTICS": "1",
        "MLFLOW_DISABLE_TELEMETRY": "true",
        RUN_VARIABLE: os.environ.setdefault(RUN_VARIABLE, f"{os.getpid()}x{time.time_ns()}"),
    }


def closing_words(raw: DictConfig) -> str:
    """Return the cost table and where the report, the figures and the tracking store are."""
    folder = _ARTIFACTS / "report"
    table, page = folder / "cost_table.txt", folder / "report.html"
    places = [f"report   {page.resolve()}", f"figures  {(folder / 'figures').resolve()}"]
    lines = [
        table.read_text(encoding="utf-8").rstrip() if table.exists() else f"(no {table}: nobody was compared)",
        "",
        *(places if page.exists() else ()),
        *_where_runs_are(raw),
    ]
    return "\n".join(lines)


def _where_runs_are(raw: DictConfig) -> list[str]:
    destination = tracker(raw)
    if destination is None:
        return ["MLflow   off (tracking.enabled=false)"]
    lines = [f"MLflow   {destination.shown}   look at it with: make ui"]
    if reason := known_outage(destination.spool):
        lines[0] = f"MLflow   {destination.shown} did not take the runs ({reason})"
    if waiting := kept(destination.spool):
        lines.append(f"         {len(waiting)} runs that no store took are kept in {destination.spool.resolve()}")
    forget_outages(destination.spool)
    return lines


def _split(given: Sequence[str]) -> tuple[list[str], list[str]]:
    if "--" not in given:
        return list(given), []
    place = list(given).index("--")
    return list(given[:place]), list(given[place + 1 :])
