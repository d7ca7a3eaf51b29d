"""Put two benchmark runs beside each other: python -m benchmarks.compare [LATEST [BASELINE]] [--keep]

Machines differ, and so does one machine from hour to hour. So the ratio of each figure is also shown against that of
the public packages in the same two runs, whose code did not change: above 1, ours became slower.
"""

import argparse
import json
import shutil
from pathlib import Path
from statistics import geometric_mean
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

HERE = Path(__file__).parent
BASELINE = HERE / "baseline.json"
YARDSTICKS = ("scipy csgraph", "scikit-image MCP", "dijkstra3d", "scikit-fmm", "scipy label", "connected-components-3d")


def main() -> None:
    """Print the comparison; --keep makes the latest run the baseline."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("latest", type=Path, nargs="?", default=HERE / "latest.json")
    parser.add_argument("baseline", type=Path, nargs="?", default=BASELINE)
    parser.add_argument("--keep", action="store_true", help="make LATEST the committed baseline")
    given = parser.parse_args()
    latest = json.loads(given.latest.read_text(encoding="utf-8"))
    if given.keep:
        shutil.copy(given.latest, BASELINE)
    baseline = json.loads(given.baseline.read_text(encoding="utf-8")) if given.baseline.exists() else {"figures": {}}
    console = Console(width=150)
    console.print(rivals(latest["figures"]))
    if baseline["figures"]:
        console.print(against(latest, baseline))


def rivals(figures: dict[str, Any]) -> Table:
    """Return how many times as long each alternative takes as ours, by group."""
    table = Table("group", "ours", "alternatives: times as long", title="in this run, medians")
    for group in sorted({each["group"] for each in figures.values() if each["group"]}):
        members = {name: each for name, each in figures.items() if each["group"] == group}
        ours = min(members, key=lambda name: (not any(word in name for word in OURS), name))
        if not any(word in ours for word in OURS) or len(members) < 2:
            continue
        base = members[ours]["median_s"]
        others = [f"{_label(name)} {each['median_s'] / base:.2g}" for name, each in members.items() if name != ours]
        table.add_row(group, f"{_label(ours)} {format_time(base)}", ", ".join(others))
    return table


def against(latest: dict[str, Any], baseline: dict[str, Any]) -> Table:
    """Return each figure beside that of the baseline."""
    new, old = latest["figures"], baseline["figures"]
    shared = [name for name in new if name in old]
    marks = [new[name]["median_s"] / old[name]["median_s"] for name in shared if any(y in name for y in YARDSTICKS)]
    pace = geometric_mean(marks) if marks else 1.0
    title = f"against the baseline; public packages take {pace:.2f} times as long as then (other machine, or busier)"
    table = Table("benchmark", "now", "baseline", "now / baseline", "beside public packages", title=title)
    for name in sorted(shared):
        ratio = new[name]["median_s"] / old[name]["median_s"]
        table.add_row(
            escape(name),
            format_time(new[name]["median_s"]),
            format_time(old[name]["median_s"]),
            f"{ratio:.2f}",
            f"{ratio / pace:.2f}",
        )
    return table


OURS = ("hinterland", "repaired", "kept", "optimistic", "lightning")


def _label(name: str) -> str:
    return name.partition("[")[2].rstrip("]").split("-")[-1] if "[" in name else name.partition("::")[2]


def format_time(seconds: float) -> str:
    for unit, scale in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


if __name__ == "__main__":
    main()
