"""Count lines, package by package, before and after: `python benchmarks/lines.py 213757b HEAD`.

Counts what git holds at two revisions: Python under pipeline/, models/ and tests/, YAML under conf/. A package's
longest and median file tell whether it grew by files or by long files. The ladder is what every system
stands on: the packages of pipeline/ that belong neither to one system nor to one file format.
"""

import statistics
import subprocess
import sys
from collections import defaultdict
from pathlib import PurePosixPath

COUNTED = ("pipeline/*.py", "models/*.py", "tests/*.py", "conf/*.yaml")
LADDER = ("grids", "planning", "simulation", "datums", "evaluation", "learning", "tracking", "reports", "stages")


def count_lines(revision: str) -> dict[str, int]:
    """Return the number of lines of each counted file at ``revision``, by path."""
    command = ["git", "grep", "-c", "", revision, "--", *COUNTED]
    listed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    rows = (line.removeprefix(f"{revision}:").rsplit(":", 1) for line in listed.splitlines())
    return {path: int(count) for path, count in rows}


def by_package(lines: dict[str, int]) -> dict[str, list[int]]:
    """Return the lengths of the files of each package: a folder of pipeline/, or another folder as a whole."""
    packages = defaultdict(list)
    for path, count in lines.items():
        top, *rest = PurePosixPath(path).parts
        deep = top == "pipeline" and len(rest) > 1
        packages[f"{top}/{rest[0]}" if deep else top].append(count)
    packages["all of pipeline"] = [count for path, count in lines.items() if path.startswith("pipeline/")]
    rungs = tuple(f"pipeline/{rung}/" for rung in LADDER)
    packages["the ladder"] = [count for path, count in lines.items() if path.startswith(rungs)]
    return packages


def main(before: str, after: str) -> None:
    """Print one row a package: files, lines, the longest and the median file, each before -> after."""
    old, new = by_package(count_lines(before)), by_package(count_lines(after))
    print(f"| {before} -> {after} | files | lines | difference | longest file | median file |\n" + "|---" * 6 + "|")
    totals = ("the ladder", "all of pipeline")
    for name in [*sorted((old.keys() | new.keys()) - set(totals)), *totals]:
        one, other = old.get(name, [0]), new.get(name, [0])
        cells = [f"{measure(one):.0f} -> {measure(other):.0f}" for measure in (len, sum, max, statistics.median)]
        cells.insert(2, f"{sum(other) - sum(one):+}")
        print(f"| {name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("lines.py compares two revisions of git: python benchmarks/lines.py 213757b HEAD")
    main(*sys.argv[1:])
