import json
import sys

import pytest
from rich.console import Console

from benchmarks.compare import against, format_time, main, rivals


def figure(group: str, seconds: float) -> dict:
    return {"group": group, "median_s": seconds, "min_s": seconds, "rounds": 5}


def run(scale: float, **changes: float) -> dict:
    times = {"t.py::f[hall-hinterland]": 0.002, "t.py::f[hall-dijkstra3d]": 0.01} | changes
    return {"figures": {name: figure("full field: hall", scale * seconds) for name, seconds in times.items()}}


def shown(table) -> str:
    console = Console(width=200)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


def test_rivals_are_stated_as_multiples_of_ours():
    assert "hinterland 2 ms" in shown(rivals(run(1.0)["figures"]))
    assert "dijkstra3d 5" in shown(rivals(run(1.0)["figures"]))


@pytest.mark.parametrize(
    ("scale", "change", "beside"), [(3.0, {}, "1.00"), (1.0, {"t.py::f[hall-hinterland]": 0.004}, "2.00")]
)
def test_a_slower_machine_is_told_from_slower_code(scale, change, beside):
    (line,) = [row for row in shown(against(run(scale, **change), run(1.0))).splitlines() if "hall-hinterland" in row]
    assert beside in line.split()


def test_without_a_baseline_the_run_alone_is_shown_and_may_be_kept(tmp_path, monkeypatch, capsys):
    latest, baseline = tmp_path / "latest.json", tmp_path / "baseline.json"
    latest.write_text(json.dumps(run(1.0)))
    monkeypatch.setattr(sys, "argv", ["compare", str(latest), str(baseline)])
    main()
    assert "against the baseline" not in capsys.readouterr().out


@pytest.mark.parametrize(("seconds", "text"), [(2.5, "2.5 s"), (0.0301, "30.1 ms"), (4e-5, "40 us"), (2e-8, "20 ns")])
def test_times_have_a_fitting_unit(seconds, text):
    assert format_time(seconds) == text
