"""Train: the network of learned subgoal planning, from the datum table to weights whose loading runs no code."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, get_args

import numpy as np
import torch
from numpy.typing import NDArray
from omegaconf import DictConfig

from models.subgoals import SubgoalPredictor, TargetScaling
from pipeline.datums import DatumRows, digest, read_blocks
from pipeline.errors import TableError
from pipeline.files import write_json
from pipeline.learning.calibration import Calibration, calibrate
from pipeline.learning.examples import Examples, spool_examples
from pipeline.learning.fit import FitSettings, Fitted, fit
from pipeline.learning.prediction import logits_of, score_network
from pipeline.learning.scaling import mean_costs
from pipeline.learning.weights import NetworkHeader, save_weights
from pipeline.stages.door import StageResult, launch, typed, workspace
from pipeline.stages.recording import tracker
from pipeline.stages.settings import require
from pipeline.stages.units import digest_code
from pipeline.systems.subgoals.inputs import InputFrame, subgoal_inputs
from pipeline.systems.subgoals.map_inputs import INPUT_KINDS, map_inputs
from pipeline.tracking import Model, training_logger

CODE = ("learning", "../models")  # the inputs' code shows in the inputs themselves

_SHOWN_TO_THE_STORE = 16  # rows of the input example that gives the logged model its signature


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """How the network is made, trained and calibrated (conf/train/); defaults are the paper's."""

    steps: int = 100_000
    batch_size: int = 256
    learning_rate: float = 0.004
    decay: float = 0.9
    decay_every: int = 5000
    hidden: list[int] = field(default_factory=lambda: [256, 128, 48, 16])
    dropout: float = 0.5
    cost_weighted: bool = True
    class_balanced: bool = True
    success_loss_weight: float = 1.0
    exploration_loss_weight: float = 1.0
    target_scaling: str = "standardise"
    input_frame: str = "subgoal"
    calibrate: bool = True
    validate_every: int = 1000
    accelerator: str = "cpu"
    seed: int | None = None
    """Of the first weights and the order of the batches; null means the root key ``seed``, which draws the data."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        for name in ("steps", "decay_every", "validate_every"):
            require(getattr(self, name) >= 1, f"train.{name}", getattr(self, name), "at least 1 step")
        require(self.batch_size >= 2, "train.batch_size", self.batch_size, "at least 2 (batch norm)")
        require(0 < self.learning_rate < 1, "train.learning_rate", self.learning_rate, "between 0 and 1")
        require(0 < self.decay <= 1, "train.decay", self.decay, "above 0, at most 1")
        require(
            len(self.hidden) > 0 and min(self.hidden) >= 1,
            "train.hidden",
            self.hidden,
            "one or more widths, each above 0",
        )
        require(0 <= self.dropout < 1, "train.dropout", self.dropout, "from 0 to below 1")
        for name in ("success_loss_weight", "exploration_loss_weight"):
            require(getattr(self, name) >= 0, f"train.{name}", getattr(self, name), "at least 0")
        require(self.seed is None or self.seed >= 0, "train.seed", self.seed, "null or at least 0")
        _require_one_of("target_scaling", self.target_scaling, get_args(TargetScaling))
        _require_one_of("input_frame", self.input_frame, INPUT_KINDS)
        _require_one_of("accelerator", self.accelerator, ("cpu", "gpu", "auto"))


def train(raw: DictConfig) -> StageResult:
    """Write network.safetensors, last.ckpt, best.ckpt, curves.parquet and train.json to ``artifacts/train``."""
    config = typed(TrainConfig, raw, "train")
    work = workspace(raw)
    source, target = work.folder("harvest") / "datums", work.folder("train")
    # Scratch lies beside the stages' folders, none of which may hold anything that DVC would keep.
    examples = {split: read_examples(source, split, config, work.root) for split in ("train", "validation")}
    store = tracker(raw)
    logger = training_logger(store) if store is not None else None
    fitted = fit(
        examples["train"],
        examples["validation"],
        fit_settings(config, work.seed),
        target,
        logger=logger,
        progress=work.progress,
    )
    calibration = _calibration(fitted, examples["validation"], work.root) if config.calibrate else Calibration()
    made_with = _made_with(work.folder("harvest") / "harvest.json")
    made_with |= {"train.seed": work.seed if config.seed is None else config.seed}
    header = _header(fitted, config, calibration, made_with)
    save_weights(target / "network.safetensors", header, _arrays(fitted))
    summary = _summary(fitted, calibration, examples, config, work.root)
    write_json(target / "train.json", summary)
    _tell(summary)
    return StageResult(
        metrics={f"{split}.{name}": value for split in examples for name, value in summary[split].items()},
        files=[target / name for name in ("train.json", "curves.parquet", "network.safetensors")],
        datasets={"datums": (source, digest(source))},
        model=_model(fitted, calibration, examples["validation"]),
        run_id=logger.run_id if logger is not None else None,
    )


def read_examples(folder: Path, split: str, config: TrainConfig, scratch: Path) -> Examples:
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


def fit_settings(config: TrainConfig, seed: int) -> FitSettings:
    """Return what the fit needs of ``config``; ``seed`` is that of the data, used where the training has none."""
    return FitSettings(
        steps=config.steps,
        batch_size=config.batch_size,
        learning_rate=config.learning_rate,
        decay=config.decay,
        decay_every=config.decay_every,
        hidden=tuple(config.hidden),
        dropout=config.dropout,
        success_weight=config.success_loss_weight,
        exploration_weight=config.exploration_loss_weight,
        target_scaling="log" if config.target_scaling == "log" else "standardise",
        validate_every=config.validate_every,
        seed=seed if config.seed is None else config.seed,
        accelerator=config.accelerator,
        code=digest_code(*CODE),
    )


def _calibration(fitted: Fitted, validation: Examples, scratch: Path) -> Calibration:
    return calibrate(logits_of(fitted.net, validation, scratch), validation.leads)


def _made_with(path: Path) -> dict[str, Any]:
    """Return the settings that the harvest was made with, as its summary at ``path`` tells; empty where it does not."""
    if not path.is_file():
        print(f"train: {path} is not there, so the weights will not say what sensor and robot they were made with")
        return {}
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")).get("made_with", {}))
    except (ValueError, TypeError, AttributeError) as error:
        raise TableError(f"{path}: not the summary of a harvest ({error}): run `dvc repro -f harvest`.") from error


def _header(fitted: Fitted, config: TrainConfig, calibration: Calibration, made_with: dict[str, Any]) -> NetworkHeader:
    return NetworkHeader(
        inputs=len(fitted.net.input_mean),
        hidden=tuple(config.hidden),
        dropout=config.dropout,
        input_frame=config.input_frame,
        target_scaling=config.target_scaling,
        calibration=calibration,
        steps=fitted.step,
        fingerprint=fitted.fingerprint,
        made_with=made_with,
    )


def _arrays(fitted: Fitted) -> dict[str, NDArray[np.float32]]:
    state = fitted.net.state_dict()
    return {name: value.numpy() for name, value in state.items() if not name.endswith("num_batches_tracked")}


def _summary(
    fitted: Fitted, calibration: Calibration, examples: dict[str, Examples], config: TrainConfig, scratch: Path
) -> dict[str, Any]:
    """Return the scores of both splits, without a calibration error: validation chose the step and the calibration.

    How well P_S is calibrated is for data to say that chose nothing: the drives of the evaluate stage do.
    """
    means_m = mean_costs(examples["train"])
    scores = {split: score_network(fitted.net, rows, calibration, means_m, scratch) for split, rows in examples.items()}
    for found in scores.values():
        del found["calibration_error"]
    return {
        **scores,
        "best_step": fitted.step,
        "best_validation_loss": fitted.validation_loss,
        "steps": config.steps,
        "calibration": calibration._asdict(),
        "fingerprint": fitted.fingerprint,
        "config": asdict(config),
    }


def _model(fitted: Fitted, calibration: Calibration, validation: Examples) -> Model:
    predictor = SubgoalPredictor(fitted.net, slope=calibration.slope, offset=calibration.offset).eval()
    inputs = validation.inputs[:_SHOWN_TO_THE_STORE].clone()  # a view would keep the scratch file
    with torch.no_grad():
        outputs = predictor(inputs)
    return Model(network=predictor, inputs=inputs.numpy(), outputs=outputs.numpy())


def _tell(summary: dict[str, Any]) -> None:
    seen = summary["validation"]
    print(
        f"train: best after step {summary['best_step']} of {summary['steps']}; on {seen['rows']:.0f} validation datums "
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


def _require_one_of(name: str, value: str, allowed: tuple[str, ...]) -> None:
    require(value in allowed, f"train.{name}", value, " or ".join(allowed))


if __name__ == "__main__":
    launch("train", train)
