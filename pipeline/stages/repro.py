"""The command ``hinterland``: check the whole configuration, run all stages through DVC, say what came out."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

from pipeline.errors import ConfigError, HinterlandError
from pipeline.files import write_text
from pipeline.stages.checking import near_miss
from pipeline.stages.compose import NO_DATA, PARAMS, Request, check, checked_request
from pipeline.stages.composing import CONF, composed
from pipeline.stages.door import refuse
from pipeline.stages.recording import tracker

_USAGE = """Usage: hinterland [experiment=NAME] [key=value ...] [-- dvc repro options]

Runs compose -> plans -> rasterize -> harvest -> train -> evaluate -> report through `dvc repro`: only what changed
since the last run is run again. Without arguments it runs what params.yaml asks for; arguments are written there.

Experiments: {experiments}

  hinterland                                          the last request again: does nothing if nothing changed
  hinterland experiment=guided_maze train.steps=5000  another experiment, one value changed
  hinterland experiment=mit_floors plans.root=DIR     real floors
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
        request = requested(overrides) if overrides else None
        if request is not None:
            check(composed(request.as_overrides()))
            write_request(request)
        code = reproduce(dvc_options)
        if code == 0:
            print(closing_words())
    except HinterlandError as error:
        refuse(error)
    except KeyboardInterrupt:
        print("\ninterrupted: run hinterland again to continue", file=sys.stderr)
        code = 130
    sys.exit(code)


def requested(overrides: Sequence[str]) -> Request:
    """Return what command line ``overrides`` ask for: ``experiment`` and ``plans.root`` have keys of their own."""
    rest, found = [], {"experiment": "demo", "plans.root": NO_DATA}
    for entry in overrides:
        key, equals, value = entry.partition("=")
        if not equals and not entry.startswith("~"):
            raise ConfigError(f"{entry!r} is not an override: expected key=value.{near_miss(entry, ['--help', '--'])}")
        if key in found:
            found[key] = value.strip("'\"")
        else:
            rest.append(entry)
    return checked_request(Request(experiment=found["experiment"], overrides=rest, data=found["plans.root"]))


def write_request(request: Request) -> None:
    """Write ``request`` to params.yaml, keeping the comment at its head; an equal file stays untouched."""
    before = PARAMS.read_text(encoding="utf-8") if PARAMS.exists() else ""
    content = {"experiment": request.experiment, "overrides": list(request.overrides), "data": request.data}
    if yaml.safe_load(before or "{}") == content:
        return
    head = "".join(f"{line}\n" for line in before.splitlines() if line.startswith("#"))
    write_text(PARAMS, head + yaml.safe_dump(content, sort_keys=False))


def reproduce(options: Sequence[str] = ()) -> int:
    """Run ``dvc repro`` with the Python of this process first on the path; return its exit code."""
    environment = os.environ | {
        "PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", ""))),
        "DVC_NO_ANALYTICS": "1",
        "MLFLOW_DISABLE_TELEMETRY": "true",
    }
    without_git = subprocess.run(["git", "rev-parse", "--git-dir"], capture_output=True).returncode != 0
    if without_git:
        # An exported tree: DVC otherwise refuses to work outside git.
        write_text(Path(".dvc/config.local"), "[core]\n    no_scm = true\n")
    return subprocess.run([sys.executable, "-m", "dvc", "repro", *options], env=environment).returncode


def closing_words() -> str:
    """Return the cost table and where the report, the figures and the tracking store are."""
    root = Path("artifacts")
    table = root / "report" / "cost_table.txt"
    destination = tracker(composed(_last_request().as_overrides()))
    lines = [
        table.read_text(encoding="utf-8").rstrip() if table.exists() else f"(no {table} yet)",
        "",
        f"report   {(root / 'report' / 'report.html').resolve()}",
        f"figures  {(root / 'report' / 'figures').resolve()}",
        f"MLflow   {destination.uri if destination else 'off (tracking.enabled=false)'}   look at it with: make ui",
    ]
    return "\n".join(lines)


def _last_request() -> Request:
    return Request(**yaml.safe_load(PARAMS.read_text(encoding="utf-8")))


def _split(given: Sequence[str]) -> tuple[list[str], list[str]]:
    if "--" not in given:
        return list(given), []
    place = list(given).index("--")
    return list(given[:place]), list(given[place + 1 :])
