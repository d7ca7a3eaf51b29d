"""Weights are found again in a real SQLite store: by alias, by version, by run."""

from pathlib import Path

import pytest
from mlflow import MlflowClient

from pipeline.errors import ConfigError
from pipeline.files import digest_file
from pipeline.tracking import Destination, Run, fetch_network, is_stored, log_run


def logged(destination: Destination, folder: Path, content: bytes, name: str = "network.safetensors") -> str:
    folder.mkdir()
    (folder / name).write_bytes(content)
    (folder / "curves.parquet").write_bytes(b"curves")
    return log_run(destination, Run(name="train", files=[folder / name, folder / "curves.parquet"]))


def registered(destination: Destination, run_id: str, alias: str) -> str:
    client = MlflowClient(destination.uri, registry_uri=destination.uri)
    if not client.search_registered_models("name = 'corridors'"):
        client.create_registered_model("corridors")
    version = client.create_model_version("corridors", source=f"runs:/{run_id}/network", run_id=run_id)
    client.set_registered_model_alias("corridors", alias, version.version)
    return str(version.version)


@pytest.mark.parametrize(
    ("reference", "stored"),
    [
        ("models:/corridors@champion", True),
        ("models:/corridors/3", True),
        ("0123456789abcdef0123456789abcdef", True),
        ("runs:/0123456789abcdef0123456789abcdef", True),
        ("artifacts/train/network.safetensors", False),
        ("/data/0123456789abcdef0123456789abcdef", False),
        ("0123456789abcdef0123456789abcde", False),
    ],
)
def test_a_file_is_told_from_what_a_store_holds(reference: str, stored: bool) -> None:
    assert is_stored(reference) == stored


def test_each_way_to_name_weights_finds_those_of_its_run(destination: Destination, tmp_path: Path) -> None:
    old, new = logged(destination, tmp_path / "1", b"old"), logged(destination, tmp_path / "2", b"newer")
    first = registered(destination, old, "safe")
    registered(destination, new, "champion")
    ways = {
        "models:/corridors@safe": b"old",
        f"models:/corridors/{first}": b"old",
        "models:/corridors@champion": b"newer",
        old: b"old",
        f"runs:/{new}": b"newer",
    }
    for reference, content in ways.items():
        found = fetch_network(reference, destination, tmp_path / "networks", "evaluate.network")
        assert found.read_bytes() == content
        assert found.name == f"{digest_file(found)[:16]}.safetensors"
    copies = sorted((tmp_path / "networks").glob("*.safetensors"))
    assert len(copies) == 2


def test_what_the_store_lacks_is_said_in_one_sentence(destination: Destination, tmp_path: Path) -> None:
    bare = log_run(destination, Run(name="evaluate"))
    for reference, said in {
        "models:/corridors@champion": "has no such model. Register one",
        "models:/corridors/7": "has no such model. Register one",
        "models:/corridors": "expected a file, models:/NAME@ALIAS",
        "0123456789abcdef0123456789abcdef": "has no run 0123456789abcdef0123456789abcdef",
        bare: r"holds 0 files \*.safetensors, expected one",
    }.items():
        with pytest.raises(ConfigError, match=said) as refused:
            fetch_network(reference, destination, tmp_path / "networks", "evaluate.network")
        assert str(refused.value).startswith(f"evaluate.network = {reference}: ")
        assert "\n" not in str(refused.value)
    assert not (tmp_path / "networks").exists()


def test_a_store_that_is_not_there_is_not_made(tmp_path: Path) -> None:
    nowhere = Destination(uri=f"sqlite:///{tmp_path / 'gone.db'}", experiment="corridors")
    with pytest.raises(ConfigError, match=r"there is no tracking store .*gone\.db"):
        fetch_network("models:/corridors@champion", nowhere, tmp_path / "networks", "evaluate.network")
    assert list(tmp_path.iterdir()) == []
