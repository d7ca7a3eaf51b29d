"""A short campaign: every reader meets damaged files, and either gives plans or says in one line what is wrong.

The long one is ``python -m tests.fuzz``. Bombs that take long to make, and models of buildings, each of which starts a
process, are left to it.
"""

import json
import time
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pipeline.floorplans.readers import READERS
from tests.fuzz.campaign import FEWEST, Tally, run_campaign
from tests.fuzz.mutations import mutated
from tests.fuzz.sample import ARCHIVE, MANIFEST, Sample
from tests.fuzz.seeds import known_formats, samples_of
from tests.fuzz.worker import Worker, examine

INPUTS, SECONDS = 300, 0.4
JSON_READERS = (
    "amrl_vector_maps",
    "houseexpo",
    "imdf",
    "indoor_geojson",
    "mlstruct",
    "plan_geojson",
    "resplan",
    "valetudo",
)


@pytest.fixture(scope="module")
def worker() -> Iterator[Worker]:
    with Worker() as running:
        yield running


def test_every_reader_has_samples():
    assert known_formats() == {*READERS, ARCHIVE, MANIFEST}


@pytest.mark.parametrize("reader", sorted(known_formats()))
def test_a_sample_is_read_and_recognised(tmp_path, reader):
    for number, sample in enumerate(samples_of(reader)):
        folder = tmp_path / str(number)
        for name, content in sample.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        plans, refused, failure = examine(reader, folder / sample.main, sample.options, tuple(sample.files))
        assert (plans > 0, failure) == (True, "")
        assert refused <= (reader == "resplan")  # one of its homes has no scale
        if reader in READERS:
            assert next(name for name, each in READERS.items() if each.sniff(folder / sample.main)) == reader


@pytest.mark.parametrize("reader", sorted(known_formats()))
def test_damaged_files_give_plans_or_one_clear_error(worker, reader, record_property):
    slow = reader == "ifc"
    tally = run_campaign(worker, reader, 0, FEWEST if slow else INPUTS, bombs=False, seconds=SECONDS)
    print(tally.row())
    record_property("inputs", tally.inputs)
    assert not tally.failures, "\n".join(tally.failures)
    assert tally.inputs >= FEWEST


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_value_may_stand_anywhere_in_a_document(worker, data):
    reader = data.draw(st.sampled_from(JSON_READERS))
    sample = samples_of(reader)[0]
    holder = [json.loads(sample.files[sample.main])]
    inner, key = holder, 0
    for _ in range(data.draw(st.integers(0, 6))):
        deeper = inner[key]
        if not isinstance(deeper, list | dict) or not deeper:
            break
        inner, key = (
            deeper,
            data.draw(st.sampled_from(sorted(deeper) if isinstance(deeper, dict) else range(len(deeper)))),
        )
    inner[key] = data.draw(values)
    verdict = worker.read(
        reader, Sample(sample.files | {sample.main: json.dumps(holder[0]).encode()}, sample.main, sample.options)
    )
    assert verdict.failure == ""


def test_the_same_seed_damages_in_the_same_way():
    assert mutated("svg", 3, 14) == mutated("svg", 3, 14)
    assert mutated("svg", 3, 14) != mutated("svg", 3, 15)


def test_a_tally_keeps_what_brings_a_failure_back(worker):
    tally = Tally("svg")
    tally.add(worker.read("svg", samples_of("svg")[0]), "--only 1")
    tally.add(worker.read("svg", samples_of("svg")[0])._replace(failure="it broke", seconds=9.0), "--only 2")
    assert (tally.inputs, tally.plans, tally.slowest) == (2, 2, "--only 2")
    assert tally.failures == ["svg --only 2: it broke"]


def test_a_process_that_dies_is_a_failure_and_another_one_is_started(worker, monkeypatch):
    sample = samples_of("houseexpo")[0]
    assert worker.read("houseexpo", sample).plans == 1
    worker.kill()
    assert "the process died: SIGKILL" in worker.read("houseexpo", sample).failure
    started = time.monotonic()
    assert worker.read("houseexpo", sample).plans == 1
    assert time.monotonic() - started < 100
