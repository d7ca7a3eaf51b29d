"""References to weights in the configuration become files before anybody drives."""

from pathlib import Path

import pytest
from omegaconf import OmegaConf

from pipeline.errors import ConfigError
from pipeline.evaluation.competitors import CompetitorConfig, Role
from pipeline.evaluation.settings import EvaluateSettings
from pipeline.files import damage, digest_file, write_text
from pipeline.stages import networks
from pipeline.stages.networks import local_network, with_local_networks

RAW = OmegaConf.create({"experiment_name": "x", "tracking": {"enabled": False, "uri": "sqlite:////nowhere.db"}})


def settings(network: str | None, own: str | None) -> EvaluateSettings:
    return EvaluateSettings(
        network=network,
        competitors={
            "shortest": CompetitorConfig(use="shortest", role=Role.baseline),
            "ours": CompetitorConfig(use="planner", settings={"network": own, "depth": 3}),
        },
    )


def test_relative_weights_start_at_the_checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = tmp_path / "checkout"
    for file in ("checkout/artifacts/a.safetensors", "elsewhere/artifacts/a.safetensors"):
        write_text(tmp_path / file, "weights", summed=True)
    monkeypatch.setattr(networks, "CONF", root / "conf")
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert local_network("artifacts/a.safetensors", RAW, tmp_path, "key") == root / "artifacts/a.safetensors"
    other = tmp_path / "elsewhere/artifacts/a.safetensors"
    assert local_network(str(other), RAW, tmp_path, "key") == other


def test_weights_for_all_and_those_of_a_competitor_are_found(tmp_path: Path) -> None:
    for name in ("shared", "own"):
        write_text(tmp_path / name, name, summed=True)
    given = settings(str(tmp_path / "shared"), str(tmp_path / "own"))
    assert with_local_networks(given, RAW, tmp_path) == given
    assert with_local_networks(settings(None, None), RAW, tmp_path) == settings(None, None)


def test_weights_that_were_sent_without_a_checksum_get_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sent = tmp_path / "sent.safetensors"
    sent.write_bytes(b"weights")
    found = local_network(str(sent), RAW, tmp_path / "networks", "evaluate.network")
    assert found == tmp_path / "networks" / f"{digest_file(sent)[:16]}.safetensors"
    assert found.read_bytes() == b"weights"
    assert damage(found) is None
    assert "no checksum lies beside it" in capsys.readouterr().out
    assert local_network(str(sent), RAW, tmp_path / "networks", "evaluate.network") == found


@pytest.mark.parametrize(
    ("network", "own", "key"),
    [("gone.st", None, "evaluate.network = gone.st"), (None, "gone", "evaluate.competitors.ours.settings.network = ")],
)
def test_weights_that_are_not_there_are_named_by_their_key(
    tmp_path: Path, network: str | None, own: str | None, key: str
) -> None:
    with pytest.raises(
        ConfigError, match=f"^{key}.*: no such file. Expected the weights of a network: a file, models:/"
    ):
        with_local_networks(settings(network, own), RAW, tmp_path)
