"""The command ``hinterland evaluate``: a trained network on other floors, without harvest and training."""

import hashlib
import json
import os
import re
import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from pipeline.errors import ConfigError, HinterlandError, one_line
from pipeline.files import digest_file
from pipeline.learning.provenance import made_with_of
from pipeline.stages.compose import check
from pipeline.stages.composing import CONF, composed, quoted
from pipeline.stages.door import refuse
from pipeline.stages.networks import local_network
from pipeline.stages.repro import environment
from pipeline.stages.stopping import Stopped, ending_by_signal, run_below
from pipeline.tracking import is_stored

STAGES = ("plans", "rasterize", "evaluate", "report")
FOLDER = Path("artifacts/evaluations")
TAKEN = ("sensor", "robot", "rasterize.resolution_m")
"""Sections and keys that a network carries with it: how the robot sees and moves, and the size of a cell."""
GIVEN = {"plans.root": "FLOORS", "evaluate.network": "NETWORK"}
_WITHOUT_EFFECT = ("execution", "tracking", "report", "artifacts")

_HELP = """NETWORK
  a file               network.safetensors of a training (artifacts/train), also one that was sent to you
  models:/NAME@ALIAS   a model registered in MLflow, also models:/NAME/VERSION
  RUN                  the id of an MLflow run of the stage train

FLOORS
  a folder, a file or an archive of floor plans in any format (`hinterland plan formats`); all are tested on

Runs compose -> plans -> rasterize -> evaluate -> report in artifacts/evaluations/NAME, and prints the cost table and
where the report is. The settings are those of experiment=floors, except that sensor, robot and size of a cell are the
network's own. NAME follows from network, floors and what is changed: the same command continues a stopped run.

examples:
  hinterland evaluate artifacts/train/network.safetensors /data/our_campus
  hinterland evaluate models:/corridors@champion /data/our_campus rasterize.min_distance_m=10
  hinterland evaluate sent.safetensors floor.dxf plans.read.metres_per_unit=0.001 sensor.max_range_m=8
  hinterland evaluate b4b0c1f2a9e84f6d8a3c5b7e9d1f2a3c /data/our_campus artifacts=/tmp/other execution.workers=4
"""


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """What is to be run.

    overrides: of the composition, artifacts among them. folder: where all goes. remarks: what the user has to know.
    """

    overrides: list[str]
    folder: Path
    remarks: list[str]


def main(arguments: Sequence[str]) -> int:
    """Run ``hinterland evaluate`` with these arguments; return 0, or 1 after one line that says what is wrong."""
    given = _parser().parse_args(list(arguments))
    here = Path.cwd()
    try:
        os.chdir(CONF.parent)
        with ending_by_signal():
            evaluation = prepared(_found(given.network, here), _floors(given.floors, here), given.overrides)
            for remark in evaluation.remarks:
                print(f"warning: {one_line(remark)}", file=sys.stderr)
            print(f"evaluation in {evaluation.folder.resolve()}", flush=True)
            return _run(evaluation)
    except (HinterlandError, OSError) as error:
        refuse(error)
    except KeyboardInterrupt as stop:
        print("\nstopped: the same command continues", file=sys.stderr)
        return stop.exit_code if isinstance(stop, Stopped) else 130
    return 1


def prepared(network: str, floors: Path, overrides: Sequence[str]) -> Evaluation:
    """Return what evaluates ``network`` on ``floors``, checked as a whole before anything runs.

    Raises:
        ConfigError, TableError: no such network, no network, or a setting that any stage would refuse.
    """
    keys = _keys(overrides)
    experiment = [] if "experiment" in keys else ["experiment=floors"]
    base = [*experiment, "plans.split=test", *overrides, f"plans.root={quoted(str(floors))}"]
    raw = composed(base)
    weights = local_network(network, raw, FOLDER / "networks", "NETWORK")
    taken, remarks = taken_over(made_with_of(weights), raw, keys)
    folder = Path(raw.artifacts) if "artifacts" in keys else FOLDER / _name(weights, floors, overrides)
    # What is asked for wins: it comes after what the network brings.
    final = [*experiment, "plans.split=test", *taken, *overrides, *base[-1:]]
    final += [f"evaluate.network={quoted(str(weights.resolve()))}", f"artifacts={quoted(str(folder))}"]
    check(composed(final))
    return Evaluation(overrides=final, folder=folder, remarks=remarks)


def taken_over(made_with: Mapping[str, Any], raw: DictConfig, keys: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return as overrides what the network brings of sensor, robot and resolution, and remarks on what it does not.

    made_with: what its file says, by whole names. raw: the configuration without it. keys: what the user sets.
    """
    known = {name: OmegaConf.select(raw, name) for part in TAKEN for name in _leaves(raw, part)}
    brought = {name: value for name, value in made_with.items() if any(_within(name, part) for part in TAKEN)}
    if not brought:
        return [], ["The network does not say what it was made with: sensor, robot and cells are the experiment's."]
    taken, remarks = [], []
    for name, value in sorted(brought.items()):
        asked = next((key for key in keys if _within(name, key)), None)
        if name not in known:
            remarks.append(f"The network was made with {name} = {value}, which this version does not know: left out.")
        elif asked is not None:
            if known[name] != value:
                remarks.append(f"{name} = {known[name]} as asked for; the network was made with {value}.")
        elif name == "rasterize.resolution_m" and isinstance(value, list):
            remarks.append(f"The network was made with cells of {value} m; these trials have {known[name]} m.")
        else:
            taken.append(f"{name}={json.dumps(value)}")
    return taken, remarks  # of what it does not say, the evaluate stage tells


def _run(evaluation: Evaluation) -> int:
    """Run the stages one after the other; return the exit code of the first that fails, which has said why."""
    python = [sys.executable, "-m"]
    commands = [[*python, "pipeline.stages.compose", *evaluation.overrides]]
    composed_file = str(evaluation.folder / "config.yaml")
    commands += [[*python, f"pipeline.stages.{stage}", "--config", composed_file] for stage in STAGES]
    for command in commands:
        if code := run_below(command, environment()):
            return code
    return 0


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        prog="hinterland evaluate",
        description="Drive with a trained network through other floors: nothing is harvested or trained.",
        epilog=_HELP,
        formatter_class=RawDescriptionHelpFormatter,
    )
    parser.add_argument("network", metavar="NETWORK", help="a file, models:/NAME@ALIAS, or the id of a training's run")
    parser.add_argument("floors", metavar="FLOORS", help="a folder, a file or an archive of floor plans")
    text = "settings to change, as for `hinterland`"
    parser.add_argument("overrides", metavar="key=value", nargs="*", help=text)
    return parser


def _keys(overrides: Sequence[str]) -> list[str]:
    """Return what ``overrides`` set; refuse what is none, and what the command line says already."""
    for entry in overrides:
        key = entry.partition("=")[0].lstrip("+~")
        if "=" not in entry and not entry.startswith("~"):
            raise ConfigError(f"{entry!r} is not an override: expected key=value after NETWORK and FLOORS")
        if key in GIVEN:
            raise ConfigError(f"{entry}: {GIVEN[key]} says that already. Take one of them out")
    return [entry.partition("=")[0].lstrip("+~") for entry in overrides]


def _found(network: str, here: Path) -> str:
    """Return ``network`` as an absolute path if it is one seen from ``here``, else as it is."""
    return network if is_stored(network) or not (here / network).is_file() else str((here / network).resolve())


def _floors(given: str, here: Path) -> Path:
    """Return the floors, seen from ``here``, else from the root of the checkout."""
    for place in (here / given, CONF.parent / given):
        if place.exists():
            return place.resolve()
    raise ConfigError(f"FLOORS = {given}: no such folder, file or archive. Expected the floor plans to drive through")


def _name(network: Path, floors: Path, overrides: Sequence[str]) -> str:
    """Return the name of the folder: of the floors, the network, and of all that makes other trials."""
    changes = sorted(entry for entry in overrides if entry.partition("=")[0].partition(".")[0] not in _WITHOUT_EFFECT)
    place = re.sub(r"[^A-Za-z0-9_-]+", "_", "-".join(floors.parts[-2:]).strip("/"))[-40:]
    apart = hashlib.sha256("\x1f".join([str(floors), *changes]).encode()).hexdigest()
    return f"{place}-{digest_file(network)[:8]}-{apart[:4]}"


def _within(name: str, part: str) -> bool:
    return name == part or name.startswith(f"{part}.")


def _leaves(raw: DictConfig, part: str) -> list[str]:
    found = OmegaConf.select(raw, part)
    return [f"{part}.{key}" for key in found] if OmegaConf.is_dict(found) else [part]
