"""The network of learned subgoal planning, from the datum table to weights whose loading runs no code."""

import json
import logging
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from models.subgoals import SubgoalNet, SubgoalPredictor, SubgoalTraining
from pipeline.datums import DatumRows, digest, read_blocks
from pipeline.errors import TableError
from pipeline.learning.fit import FitSettings, Fitted, fit
from pipeline.learning.platt import PlattScaling, fit_platt, sigmoid
from pipeline.learning.prediction import predictions
from pipeline.learning.rows import Rows
from pipeline.learning.seeding import first_weights
from pipeline.learning.weights import save_weights
from pipeline.source_code import digest_code
from pipeline.systems.subgoals.examples import leads_of, spool_examples
from pipeline.systems.subgoals.inputs import InputFrame, subgoal_inputs
from pipeline.systems.subgoals.map_inputs import map_inputs
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK, NetworkHeader
from pipeline.systems.subgoals.scaling import input_moments, mean_costs, target_moments
from pipeline.systems.subgoals.scores import Predicted, score
from pipeline.systems.subgoals.settings import TrainConfig
from pipeline.systems.system import Job, Trained
from pipeline.tracking import Model

CODE = ("learning", "randomness.py", "../models", *(f"systems/subgoals/{name}.py" for name in ("training", "scaling")))
"""What decides the weights beside the data; the code of the examples shows in the examples themselves."""

Subgoals = Fitted[SubgoalTraining]

_LOG = logging.getLogger(__name__)
_STRIDE = 100  # steps; Lightning's loop around one costs about as much as the step
_INPUTS_AT_ONCE = 8192  # rows whose hidden layers are in memory, 8 MiB each
_VALIDATION_ROWS = 65536
_SHOWN_TO_THE_STORE = 16  # rows of the input example that gives the logged model its signature


def train(job: Job, *, logger: Any, progress: bool) -> Trained:
    """Write network.safetensors, last.ckpt, best.ckpt and curves.parquet to ``artifacts/train``."""
    config = job.section("train", TrainConfig)
    source, target = job.folder("harvest") / "datums", job.folder("train")
    # Scratch lies beside the stages' folders, none of which may hold anything that DVC would keep.
    scratch = job.artifacts
    examples = {split: read_examples(source, split, config, scratch) for split in ("train", "validation")}
    settings = fit_settings(config, job.seed)
    fitted = fit(
        make_training(examples["train"], config, settings.seed),
        examples["train"],
        examples["validation"],
        settings,
        target,
        logger=logger,
        progress=progress,
    )
    calibration = PlattScaling()
    if config.calibrate:
        calibration = fit_platt(
            logits_of(fitted.training.net, examples["validation"]), leads_of(examples["validation"])
        )
    made_with = _made_with(job.folder("harvest") / "harvest.json")
    made_with |= {"train.seed": job.seed if config.seed is None else config.seed}
    header = _header(fitted, config, calibration, made_with)
    save_weights(target / "network.safetensors", SUBGOAL_NETWORK, header, arrays_of(fitted.training.net))
    summary = _summary(fitted, calibration, examples, config)
    return Trained(
        summary=summary,
        scores={f"{split}.{name}": value for split in examples for name, value in summary[split].items()},
        files=[target / name for name in ("curves.parquet", "network.safetensors")],
        data=(source, digest(source)),
        model=_model(fitted, calibration, examples["validation"]),
        sentence=_sentence(summary),
    )


def read_examples(folder: Path, split: str, config: TrainConfig, scratch: Path) -> Rows:
    """Return the datums of ``split`` as the network sees them, in scratch files in the folder ``scratch``.

    At no time more than one block of them is in memory. Raises TableError when there are none.
    """
    blocks = ((network_inputs(rows, config, folder), rows) for rows in read_blocks(folder, [split]))
    examples = spool_examples(blocks, scratch, by_cost=config.cost_weighted, by_class=config.class_balanced)
    if not examples.count:
        raise TableError(
            f"{folder} holds no datums of the split {split!r}: the train stage needs train and validation. Put both in "
            "harvest.splits, and plans in both in conf/plans or conf/rasterize."
        )
    return examples


def network_inputs(rows: DatumRows, config: TrainConfig, folder: Path) -> NDArray[np.float32]:
    """Return the network's inputs [N, I] for ``rows`` of ``folder``, by the functions that the planner uses too."""
    if config.input_frame != "map":
        goals = np.stack([rows.goal_x_m, rows.goal_y_m], axis=1)
        subgoals = np.stack([rows.subgoal_x_m, rows.subgoal_y_m], axis=1)
        frame: InputFrame = "robot" if config.input_frame == "robot" else "subgoal"
        return subgoal_inputs(rows.ranges, goals, subgoals, frame=frame)
    if not rows.map_view.size:
        raise TableError(
            f"{folder} holds no views of the map, which train.input_frame=map needs: harvest with "
            "harvest.map_views=true."
        )
    return map_inputs(rows.map_view)


def make_training(rows: Rows, config: TrainConfig, seed: int) -> SubgoalTraining:
    """Return an untrained network, scaled to ``rows``, whose first weights depend on ``seed`` alone."""
    with first_weights(seed):
        net = SubgoalNet(
            inputs=rows["inputs"].shape[1],
            hidden=config.hidden,
            dropout=config.dropout,
            target_scaling="log" if config.target_scaling == "log" else "standardise",
        )
    scale_network(net, rows)
    return SubgoalTraining(
        net,
        learning_rate=config.learning_rate,
        decay=config.decay,
        decay_every=config.decay_every,
        success_weight=config.success_loss_weight,
        exploration_weight=config.exploration_loss_weight,
    )


def scale_network(net: SubgoalNet, rows: Rows) -> None:
    """Set the buffers of ``net`` so that its inputs and targets have mean 0 and spread 1 over ``rows``.

    Targets count only where they apply.
    """
    net.target_mean.zero_()
    net.target_std.fill_(1.0)
    inputs = input_moments(rows)
    targets = target_moments(rows, lambda block: {"targets_m": net.scale(block["targets_m"])})
    net.input_mean.copy_(inputs.mean)
    net.input_std.copy_(inputs.spread)
    net.target_mean.copy_(torch.cat([moments.mean for moments in targets]))
    net.target_std.copy_(torch.cat([moments.spread for moments in targets]))


def fit_settings(config: TrainConfig, seed: int) -> FitSettings:
    """Return what the fit needs of ``config``; ``seed`` is that of the data, used where the training has none."""
    elsewhere = ("steps", "batch_size", "validate_every", "seed", "accelerator", "calibrate")
    return FitSettings(
        steps=config.steps,
        batch_size=config.batch_size,
        validate_every=config.validate_every,
        seed=seed if config.seed is None else config.seed,
        stride=_STRIDE,
        validation_rows=_VALIDATION_ROWS,
        accelerator=config.accelerator,
        network={name: value for name, value in asdict(config).items() if name not in elsewhere},
        code=digest_code(*CODE),
    )


def logits_of(net: SubgoalNet, rows: Rows) -> NDArray[np.float32]:
    """Return the uncalibrated logit of P_S [N]."""
    parts = [raw[:, 0].numpy() for _, raw in predictions(net, rows, inputs_at_once=_INPUTS_AT_ONCE)]
    return np.concatenate(parts)


def score_network(
    net: SubgoalNet, rows: Rows, calibration: PlattScaling, means_m: NDArray[np.float64]
) -> dict[str, float]:
    """Return the scores of a calibrated network on ``rows``; see :func:`pipeline.systems.subgoals.scores.score`."""

    def blocks() -> Iterator[Predicted]:
        for block, raw in predictions(net, rows, inputs_at_once=_INPUTS_AT_ONCE):
            logit = raw[:, 0].numpy().astype(np.float64)
            yield Predicted(
                p=sigmoid(calibration.slope * logit + calibration.offset),
                costs_m=net.unscale(raw[:, 1:]).numpy().astype(np.float64),
                leads=leads_of(rows)[block] > 0.5,
                targets_m=rows["targets_m"][block].numpy().astype(np.float64),
            )

    return score(blocks(), means_m)


def _made_with(path: Path) -> dict[str, Any]:
    """Return the settings that the harvest was made with, as its summary at ``path`` tells; empty where it does not."""
    if not path.is_file():
        _LOG.warning("%s is not there, so the weights will not say what sensor and robot they were made with", path)
        return {}
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")).get("made_with", {}))
    except (ValueError, TypeError, AttributeError) as error:
        raise TableError(f"{path}: not the summary of a harvest ({error}): run `dvc repro -f harvest`.") from error


def _header(
    fitted: Subgoals, config: TrainConfig, calibration: PlattScaling, made_with: dict[str, Any]
) -> NetworkHeader:
    return NetworkHeader(
        inputs=len(fitted.training.net.input_mean),
        hidden=tuple(config.hidden),
        dropout=config.dropout,
        input_frame=config.input_frame,
        target_scaling=config.target_scaling,
        calibration=calibration,
        steps=fitted.step,
        fingerprint=fitted.fingerprint,
        made_with=made_with,
    )


def arrays_of(net: SubgoalNet) -> dict[str, NDArray[np.float32]]:
    """Return the arrays of ``net`` for its weights file: see pipeline.systems.subgoals.network_header."""
    state = net.state_dict()
    return {name: value.numpy() for name, value in state.items() if not name.endswith("num_batches_tracked")}


def _summary(
    fitted: Subgoals, calibration: PlattScaling, examples: dict[str, Rows], config: TrainConfig
) -> dict[str, Any]:
    """Return the scores of both splits, without a calibration error: validation chose the step and the calibration.

    How well P_S is calibrated is for data to say that chose nothing: the drives of the evaluate stage do.
    """
    means_m = mean_costs(examples["train"])
    net = fitted.training.net
    scores = {split: score_network(net, rows, calibration, means_m) for split, rows in examples.items()}
    return {
        **scores,
        "best_step": fitted.step,
        "best_validation_loss": fitted.validation_loss,
        "steps": config.steps,
        "calibration": calibration._asdict(),
        "fingerprint": fitted.fingerprint,
        "config": asdict(config),
    }


def _model(fitted: Subgoals, calibration: PlattScaling, validation: Rows) -> Model:
    predictor = SubgoalPredictor(fitted.training.net, slope=calibration.slope, offset=calibration.offset).eval()
    inputs = validation["inputs"][:_SHOWN_TO_THE_STORE].clone()  # a view would keep the scratch file
    with torch.no_grad():
        outputs = predictor(inputs)
    return Model(network=predictor, inputs=inputs.numpy(), outputs=outputs.numpy())


def _sentence(summary: dict[str, Any]) -> str:
    seen = summary["validation"]
    return (
        f"best after step {summary['best_step']} of {summary['steps']}; on {seen['rows']:.0f} validation datums "
        f"accuracy {seen['accuracy']:.3f} (base {seen['accuracy_base']:.3f}), AUC {seen.get('auc', float('nan')):.3f}; "
        f"mean error of delta success {_against(seen, 'delta_success')}, of exploration "
        f"{_against(seen, 'exploration')}. They chose the step{_calibrated(summary)}; evaluate reports the calibration"
    )


def _calibrated(summary: dict[str, Any]) -> str:
    return " and fitted the calibration" if summary["config"]["calibrate"] else ""


def _against(seen: dict[str, float], cost: str) -> str:
    if f"{cost}_mae_m" not in seen:
        return "unknown (no such datum)"
    return f"{seen[f'{cost}_mae_m']:.2f} m (predicting the mean: {seen[f'{cost}_mae_base_m']:.2f} m)"
