import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import TableError
from pipeline.learning.scratch import Spool, row_blocks

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(("count", "sizes"), [(0, []), (1, [1]), (8, [8]), (17, [8, 8, 1])])
def test_blocks_cover_all_rows_in_order(count: int, sizes: list[int]) -> None:
    blocks = [np.arange(count)[block] for block in row_blocks(count, 8)]
    assert [len(block) for block in blocks] == sizes
    assert np.concatenate([np.empty(0, int), *blocks]).tolist() == list(range(count))


@pytest.mark.parametrize("shape", [(), (3,)])
def test_what_is_appended_is_mapped(tmp_path: Path, shape: tuple[int, ...]) -> None:
    rng, spool = np.random.default_rng(0), Spool(tmp_path / "new" / "folder")
    blocks = [rng.random((count, *shape)).astype(np.float32) for count in (5, 0, 1, 700)]
    for block in blocks:
        spool.append(block)
    assert np.array_equal(spool.mapped(), np.concatenate(blocks))
    assert spool.mapped().dtype == np.float32


def test_what_is_written_to_the_array_goes_to_the_file(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    spool.append(np.zeros(4))
    spool.mapped()[2] = 7.0
    assert spool.mapped().tolist() == [0.0, 0.0, 7.0, 0.0]


def test_an_array_outlives_its_spool(tmp_path: Path) -> None:
    def make() -> np.ndarray:
        spool = Spool(tmp_path)
        spool.append(np.arange(5000))
        return spool.mapped()

    assert np.array_equal(make(), np.arange(5000))


def test_no_rows_make_an_empty_array_and_no_blocks_no_folder(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    spool.append(np.empty((0, 3), np.float32))
    assert spool.mapped().shape == (0, 3)
    assert len(Spool(tmp_path / "never").mapped()) == 0
    assert not (tmp_path / "never").exists()


def test_the_file_has_no_name(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    spool.append(np.zeros(10_000))
    mapped = spool.mapped()
    assert len(mapped) == 10_000
    assert list(tmp_path.iterdir()) == []


KILLED = """
import os, signal, sys
from pathlib import Path
import numpy as np
from pipeline.learning.scratch import Spool

spool = Spool(Path(sys.argv[1]))
spool.append(np.zeros(10_000))
mapped = spool.mapped()
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_killed_process_leaves_nothing(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", KILLED, str(tmp_path / "scratch")], cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == -signal.SIGKILL
    assert list((tmp_path / "scratch").iterdir()) == []


class _Full:
    def write(self, _: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_is_one_clear_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.TemporaryFile", lambda **_: _Full())
    with pytest.raises(TableError, match=r"No space left on device.*make room and run train again"):
        Spool(tmp_path).append(np.zeros(3))
