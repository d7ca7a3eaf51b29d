"""Keeps what a benchmark run measured as benchmarks/latest.json: figures, and the machine they are of."""

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import pytest

from pipeline.files import write_json

LATEST = Path(__file__).parent / "latest.json"
PACKAGES = ("numpy", "numba", "scipy", "torch", "lightning", "dijkstra3d", "scikit-fmm", "scikit-image",
            "connected-components-3d")  # fmt: skip


def pytest_benchmark_update_json(config: pytest.Config, benchmarks: Any, output_json: dict[str, Any]) -> None:
    """Write the short form of what pytest-benchmark writes at length; called where --benchmark-json is given."""
    figures = {each["fullname"].split("/")[-1]: _figure(each) for each in output_json["benchmarks"]}
    write_json(LATEST, {"machine": machine(), "figures": figures})


def _figure(benchmark: dict[str, Any]) -> dict[str, Any]:
    stats = benchmark["stats"]
    extra = benchmark["extra_info"]
    return {"group": benchmark["group"], "median_s": stats["median"], "min_s": stats["min"], "rounds": stats["rounds"],
            **({"more": extra} if extra else {})}  # fmt: skip


def machine() -> dict[str, Any]:
    """Return what a reader must know of the machine, and nothing that tells whose it is."""
    from cpuinfo import get_cpu_info
    from joblib import cpu_count

    found = {"processor": get_cpu_info().get("brand_raw", "unknown"), "cores": cpu_count(), "system": platform.system()}
    versions = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return {**found, "versions": versions}
