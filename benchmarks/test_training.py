"""What training costs: Lightning beside a bare loop of torch on the same work, and memory by size of the table.

Run alone by: python -m pytest -q -s -n 0 --benchmark-enable benchmarks/test_training.py
"""

import json
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from lightning.pytorch import Callback, Trainer

from models.subgoals import Batch, SubgoalNet, subgoal_losses
from pipeline.datums import DatumRows, shard_path, write_shard
from pipeline.files import sum_path
from pipeline.learning.batches import Stride
from pipeline.learning.fit import fit
from pipeline.learning.rows import Rows
from pipeline.learning.seeding import first_step_seed
from pipeline.randomness import stream
from pipeline.systems.subgoals.settings import TrainConfig
from pipeline.systems.subgoals.training import fit_settings, make_training, read_examples, train
from pipeline.systems.system import Job

ROOT = Path(__file__).parents[1]
STEPS = 3000
ROWS = 300_000  # what the paper trains on
TABLES = (50_000, 200_000, 800_000)
NAMES = ("inputs", "leads", "targets_m", "weight")  # in the order of Batch
_SHARD = 4000  # rows


class BareLoop(Callback):
    """The same training without Lightning: after each stride of the fit it takes as many steps, on its own network.

    The two take turns so that whatever else the machine does slows both.
    """

    def __init__(self, rows: Rows, config: TrainConfig) -> None:
        self.rows, self.config = rows, config
        self.net: SubgoalNet = make_training(rows, config, 0).net.train()
        self.optimizer = torch.optim.Adam(self.net.parameters(), lr=config.learning_rate, fused=True)
        self.schedule = torch.optim.lr_scheduler.StepLR(self.optimizer, config.decay_every, config.decay)
        self.first_seed = first_step_seed(0)
        self.done = 0
        self.order = torch.empty(0)
        self.seconds: list[tuple[float, float, int]] = []  # of Lightning, of the bare loop, for so many steps

    def run(self, until: int) -> None:
        size, config = self.config.batch_size, self.config
        for step in range(self.done, until):
            number, place = divmod(step, self.rows.count // size)
            if place == 0:
                self.order = torch.from_numpy(stream(0, "batches", number).permutation(self.rows.count))
            index = self.order[place * size : (place + 1) * size]
            batch = Batch(*(self.rows[name].index_select(0, index) for name in NAMES))
            torch.default_generator.manual_seed(self.first_seed + step)
            losses = subgoal_losses(
                self.net(batch.inputs_BI),
                self.net.scale(batch.targets_m_BT),
                batch,
                success_weight=config.success_loss_weight,
                exploration_weight=config.exploration_loss_weight,
            )
            self.optimizer.zero_grad()
            losses.total.backward()
            self.optimizer.step()
            self.schedule.step()
        self.done = until

    def on_train_start(self, *_: Any) -> None:
        self.since = time.perf_counter()

    def on_train_batch_end(self, trainer: Trainer, module: Any, outputs: Any, batch: Stride, index: int) -> None:
        before, ours = self.done, time.perf_counter()
        self.run(batch.steps.stop)
        theirs = time.perf_counter()
        self.seconds.append((ours - self.since, theirs - ours, self.done - before))
        self.since = time.perf_counter()  # of the next stride; a look at validation comes first, if it is time


def test_lightning_beside_a_bare_loop(benchmark: Any, tmp_path: Path) -> None:
    write_datums(tmp_path, ROWS)
    config = TrainConfig(steps=STEPS, validate_every=1000)
    source = tmp_path / "harvest" / "datums"
    examples = {split: read_examples(source, split, config, tmp_path) for split in ("train", "validation")}
    settings = fit_settings(config, seed=0)
    bare = BareLoop(examples["train"], config)

    def run() -> None:
        training = make_training(examples["train"], config, 0)
        seen = examples["train"], examples["validation"]
        fit(training, *seen, settings, tmp_path / "fit", progress=False, callbacks=[bare])

    benchmark.pedantic(run, rounds=1)
    assert_same_bits(bare.net, tmp_path / "fit" / "last.ckpt")
    ours, theirs, steps = np.array(bare.seconds).T
    ratio, with_looks = float(np.median(ours / theirs)), float(ours.sum() / theirs.sum())
    per_100k = {name: float(np.median(part / steps)) * 1e5 for name, part in (("lightning", ours), ("bare", theirs))}
    benchmark.extra_info |= {"ratio": ratio, "ratio_with_looks": with_looks, "seconds_per_100k": per_100k}
    print(
        f"\n{examples['train'].count} rows, batches of {settings.batch_size}, one thread: "
        f"Lightning {per_100k['lightning']:.0f} s, bare {per_100k['bare']:.0f} s per 100 k steps, ratio {ratio:.3f}; "
        f"{with_looks:.3f} with a look at {examples['validation'].count} rows, curves and checkpoints every 1 k steps"
    )
    assert ratio <= 1.10


def assert_same_bits(net: SubgoalNet, checkpoint: Path) -> None:
    """Stop unless both loops have done the same work."""
    found = torch.load(checkpoint, weights_only=True)["state_dict"]
    assert all(torch.equal(found[f"net.{name}"], value) for name, value in net.state_dict().items())


def test_memory_by_table_size(benchmark: Any, tmp_path: Path) -> None:
    """Peak of the memory that belongs to the process alone, in a process of its own for each table."""
    peaks: dict[int, dict[str, float]] = {}

    def run() -> None:
        for rows in TABLES:
            artifacts = tmp_path / str(rows)
            write_datums(artifacts, rows)
            command = [sys.executable, "-m", "benchmarks.test_training", str(artifacts)]
            done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
            peaks[rows] = json.loads(done.stdout.splitlines()[-1])

    benchmark.pedantic(run, rounds=1)
    benchmark.extra_info |= {f"peak_mib_{rows}": peak["peak"] for rows, peak in peaks.items()}
    for rows, peak in peaks.items():
        print(
            f"\n{rows:7d} rows: peak {peak['peak']:.0f} MiB of anonymous memory, {peak['imported']:.0f} MiB of it from "
            f"imports; {peak['seconds']:.1f} s for reading, 300 steps and scoring",
            end="",
        )
    found = [peak["peak"] for peak in peaks.values()]
    assert max(found) - min(found) < 128.0  # the inputs of the largest table alone are 793 MiB


def write_datums(artifacts: Path, rows: int) -> None:
    """Write about ``rows`` training datums and a tenth of that for validation: one shard of each, many names."""
    folder = artifacts / "harvest" / "datums"
    index = 0
    for seed, (split, count) in enumerate((("train", rows), ("validation", rows // 10))):
        shard = artifacts / f"{split}.parquet"
        write_shard(shard, draw_rows(_SHARD, split, seed))
        folder.mkdir(parents=True, exist_ok=True)
        for _ in range(-(-count // _SHARD)):
            link = shard_path(folder, index)
            link.symlink_to(shard)
            sum_path(link).write_text(sum_path(shard).read_text().replace(shard.name, link.name))
            index += 1


def draw_rows(count: int, split: str, seed: int) -> DatumRows:
    """Return datums that mean nothing, but from which something can be learned."""
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0.3, 18.0, (count, 256)).astype(np.float32)
    leads = ranges[:, :20].mean(axis=1) + rng.normal(0.0, 0.5, count) < 8.5
    words = {name: np.full(count, name, dtype=object) for name in ("pair_id", "plan_id", "building", "environment")}
    poses = ("pose_x_m", "pose_y_m", "heading_rad")
    places = ("goal_x_m", "goal_y_m", "subgoal_x_m", "subgoal_y_m")
    return DatumRows(
        **words,
        split=np.full(count, split, dtype=object),
        seed=np.zeros(count, np.int64),
        step=np.arange(count, dtype=np.int32),
        subgoal=np.zeros(count, np.int32),
        **{name: rng.normal(0.0, 1.0, count) for name in poses},
        ranges=ranges,
        **{name: rng.normal(0.0, 6.0, count).astype(np.float32) for name in places},
        leads_to_goal=leads,
        delta_success_m=np.where(leads, ranges[:, 0], np.nan).astype(np.float32),
        exploration_m=np.where(leads, np.nan, ranges[:, 1]).astype(np.float32),
        weight_m=rng.uniform(1.0, 40.0, count).astype(np.float32),
        frontier_cells=np.full(count, 7, np.int32),
        map_view=np.empty((count, 0), np.float32),
    )


def job_of(artifacts: Path) -> Job:
    """Return what the train stage hands over, for a short training with the paper's network."""
    return Job(seed=0, artifacts=artifacts, sections={"train": TrainConfig(steps=300, validate_every=150)})


def anonymous_mib() -> float:
    """Return the resident memory of this process that no file stands behind [MiB], as Linux tells it."""
    status = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    (line,) = (line for line in status if line.startswith("RssAnon:"))
    return int(line.split()[1]) / 1024.0


def measure(artifacts: Path) -> dict[str, float]:
    """Run the train stage here and return its peak of anonymous memory, that after the imports, and its time."""
    imported = peak = anonymous_mib()
    over = threading.Event()

    def watch() -> None:
        nonlocal peak
        while not over.wait(0.002):
            peak = max(peak, anonymous_mib())

    watcher = threading.Thread(target=watch, daemon=True)  # an error ends the process all the same
    watcher.start()
    since = time.perf_counter()
    train(job_of(artifacts), logger=None, progress=False)
    seconds = time.perf_counter() - since
    over.set()
    watcher.join()
    return {"imported": imported, "peak": peak, "seconds": seconds}


if __name__ == "__main__":
    print(json.dumps(measure(Path(sys.argv[1]))))
