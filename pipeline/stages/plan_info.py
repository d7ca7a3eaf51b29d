"""``hinterland plan info``: what is in a plan, what is odd about it, and how it looks."""

import json
import sys
from argparse import Namespace
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.errors import ConfigError, PlanError, printable
from pipeline.floorplans.openings import NARROWEST_DOOR_M
from pipeline.floorplans.plan import FREE, FloorPlan, GridPlan, bounds_of, without_margins
from pipeline.stages.plan_files import Found, file_name, keep_existing, plan_files, read_file
from pipeline.stages.plan_options import in_flags, read_options

_UNNAMED = "unnamed"
_MOST_LABELS = 8


def info(given: Namespace) -> int:
    """Print what is in each plan, draw it where asked; return 1 where a file or plan cannot be used.

    Raises:
        PlanError, ConfigError: nothing there to read, or the picture cannot be placed.
    """
    draw = Path(given.draw) if given.draw else None
    options = read_options(given)
    with plan_files(Path(given.source), given.reader) as entries:
        found = chain.from_iterable(read_file(entry, options) for entry in entries)
        told = _drawn(found, draw, force=given.force) if draw else found
        return _tell_json(told) if given.json else _tell(told)


def record_of(found: Found) -> dict[str, Any]:
    """Return what is known of a plan as JSON has it: lengths in metres, areas in square metres."""
    plan, report = found.plan, found.report
    known = bounds_of(without_margins(plan))
    widths = [door.width for door in plan.doors]
    record = {
        "plan": plan.plan_id,
        "file": found.file,
        "format": found.reader,
        "building": plan.building,
        "floor": plan.floor,
        "environment": plan.environment,
        "source": plan.source,
        "width_m": round(report.width_m, 3),
        "height_m": round(report.height_m, 3),
        "known_m": [round(known.max_x - known.min_x, 3), round(known.max_y - known.min_y, 3)],
        "kind": "grid" if isinstance(plan, GridPlan) else "geometry",
        "rooms": rooms_of(plan),
        "doors": len(widths),
        "doors_without_leaf": sum(not door.leaf for door in plan.doors),
        "door_widths_m": [round(min(widths), 3), round(max(widths), 3)] if widths else None,
        "free_m2": round(_free_area(plan), 2),
        "free_components": report.free_components,
        "largest_free_share": round(report.largest_free_share, 4),
        "narrowest_m": report.narrowest_door_m,
        "narrowest_is": "door" if any(width >= NARROWEST_DOOR_M for width in widths) else "passage",
        "remarks": list(plan.remarks),
        "warnings": list(report.warnings),
    }
    if isinstance(plan, GridPlan):
        record |= {"resolution_m": plan.resolution, "rows": plan.cells.shape[0], "cols": plan.cells.shape[1]}
        record["layers"] = sorted(plan.layers)
    return record


def rooms_of(plan: FloorPlan | GridPlan) -> dict[str, int]:
    """Return how many rooms have each label, the most frequent first; a grid has them in its layer "rooms"."""
    if isinstance(plan, FloorPlan):
        labels = [room.label for room in plan.rooms]
    elif "rooms" in plan.layers:
        layer = plan.layers["rooms"]
        numbers = np.unique(layer.values[layer.values > 0]).tolist()
        labels = [layer.labels.get(number, "") for number in numbers]
    else:
        labels = []
    counts = Counter(label or _UNNAMED for label in labels)
    return dict(sorted(counts.items(), key=lambda entry: (-entry[1], entry[0])))


def text_of(record: dict[str, Any]) -> str:
    """Return a record of `record_of` as lines for a person."""
    grid = record["kind"] == "grid"
    scale = "geometry in metres"
    if grid:
        scale = f"{record['resolution_m']:g} m per cell, {record['rows']} rows x {record['cols']} columns"
    size = f"{record['width_m']:.2f} x {record['height_m']:.2f} m"
    if record["known_m"] != [record["width_m"], record["height_m"]]:
        size += ", of which {:.2f} x {:.2f} m are known".format(*record["known_m"])
    floor = "" if record["floor"] == record["plan"] else f", floor {record['floor']}"
    parts = record["free_components"]
    largest = "" if parts == 1 else f", the largest holds {record['largest_free_share']:.1%}"
    narrowest = "none" if record["narrowest_m"] is None else f"{record['narrowest_m']:.2f} m ({record['narrowest_is']})"
    lines = [
        ("format", f"{record['format']}, from {record['source']}"),
        ("size", size),
        ("scale", scale),
        ("building", f"{record['building']}{floor}, environment {record['environment']}"),
        ("rooms", _rooms(record["rooms"])),
        ("doors", _doors(record)),
        ("free floor", f"{record['free_m2']:.1f} m2 in {parts} {'part' if parts == 1 else 'parts'}{largest}"),
        ("narrowest", narrowest),
        *_listed("warnings", record["warnings"]),
        *_listed("remarks", record["remarks"]),
    ]
    if grid and record["layers"]:
        lines.insert(3, ("layers", ", ".join(record["layers"])))
    return "\n".join(
        [f"plan {printable(record['plan'])}", *(f"  {name:<11} {printable(text)}" for name, text in lines)]
    )


def _rooms(rooms: dict[str, int]) -> str:
    if not rooms:
        return "none outlined"
    if list(rooms) == [_UNNAMED]:
        return f"{rooms[_UNNAMED]} without labels"
    shown = [f"{count} {label}" for label, count in islice(rooms.items(), _MOST_LABELS)]
    more = [f"{len(rooms) - _MOST_LABELS} more labels"] if len(rooms) > _MOST_LABELS else []
    return f"{sum(rooms.values())}: {', '.join(shown + more)}"


def _doors(record: dict[str, Any]) -> str:
    if not record["doors"]:
        return "none marked"
    low, high = record["door_widths_m"]
    widths = f"{low:.2f} m wide" if low == high else f"{low:.2f} to {high:.2f} m wide"
    bare = record["doors_without_leaf"]
    return f"{record['doors']}, {widths}" + (f", {bare} without a leaf" if bare else "")


def _listed(name: str, sentences: list[str]) -> list[tuple[str, str]]:
    """Return one line for each sentence, the name before the first."""
    return [(name if k == 0 else "", in_flags(sentence)) for k, sentence in enumerate(sentences or ["none"])]


def _free_area(plan: FloorPlan | GridPlan) -> float:
    if isinstance(plan, FloorPlan):
        return float(plan.free.area)
    return float(np.count_nonzero(plan.cells == FREE)) * plan.resolution**2


def _tell(found: Iterable[Found | PlanError]) -> int:
    plans, warned, refused = 0, 0, 0
    for each in found:
        if isinstance(each, PlanError):
            refused += 1
            print(f"error: {in_flags(str(each))}", file=sys.stderr)
            continue
        record = record_of(each)
        print(("\n" if plans else "") + text_of(record))
        plans, warned = plans + 1, warned + bool(record["warnings"])
    if plans + refused > 1:
        print(f"\n{plans} {'plan' if plans == 1 else 'plans'}, {warned} with warnings, {refused} refused")
    return int(refused > 0 or plans == 0)


def _tell_json(found: Iterable[Found | PlanError]) -> int:
    """Print one array, an object a line, so that it can be read while it grows."""
    refused, begun = 0, False
    for each in found:
        if isinstance(each, PlanError):
            refused += 1
            print(f"error: {in_flags(str(each))}", file=sys.stderr)
            continue
        print(("," if begun else "[") + "\n" + json.dumps(record_of(each), allow_nan=False), end="")
        begun = True
    print("\n]" if begun else "[]")
    return int(refused > 0 or not begun)


def _drawn(found: Iterable[Found | PlanError], draw: Path, *, force: bool) -> Iterator[Found | PlanError]:
    """Draw each plan to ``draw``, a PNG for a single plan or else a folder, and yield it once it is drawn."""
    from pipeline.reports.plan_picture import write_plan_picture

    single = draw.suffix.lower() == ".png" and not draw.is_dir()
    taken: set[str] = set()
    for each in _only_one(found, draw) if single else found:
        if isinstance(each, Found):
            target = draw if single else draw / file_name(each.plan, ".png", taken)
            keep_existing([target], force=force)
            write_plan_picture(each.plan, each.report, target)
        yield each


def _only_one(found: Iterable[Found | PlanError], draw: Path) -> list[Found | PlanError]:
    """Return what was found; refuse a second plan before the first is drawn."""
    kept: list[Found | PlanError] = []
    for each in found:
        kept.append(each)
        if sum(isinstance(one, Found) for one in kept) > 1:
            raise ConfigError(f"--draw {draw}: there are several plans to draw. Name a folder, or choose with --level.")
    return kept
