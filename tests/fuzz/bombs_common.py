"""What bombs are made of."""

from collections.abc import Iterator
from dataclasses import replace

from tests.fuzz.sample import (
    Sample,
)

DEEP = 100_000

Bombs = Iterator[tuple[str, Sample]]


def replace_main(sample: Sample, content: bytes, **options: object) -> Sample:
    return Sample(sample.files | {sample.main: content}, sample.main, replace(sample.options, **options))  # type: ignore[arg-type]
