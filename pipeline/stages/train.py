"""Train: a system's network, from the tables of its harvest to weights whose loading runs no code."""

from omegaconf import DictConfig

from pipeline.files import write_json
from pipeline.parts import resolve
from pipeline.stages.door import StageResult, launch, workspace
from pipeline.stages.jobs import blamed, job_of, nothing_to_do, system_of
from pipeline.stages.recording import tracker
from pipeline.systems.system import Training
from pipeline.tracking import training_logger

SECTIONS = ("train",)


def train(raw: DictConfig) -> StageResult:
    """Write the network, its checkpoints, curves and train.json to ``artifacts/train``."""
    work, system = workspace(raw), system_of(raw)
    target = work.folder("train")
    if system.training is None:
        return nothing_to_do("train", target, f"{system.title} has no network")
    fit: Training = resolve(system.training)
    store = tracker(raw)
    logger = training_logger(store) if store is not None else None
    with blamed(raw.system, system.training):
        found = fit(job_of(raw, system, work, SECTIONS), logger=logger, progress=work.progress)
    write_json(target / "train.json", found.summary)
    print(f"train: {found.sentence}")
    return StageResult(
        metrics=found.scores,
        files=[target / "train.json", *found.files],
        datasets={found.data[0].name: found.data},
        model=found.model,
        run_id=logger.run_id if logger is not None else None,
    )


if __name__ == "__main__":
    launch("train", train)
