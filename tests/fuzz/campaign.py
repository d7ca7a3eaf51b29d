"""Reads many damaged files with every reader and counts what became of them."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

from tests.fuzz.bombs import bombs_of
from tests.fuzz.mutations import mutated
from tests.fuzz.sample import Sample
from tests.fuzz.worker import Verdict, Worker


@dataclass
class Tally:
    """Counts for one reader. failures: what happened, with the input that does it again."""

    reader: str
    inputs: int = 0
    plans: int = 0
    refused: int = 0
    worst_seconds: float = 0.0
    worst_megabytes: float = 0.0
    slowest: str = ""
    largest: str = ""
    failures: list[str] = field(default_factory=list)

    def add(self, verdict: Verdict, what: str) -> None:
        self.inputs += 1
        self.plans += verdict.plans
        self.refused += verdict.refused
        if verdict.seconds > self.worst_seconds:
            self.worst_seconds, self.slowest = verdict.seconds, what
        if verdict.megabytes > self.worst_megabytes:
            self.worst_megabytes, self.largest = verdict.megabytes, what
        if verdict.failure:
            self.failures.append(f"{self.reader} {what}: {verdict.failure}")

    def row(self) -> str:
        return (
            f"{self.reader:18} {self.inputs:7,} {self.plans:8,} {self.refused:8,} {self.worst_seconds:8.2f} s "
            f"{self.worst_megabytes:7.0f} MB {len(self.failures):4}   {self.slowest} / {self.largest}"
        )


FEWEST = 3  # inputs of a reader in the shortest campaign
HEADER = (
    f"{'reader':18} {'inputs':>7} {'plans':>8} {'refused':>8} {'worst time':>10} {'memory':>10} fail"
    "   slowest / largest"
)


def inputs_of(
    reader: str, seed: int, count: int, *, first: int = 0, bombs: bool = True
) -> Iterator[tuple[str, Sample]]:
    """Yield the hand-made bombs, then ``count`` mutations; each with a name that brings it back."""
    if bombs:
        yield from ((f"--bomb {name!r}", sample) for name, sample in bombs_of(reader))
    for number in range(first, first + count):
        note, sample = mutated(reader, seed, number)
        yield f"--seed {seed} --only {number} ({note})", sample


def run_campaign(
    worker: Worker, reader: str, seed: int, count: int, *, first: int = 0, bombs: bool = True, seconds: float = 1e9
) -> Tally:
    """Read the inputs of one reader, or as many of them as ``seconds`` allow, but a few in any case."""
    tally, start = Tally(reader), time.monotonic()
    for what, sample in inputs_of(reader, seed, count, first=first, bombs=bombs):
        tally.add(worker.read(reader, sample), what)
        if tally.inputs >= FEWEST and time.monotonic() - start > seconds:
            break
    return tally
