"""Write the tables and the plots of docs/benchmarks.md from the committed figures: python -m benchmarks.page

The text of the page is written by hand; what stands between ``<!-- name -->`` and ``<!-- end -->`` is replaced.
"""

import json
from collections.abc import Callable, Iterable, Sequence
from statistics import median
from typing import Any

from matplotlib.axes import Axes

from benchmarks.compare import BASELINE, HERE, format_time
from pipeline.files import write_text
from pipeline.reports.style import BLUE, GREEN, INK, MUTED, ORANGE, dress, new_figure, save_figure

DOCS = HERE.parent / "docs"
PAGE = DOCS / "benchmarks.md"
END = "<!-- end -->"
PLOTS = DOCS / "images" / "bench-growth.png"
SOLVERS = ("hinterland", "scipy csgraph", "scikit-image MCP", "dijkstra3d", "scikit-fmm")
ENVIRONMENTS = ("maze", "office", "campus", "floors", "fine floors")

Figures = dict[str, Any]


def main() -> None:
    """Replace the tables of the page and draw its plots."""
    write_text(PAGE, filled(PAGE.read_text(encoding="utf-8")))
    _draw(_committed("growth.json"))


def filled(text: str) -> str:
    """Return the text of the page with the tables of the committed figures."""
    bench, growth = _committed(BASELINE.name), _committed("growth.json")
    figures = bench["figures"]
    blocks = {
        "machine": _machine(bench["machine"]),
        "goals": _goals(figures, growth),
        "fields": _fields(figures),
        "kernels": _kernels(figures),
        "trials": _trials(figures),
        "stages": _stages(growth),
        "profile": _profile(_committed("profile.json")),
    }
    for name, block in blocks.items():
        head, mark, rest = text.partition(f"<!-- {name} -->\n")
        assert mark, f"{PAGE.name} has no place for {name}"
        text = f"{head}{mark}{block}\n{rest[rest.index(END) :]}"
    return text


def _committed(name: str) -> Any:
    return json.loads((HERE / name).read_text(encoding="utf-8"))


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def _machine(machine: dict[str, Any]) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    return f"{machine['processor']}, {machine['cores']} cores, {machine['system']}; {versions}."


def _of(figures: Figures, file: str, test: str, *params: str) -> dict[str, Any]:
    return figures[f"test_{file}.py::test_{test}[{'-'.join(params)}]"]


def _goals(figures: Figures, growth: dict[str, Any]) -> str:
    def more(key: str, file: str, test: str, *params: str) -> float:
        return float(_of(figures, file, test, *params)["more"][key])

    def rate(name: str, who: str) -> float:
        return more("trials_per_s", "trials", "trials_per_second", name, who)

    def full(name: str) -> float:
        return 1e3 * float(_of(figures, "fields", "full_field", name, "hinterland")["median_s"])

    training = figures["test_training.py::test_lightning_beside_a_bare_loop"]["more"]
    harvest = rate("maze", "optimistic") / rate("maze", "harvest")
    rows = [
        ("mazes, optimistic [trials/s]", "at least 25", rate("maze", "optimistic")),
        ("mazes, learned [trials/s]", "at least 10", rate("maze", "learned")),
        ("fine MIT floors, optimistic [trials/s]", "at least 3", rate("fine floors", "optimistic")),
        ("fine MIT floors, learned [trials/s]", "at least 1", rate("fine floors", "learned")),
        ("harvest of mazes over the bare drive", "at most 1.2", harvest),
        ("scan and insertion, 256 beams, mazes [ms]", "at most 0.05",
         more("us_per_scan", "scans", "scan_and_insert", "maze 188 x 144", "256") / 1e3),
        ("scan and insertion, 256 beams, empty hall [ms]", "at most 0.05",
         more("us_per_scan", "scans", "scan_and_insert", "hall 300 x 500", "256") / 1e3),
        ("field after a scan, 300 x 500 [ms]", "at most 0.3",
         more("ms_per_scan", "fields", "field_after_each_scan", "rooms 300 x 500", "repaired")),
        ("full field, rooms, 300 x 500 [ms]", "at most 3", full("rooms 300 x 500")),
        ("full field, empty hall, 300 x 500 [ms]", "at most 3", full("hall 300 x 500")),
        ("order of 12 subgoals [ms]", "at most 0.5", more("ms", "ordering", "order", "12")),
        ("order of 20 subgoals [ms]", "at most 300", more("ms", "ordering", "order", "20")),
        ("estimates of 12 subgoals [ms]", "at most 0.2", more("ms", "estimates", "estimate", "12", "hinterland")),
        ("harvest of the most plans below, two workers over one", "at least 1.9", _speedup(growth["plans"])),
        ("evaluation, two workers over one", "at least 1.9", _speedup(growth["trials"])),
        ("memory of the largest process of a harvest [MB]", "at most 500", max(p["mb"] for p in growth["plans"])),
        ("memory of the largest process of an evaluation [MB]", "at most 500", max(p["mb"] for p in growth["trials"])),
        ("Lightning over a bare loop of torch", "at most 1.1", training["ratio"]),
    ]  # fmt: skip
    return _table(
        ("what", "goal", "measured", ""), [(what, goal, f"{got:.3g}", _met(goal, got)) for what, goal, got in rows]
    )


def _met(goal: str, got: float) -> str:
    bound = float(goal.split()[-1])
    return "met" if (got >= bound if goal.startswith("at least") else got <= bound) else "**missed**"


def _speedup(points: list[dict[str, Any]]) -> float:
    one, two = points[-2:]
    return float(one["seconds"] / two["seconds"])


def _fields(figures: Figures) -> str:
    rows = []
    for world in ("maze 188 x 144", "rooms 300 x 500", "hall 300 x 500"):
        times = [_of(figures, "fields", "full_field", world, solver)["median_s"] for solver in SOLVERS]
        rows.append(
            (world, format_time(times[0]), *(f"{format_time(each)} (x {each / times[0]:.1f})" for each in times[1:]))
        )
    return _table(("full distance field", *SOLVERS), rows)


def _kernels(figures: Figures) -> str:
    rows: list[tuple[str, str, str]] = []
    for world in ("maze 188 x 144", "rooms 300 x 500"):
        kept, anew = (
            _of(figures, "fields", "field_after_each_scan", world, how)["more"]["ms_per_scan"]
            for how in ("repaired", "computed anew")
        )
        rows.append((f"field after a scan, {world}", format_time(kept / 1e3), f"computed anew x {anew / kept:.0f}"))
    for world in ("maze 188 x 144", "rooms 300 x 500"):
        ways = {
            way: _of(figures, "frontiers", "frontiers_after_each_scan", world, way)["more"]["ms_per_scan"]
            for way in ("kept", "anew", "scipy label", "connected-components-3d")
        }
        others = ", ".join(f"{way} x {ms / ways['kept']:.1f}" for way, ms in ways.items() if way != "kept")
        rows.append((f"frontiers after a scan, {world}", format_time(ways["kept"] / 1e3), others))
    for count in (1, 3, 12):
        ours, torch = (
            _of(figures, "estimates", "estimate", str(count), who)["median_s"] for who in ("hinterland", "torch")
        )
        rows.append((f"estimates of {count} subgoals", format_time(ours), f"torch x {torch / ours:.1f}"))
    for count in (8, 12, 15, 18, 20):
        found = _of(figures, "ordering", "order", str(count))
        rows.append((f"order of {count} subgoals", format_time(found["median_s"]), "exact"))
    for world in ("maze 188 x 144", "rooms 300 x 500", "hall 300 x 500"):
        times = [
            _of(figures, "scans", "scan_and_insert", world, beams)["more"]["us_per_scan"] for beams in ("256", "1024")
        ]
        rows.append(
            (f"scan and insertion, {world}", format_time(times[0] / 1e6), f"1,024 beams: {format_time(times[1] / 1e6)}")
        )
    return _table(("kernel", "time", "beside it"), rows)


def _trials(figures: Figures) -> str:
    rows = []
    for name in ENVIRONMENTS:
        found = {
            who: _of(figures, "trials", "trials_per_second", name, who)["more"]
            for who in ("optimistic", "learned", "perfect", "harvest")
        }
        cells = []
        for of_one in found.values():
            over = f" (x {of_one['over_reference']:.0f})" if "over_reference" in of_one else ""
            cells.append(f"{of_one['trials_per_s']:.3g}{over}")
        about = found["optimistic"]
        rows.append((about["setting"], f"{about['cells']:,.0f}", f"{about['decisions_per_trial']:.0f}", *cells))
    return _table(("setting", "cells", "decisions", "optimistic", "learned", "true labels", "harvest"), rows)


def _stages(growth: dict[str, Any]) -> str:
    rows = [
        (
            f"{stage}, {p[unit]:,} {unit}",
            p["workers"],
            f"{p['seconds']:.1f}",
            f"{p[unit] / p['seconds']:.1f}",
            f"{p['mb']:.0f}",
        )
        for stage, unit in (("harvest", "plans"), ("evaluation", "trials"))
        for p in growth[unit]
    ]
    return _table(("stage", "workers", "seconds", "per second", "largest process [MB]"), rows)


def _profile(profile: dict[str, dict[str, float]]) -> str:
    names = sorted(
        {name for shares in profile.values() for name in shares},
        key=lambda n: -max(s.get(n, 0) for s in profile.values()),
    )
    rows = [
        (f"`{name}`", *(f"{shares[name]:.0%}" if name in shares else "" for shares in profile.values()))
        for name in names
    ]
    return _table(("kernel", *profile), rows)


def _draw(growth: dict[str, Any]) -> None:
    figure = new_figure(11.0, 7.2)
    panels: list[Callable[[Axes, list[dict[str, Any]]], None]] = [_by_area, _by_subgoals, _by_beams, _by_plans]
    for axes, draw, name in zip(
        figure.subplots(2, 2).flat, panels, ("area", "subgoals", "beams", "plans"), strict=True
    ):
        draw(axes, growth[name])
    save_figure(figure, PLOTS, dpi=100)


def _by_area(axes: Axes, points: list[dict[str, Any]]) -> None:
    for planner, label, colour in (("optimistic", "optimistic", ORANGE), ("subgoals", "subgoals, true labels", BLUE)):
        cells = sorted({p["cells"] for p in points if p["planner"] == planner})
        times = [[p["ms"] for p in points if p["planner"] == planner and p["cells"] == count] for count in cells]
        axes.plot(cells, [median(ms) for ms in times], "o-", color=colour, label=label)
    _logarithmic(axes)
    dress(axes, x="area of the map [cells]", y="time for one step [ms]", title="Whole trials in mazes, lidar of 18 m")
    axes.legend(frameon=False, fontsize=9)


def _by_subgoals(axes: Axes, points: list[dict[str, Any]]) -> None:
    seen = [p for p in points if p["decisions"] >= 20]
    axes.plot([p["subgoals"] for p in seen], [p["ms"] for p in seen], "o", color=GREEN)
    axes.set_ylim(bottom=0)
    dress(
        axes, x="subgoals around the robot", y="time for a decision [ms]", title="Decisions on furnished campus floors"
    )


def _by_beams(axes: Axes, points: list[dict[str, Any]]) -> None:
    axes.plot([p["beams"] for p in points], [p["us"] for p in points], "o-", color=BLUE)
    _logarithmic(axes)
    dress(axes, x="beams", y="scan and insertion [us]", title="Scans in rooms, range of 60 cells")


def _by_plans(axes: Axes, points: list[dict[str, Any]]) -> None:
    memory = axes.twinx()
    for workers, colour in ((1, BLUE), (2, GREEN)):
        mine = [p for p in points if p["workers"] == workers]
        plans = [p["plans"] for p in mine]
        axes.plot(
            plans, [p["seconds"] for p in mine], "o-", color=colour, label=f"{workers} worker{'s'[: workers - 1]}"
        )
        memory.plot(plans, [p["mb"] for p in mine], "s:", color=colour, markersize=4)
    _logarithmic(axes)
    dress(axes, x="plans", y="harvest [s]", title="The stage harvest; dotted: largest process")
    memory.set_ylim(0, 600)
    memory.set_ylabel("memory [MB]", color=INK, fontsize=10)
    memory.tick_params(colors=MUTED, labelsize=9)
    for side in memory.spines.values():
        side.set_visible(False)
    axes.legend(frameon=False, fontsize=9)


def _logarithmic(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")


if __name__ == "__main__":
    main()
