"""Training learns, and a training killed at any point ends with the same bits as one left alone."""

import logging
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import torch
from lightning.pytorch import Callback, LightningModule, Trainer

from pipeline.errors import TableError
from pipeline.files import write_sum
from pipeline.learning.curves import CURVE_SCHEMA
from pipeline.learning.fit import FitSettings, Fitted, fit
from pipeline.learning.rows import Rows
from pipeline.learning.seeding import first_step_seed
from pipeline.randomness import stream
from tests.learning.synthetic import SMALL, PictureNet, PictureTraining, make_pictures, picture_training, small

ROOT = Path(__file__).parents[2]


def run(
    folder: Path, settings: FitSettings = SMALL, train: Rows | None = None, training: PictureTraining | None = None
) -> Fitted[PictureTraining]:
    return fit(
        training or picture_training(),
        train or make_pictures(300, 0),
        make_pictures(80, 1),
        settings,
        folder,
        progress=False,
    )


def assert_same_bits(one: Path, other: Path) -> None:
    for name in ("last.ckpt", "best.ckpt"):
        states = [torch.load(folder / name, weights_only=True) for folder in (one, other)]
        assert states[0]["state_dict"].keys() == states[1]["state_dict"].keys()
        for key, value in states[0]["state_dict"].items():
            assert torch.equal(value, states[1]["state_dict"][key]), (name, key)
        for ours, theirs in zip(*(state["optimizer_states"][0]["state"].values() for state in states), strict=True):
            assert all(torch.equal(ours[part], theirs[part]) for part in ours)
        assert states[0]["lr_schedulers"][0]["_last_lr"] == states[1]["lr_schedulers"][0]["_last_lr"]
    assert pq.read_table(one / "curves.parquet").equals(pq.read_table(other / "curves.parquet"))


def test_a_small_convolutional_network_learns_with_automatic_optimisation(tmp_path: Path) -> None:
    fitted = run(tmp_path, small(steps=150, validate_every=50), train=make_pictures(600, 0))
    fresh = make_pictures(400, 9)
    with torch.no_grad():
        found = fitted.training.losses(fresh.tensors)
    assert float(found["accuracy"]) > 0.95
    curves = pq.read_table(tmp_path / "curves.parquet").to_pylist()
    train = {row["name"]: row["value"] for row in curves if (row["split"], row["step"]) == ("train", 150)}
    assert train.keys() == {"loss", "accuracy"}
    assert train["accuracy"] > 0.9 and train["loss"] < 0.4
    assert fitted.training.automatic_optimization
    assert fitted.training.device.type == "cpu"


def test_it_looks_at_validation_before_the_first_step_and_keeps_the_best(tmp_path: Path) -> None:
    fitted = run(tmp_path)
    curves = pq.read_table(tmp_path / "curves.parquet")
    assert curves.schema.equals(CURVE_SCHEMA)
    rows = [row for row in curves.to_pylist() if row["split"] == "validation" and row["name"] == "loss"]
    assert [row["step"] for row in rows] == [0, 10, 20, 30, 40, 50, 60]
    best = min(rows, key=lambda row: row["value"])
    assert (fitted.step, fitted.validation_loss) == (best["step"], pytest.approx(best["value"], abs=0))
    assert {row["step"] for row in curves.to_pylist() if row["split"] == "train"} == {10, 20, 30, 40, 50, 60}
    assert not fitted.training.training and not fitted.training.net.training


@pytest.mark.parametrize("stride", [1, 7, 100])
def test_the_weights_are_those_of_a_plain_loop_with_strides_and_without(tmp_path: Path, stride: int) -> None:
    train, settings = make_pictures(300, 0), small(steps=130, validate_every=70, stride=stride)
    run(tmp_path, settings, train)
    training = picture_training()
    net, first_seed = training.net.train(), first_step_seed(settings.seed)
    optimizer = torch.optim.SGD(net.parameters(), lr=0.02, momentum=0.9)
    schedule = torch.optim.lr_scheduler.StepLR(optimizer, 15, 0.8)
    for step in range(130):
        number, place = divmod(step, 300 // 32)
        order = torch.from_numpy(stream(settings.seed, "batches", number).permutation(300))
        batch = train.batch(order[32 * place : 32 * (place + 1)], torch.device("cpu"))
        torch.manual_seed(first_seed + step)
        optimizer.zero_grad()
        training.losses(batch)["loss"].backward()
        optimizer.step()
        if step % 2 == 1:
            schedule.step()  # a frequency of 2
    found = torch.load(tmp_path / "last.ckpt", weights_only=True)
    for name, value in net.state_dict().items():
        assert torch.equal(found["state_dict"][f"net.{name}"], value), name
    assert found["lr_schedulers"][0]["_last_lr"] == schedule.get_last_lr() == [pytest.approx(0.02 * 0.8**4)]


def test_strides_change_nothing_that_is_written(tmp_path: Path) -> None:
    run(tmp_path / "one", small(steps=47))
    run(tmp_path / "many", small(steps=47, stride=6))
    assert_same_bits(tmp_path / "one", tmp_path / "many")


@pytest.mark.parametrize(("stride", "ends"), [(100, [100, 150, 230]), (1, list(range(1, 231)))])
def test_others_are_called_between_strides(tmp_path: Path, stride: int, ends: list[int]) -> None:
    steps = []

    class Seen(Callback):
        def on_train_batch_end(self, trainer: Trainer, module: Any, outputs: Any, batch: Any, index: int) -> None:
            steps.append(batch.steps.stop if stride > 1 else trainer.global_step)

    settings = small(steps=230, validate_every=150, stride=stride)
    fit(picture_training(), make_pictures(300, 0), make_pictures(80, 1), settings, tmp_path, callbacks=[Seen()])
    assert steps == ends


def test_steps_that_do_not_fit_the_looks_end_with_one(tmp_path: Path) -> None:
    run(tmp_path, small(steps=17))
    assert max(pq.read_table(tmp_path / "curves.parquet")["step"].to_pylist()) == 17


@pytest.mark.parametrize(("first", "stride"), [(30, 1), (30, 4)])
def test_more_steps_later_equal_all_steps_at_once(tmp_path: Path, first: int, stride: int) -> None:
    run(tmp_path / "at_once", small(steps=60))
    run(tmp_path / "in_two", small(steps=first))
    again = run(tmp_path / "in_two", small(steps=60, stride=stride))
    assert again.resumed_from == first
    assert_same_bits(tmp_path / "at_once", tmp_path / "in_two")


def test_a_finished_training_is_not_run_again(tmp_path: Path) -> None:
    first = run(tmp_path)
    written = (tmp_path / "last.ckpt").stat().st_mtime_ns
    second = run(tmp_path)
    assert (second.resumed_from, second.step) == (60, first.step)
    assert (tmp_path / "last.ckpt").stat().st_mtime_ns == written
    assert all(map(torch.equal, first.training.state_dict().values(), second.training.state_dict().values()))


@pytest.mark.parametrize(
    "change",
    [
        {"settings": small(steps=30, network={"learning_rate": 0.5})},
        {"settings": small(steps=30, code="edited")},
        {"train": make_pictures(300, 9)},
        {"training": PictureTraining(PictureNet())},  # other first weights
        {"settings": small(steps=20)},
    ],
)
def test_other_data_or_settings_start_anew_and_say_so(
    tmp_path: Path, change: dict[str, Any], caplog: pytest.LogCaptureFixture
) -> None:
    run(tmp_path, small(steps=30))
    with caplog.at_level(logging.WARNING):
        assert run(tmp_path, **({"settings": small(steps=30)} | change)).resumed_from == 0
    assert "starting anew" in caplog.text


@pytest.mark.parametrize("name", ["last.ckpt", "best.ckpt", "curves.parquet"])
def test_a_damaged_checkpoint_starts_anew(tmp_path: Path, name: str, caplog: pytest.LogCaptureFixture) -> None:
    run(tmp_path / "whole")
    run(tmp_path / "cut", small(steps=30))
    content = bytearray((tmp_path / "cut" / name).read_bytes())
    content[len(content) // 2] ^= 8
    (tmp_path / "cut" / name).write_bytes(content)
    assert run(tmp_path / "cut").resumed_from == 0
    assert f"{name} is damaged" in caplog.text
    assert_same_bits(tmp_path / "whole", tmp_path / "cut")


def test_a_checkpoint_that_would_run_code_is_not_loaded(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return os.mkdir, (str(tmp_path / "boom"),)

    run(tmp_path, small(steps=30))
    torch.save({"hinterland": Bomb()}, tmp_path / "last.ckpt")
    write_sum(tmp_path / "last.ckpt")
    assert run(tmp_path).resumed_from == 0
    assert "not a readable checkpoint" in caplog.text
    assert not (tmp_path / "boom").exists()


def test_too_few_rows_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TableError, match="1 training and 80 validation rows: expected at least 2 and 1"):
        run(tmp_path, train=make_pictures(1, 0))


def test_a_module_without_losses_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="LightningModule has no method `losses`"):
        fit(LightningModule(), make_pictures(9, 0), make_pictures(9, 1), SMALL, tmp_path)


class ByEpochs(PictureTraining):
    def configure_optimizers(self) -> Any:
        optimizer = torch.optim.SGD(self.parameters(), lr=0.1)
        return [optimizer], [torch.optim.lr_scheduler.StepLR(optimizer, 15)]


@pytest.mark.parametrize("stride", [1, 5])
def test_a_schedule_that_would_never_be_stepped_is_refused(tmp_path: Path, stride: int) -> None:
    with pytest.raises(ValueError, match="StepLR waits for the end of an epoch"):
        run(tmp_path, small(stride=stride), training=ByEpochs(PictureNet()))


class Forked(PictureTraining):
    def configure_optimizers(self) -> Any:
        return [torch.optim.SGD(part.parameters(), lr=0.1) for part in self.net.children()]


def test_two_optimizers_in_strides_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="has one optimizer"):
        run(tmp_path, small(stride=5), training=Forked(PictureNet()))


KILLED = """
import sys
from pathlib import Path
from pipeline.learning.fit import fit
from tests.learning.synthetic import make_pictures, picture_training, small

settings = small(steps=400, stride=int(sys.argv[2]))
fit(picture_training(), make_pictures(300, 0), make_pictures(80, 1), settings, Path(sys.argv[1]), progress=False)
"""


@pytest.mark.parametrize("stride", [1, 10])
def test_killed_and_started_again_it_ends_with_the_same_bits(tmp_path: Path, stride: int) -> None:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", KILLED, str(tmp_path / "killed"), str(stride)]
    with subprocess.Popen(command, env=environment, cwd=ROOT) as process:
        _wait_for_step(tmp_path / "killed" / "curves.parquet", 50, process)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    again = run(tmp_path / "killed", small(steps=400, stride=stride))
    assert 0 < again.resumed_from < 400
    run(tmp_path / "alone", small(steps=400, stride=stride))
    assert_same_bits(tmp_path / "alone", tmp_path / "killed")
    assert not list((tmp_path / "killed").glob("*.partial"))


def _wait_for_step(curves: Path, step: int, process: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and process.poll() is None:
        if curves.is_file() and np.max(pq.read_table(curves)["step"].to_numpy()) >= step:
            return
        time.sleep(0.01)
    pytest.fail("the training ended, or took too long, before it could be killed")
