"""The long campaign: ``python -m tests.fuzz [--inputs N] [--seed S] [--reader NAME]``; ends with 1 where one failed."""

import argparse
import sys
import time

from tests.fuzz.bombs import bomb_named
from tests.fuzz.campaign import HEADER, Tally, run_campaign
from tests.fuzz.mutations import mutated
from tests.fuzz.seeds import known_formats
from tests.fuzz.worker import MOST_BYTES, MOST_SECONDS, Worker


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=1000, help="mutations for each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reader", choices=sorted(known_formats()), action="append", help="only this one")
    parser.add_argument("--only", type=int, help="try this one mutation of the reader")
    parser.add_argument("--bomb", help="try this one hand-made input of the reader")
    parser.add_argument("--no-bombs", action="store_true", help="mutations alone")
    given = parser.parse_args()
    readers = given.reader or sorted(known_formats())
    with Worker() as worker:
        if given.only is not None or given.bomb is not None:
            return _try_one(worker, readers[0], given)
        print(
            f"at most {MOST_SECONDS:g} s of processor time and {MOST_BYTES / 1e9:g} GB for each input\n{HEADER}",
            flush=True,
        )
        start, tallies = time.monotonic(), []
        for reader in readers:
            tally = run_campaign(worker, reader, given.seed, given.inputs, bombs=not given.no_bombs)
            tallies.append(tally)
            print(tally.row(), flush=True)
            for failure in tally.failures:
                print(f"    {failure}", flush=True)
    return _sum_up(tallies, time.monotonic() - start)


def _sum_up(tallies: list[Tally], seconds: float) -> int:
    inputs, failures = sum(tally.inputs for tally in tallies), sum(len(tally.failures) for tally in tallies)
    print(f"{inputs:,} inputs in {seconds:.0f} s, {failures} failures")
    return int(failures > 0)


def _try_one(worker: Worker, reader: str, given: argparse.Namespace) -> int:
    if given.bomb is not None:
        sample = bomb_named(reader, given.bomb)
    else:
        _, sample = mutated(reader, given.seed, given.only)
    for name, content in sample.files.items():
        print(f"--- {name}, {len(content):,} bytes: {content[:2000]!r}")
    verdict = worker.read(reader, sample)
    print(verdict)
    return int(bool(verdict.failure))


if __name__ == "__main__":
    sys.exit(main())
