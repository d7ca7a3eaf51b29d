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
from lightning.pytorch import Callback, Trainer

from pipeline.errors import TableError
from pipeline.files import write_sum
from pipeline.learning.calibration import Calibration, calibrate
from pipeline.learning.curves import CURVE_SCHEMA
from pipeline.learning.examples import Examples
from pipeline.learning.fit import FitSettings, Fitted, fit, make_training
from pipeline.learning.prediction import logits_of, score_network
from pipeline.learning.scaling import mean_costs
from pipeline.randomness import stream
from tests.learning.synthetic import SMALL, make_examples, small

ROOT = Path(__file__).parents[2]


def run(folder: Path, settings: FitSettings = SMALL, train: Examples | None = None) -> Fitted:
    return fit(train or make_examples(300, 0), make_examples(80, 1), settings, folder, progress=False)


def assert_same_bits(one: Path, other: Path) -> None:
    for name in ("last.ckpt", "best.ckpt"):
        states = [torch.load(folder / name, weights_only=True) for folder in (one, other)]
        for key, value in states[0]["state_dict"].items():
            assert torch.equal(value, states[1]["state_dict"][key]), (name, key)
        for ours, theirs in zip(*(state["optimizer_states"][0]["state"].values() for state in states), strict=True):
            assert all(torch.equal(ours[part], theirs[part]) for part in ours)
        assert states[0]["lr_schedulers"][0]["_last_lr"] == states[1]["lr_schedulers"][0]["_last_lr"]
    assert pq.read_table(one / "curves.parquet").equals(pq.read_table(other / "curves.parquet"))


def test_a_simple_rule_is_learned(tmp_path: Path) -> None:
    train, fresh = make_examples(3000, 0), make_examples(1000, 2)
    settings = small(steps=900, batch_size=128, hidden=(48, 24), dropout=0.0, validate_every=300, learning_rate=0.02)
    fitted = fit(train, make_examples(500, 1), settings, tmp_path, progress=False)
    found = score_network(fitted.net, fresh, Calibration(), mean_costs(train), tmp_path)
    assert found["accuracy"] > 0.93 > found["accuracy_base"] + 0.35
    assert found["auc"] > 0.98
    assert found["delta_success_mae_m"] < 0.5 * found["delta_success_mae_base_m"]
    assert found["exploration_mae_m"] < 0.5 * found["exploration_mae_base_m"]
    calibration = calibrate(logits_of(fitted.net, fresh, tmp_path), fresh.leads)
    assert score_network(fitted.net, fresh, calibration, mean_costs(train), tmp_path)["calibration_error"] < 0.05


def test_it_looks_at_validation_before_the_first_step_and_keeps_the_best(tmp_path: Path) -> None:
    fitted = run(tmp_path)
    curves = pq.read_table(tmp_path / "curves.parquet")
    assert curves.schema.equals(CURVE_SCHEMA)
    rows = [row for row in curves.to_pylist() if row["split"] == "validation" and row["name"] == "loss"]
    assert [row["step"] for row in rows] == [0, 10, 20, 30, 40, 50, 60]
    best = min(rows, key=lambda row: row["value"])
    assert (fitted.step, fitted.validation_loss) == (best["step"], pytest.approx(best["value"], abs=0))
    assert {row["step"] for row in curves.to_pylist() if row["split"] == "train"} == {10, 20, 30, 40, 50, 60}
    assert not fitted.net.training


def test_the_weights_are_those_of_a_plain_loop(tmp_path: Path) -> None:
    train, settings = make_examples(300, 0), small(steps=130, validate_every=70)
    fit(train, make_examples(80, 1), settings, tmp_path, progress=False)
    training = make_training(train, settings)
    net, first_seed = training.net.train(), int(stream(settings.seed, "dropout").integers(2**62))
    optimizer = torch.optim.Adam(net.parameters(), lr=settings.learning_rate, fused=True)
    schedule = torch.optim.lr_scheduler.StepLR(optimizer, settings.decay_every, settings.decay)
    for step in range(130):
        number, place = divmod(step, 300 // 32)
        order = torch.from_numpy(stream(settings.seed, "batches", number).permutation(300))
        batch = train.batch(order[32 * place : 32 * (place + 1)], torch.device("cpu"))
        torch.manual_seed(first_seed + step)
        optimizer.zero_grad()
        training.losses(batch).total.backward()
        optimizer.step()
        schedule.step()
    found = torch.load(tmp_path / "last.ckpt", weights_only=True)["state_dict"]
    for name, value in net.state_dict().items():
        assert torch.equal(found[f"net.{name}"], value), name


def test_others_are_called_between_strides(tmp_path: Path) -> None:
    steps = []

    class Seen(Callback):
        def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
            steps.append(trainer.global_step)

    settings = small(steps=230, validate_every=150)
    fit(make_examples(300, 0), make_examples(80, 1), settings, tmp_path, callbacks=[Seen()])
    assert steps == [100, 150, 230]


def test_the_learning_rate_decays_by_steps(tmp_path: Path) -> None:
    run(tmp_path)
    checkpoint = torch.load(tmp_path / "last.ckpt", weights_only=True)
    assert checkpoint["lr_schedulers"][0]["_last_lr"] == [pytest.approx(0.01 * 0.9**2)]


def test_steps_that_do_not_fit_the_looks_end_with_one(tmp_path: Path) -> None:
    run(tmp_path, small(steps=17))
    assert max(pq.read_table(tmp_path / "curves.parquet")["step"].to_pylist()) == 17


def test_more_steps_later_equal_all_steps_at_once(tmp_path: Path) -> None:
    run(tmp_path / "at_once", small(steps=60))
    run(tmp_path / "in_two", small(steps=30))
    again = run(tmp_path / "in_two", small(steps=60))
    assert again.resumed_from == 30
    assert_same_bits(tmp_path / "at_once", tmp_path / "in_two")


def test_a_finished_training_is_not_run_again(tmp_path: Path) -> None:
    first = run(tmp_path)
    written = (tmp_path / "last.ckpt").stat().st_mtime_ns
    second = run(tmp_path)
    assert (second.resumed_from, second.step) == (60, first.step)
    assert (tmp_path / "last.ckpt").stat().st_mtime_ns == written
    assert all(map(torch.equal, first.net.state_dict().values(), second.net.state_dict().values()))


def test_other_data_or_settings_start_anew_and_say_so(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    run(tmp_path)
    for change in ({"settings": small(dropout=0.5)}, {"train": make_examples(300, 9)}, {"settings": small(steps=20)}):
        with caplog.at_level(logging.WARNING):
            caplog.clear()
            assert run(tmp_path, **change).resumed_from == 0  # type: ignore[arg-type]
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
    with pytest.raises(TableError, match="1 training and 80 validation datums: expected at least 2 and 1"):
        run(tmp_path, train=make_examples(1, 0))


KILLED = """
import sys
from pathlib import Path
from pipeline.learning.fit import fit
from tests.learning.synthetic import make_examples, small

fit(make_examples(300, 0), make_examples(80, 1), small(steps=800), Path(sys.argv[1]), progress=False)
"""


def test_killed_and_started_again_it_ends_with_the_same_bits(tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", KILLED, str(tmp_path / "killed")]
    with subprocess.Popen(command, env=environment, cwd=ROOT) as process:
        _wait_for_step(tmp_path / "killed" / "curves.parquet", 50, process)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    again = run(tmp_path / "killed", small(steps=800))
    assert 0 < again.resumed_from < 800
    run(tmp_path / "alone", small(steps=800))
    assert_same_bits(tmp_path / "alone", tmp_path / "killed")
    assert not list((tmp_path / "killed").glob("*.partial"))


def _wait_for_step(curves: Path, step: int, process: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and process.poll() is None:
        if curves.is_file() and np.max(pq.read_table(curves)["step"].to_numpy()) >= step:
            return
        time.sleep(0.01)
    pytest.fail("the training ended, or took too long, before it could be killed")
