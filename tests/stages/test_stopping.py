"""What ends a run from outside: signals reach every process below, and a disk that refuses is one sentence."""

import errno
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.errors import one_line, printable
from pipeline.stages.stopping import disk_words

ROOT = Path(__file__).resolve().parents[2]

# hinterland -> dvc -> a stage -> a worker, in the order of their births; each writes its process id.
FAMILY = """
import os, subprocess, sys, time, signal
from pathlib import Path
{before}
folder, depth = Path(sys.argv[1]), int(sys.argv[2])
if depth:
    below = subprocess.Popen([sys.executable, __file__, str(folder), str(depth - 1)])
(folder / f"{{depth}}.pid").write_text(str(os.getpid()))
time.sleep(120)
"""

TOP = """
import os, sys
from pipeline.stages import stopping
stopping._GRACE_S = 1.0
try:
    with stopping.ending_by_signal():
        stopping.run_below([sys.executable, sys.argv[1], sys.argv[2], "2"], dict(os.environ))
except stopping.Stopped as stop:
    sys.exit(stop.exit_code)
"""


def started(folder: Path, *, stubborn: bool) -> "subprocess.Popen[bytes]":
    family, top = folder / "family.py", folder / "top.py"
    before = "signal.signal(signal.SIGINT, signal.SIG_IGN)" if stubborn else ""
    family.write_text(FAMILY.format(before=before), encoding="utf-8")
    top.write_text(TOP, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen([sys.executable, top, family, folder], env=environment, stderr=subprocess.DEVNULL)
    wait_for(lambda: len(list(folder.glob("*.pid"))) == 3 and all(file.read_text() for file in folder.glob("*.pid")))
    return process


def wait_for(holds: object, seconds: float = 60.0) -> None:
    limit = time.monotonic() + seconds
    while not holds():  # type: ignore[operator]
        assert time.monotonic() < limit, "waited in vain"
        time.sleep(0.02)


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize("stubborn", [False, True])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_ends_every_process_below(tmp_path: Path, number: int, code: int, stubborn: bool) -> None:
    process = started(tmp_path, stubborn=stubborn)
    below = [int(file.read_text()) for file in tmp_path.glob("*.pid")]
    assert all(map(alive, below))
    process.send_signal(number)
    assert process.wait(60) == code
    wait_for(lambda: not any(map(alive, below)), 5)


STAGE = """
import sys, time
from pathlib import Path
from pipeline.files import replacing
from pipeline.stages.door import StageResult, launch

def body(raw):
    with replacing(Path(raw.artifacts) / "plans" / "plans.parquet") as scratch:
        {work}
    return StageResult()

launch("plans", body)
"""


def stage(folder: Path, artifacts: Path, work: str) -> list[str]:
    (folder / "stage.py").write_text(STAGE.format(work=work), encoding="utf-8")
    return [sys.executable, str(folder / "stage.py"), "experiment=tiny", f"artifacts={artifacts}"]


def run(command: list[str], **more: object) -> "subprocess.CompletedProcess[str]":
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, **more)  # type: ignore[call-overload, no-any-return]


def test_a_stage_that_is_terminated_leaves_nothing_half_written(tmp_path: Path) -> None:
    artifacts = tmp_path / "artifacts"
    command = stage(tmp_path, artifacts, "scratch.write_text('half'); time.sleep(100)")
    process = subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: list(artifacts.rglob("*.partial")))
    process.terminate()
    _, told = process.communicate(timeout=60)
    assert process.returncode == 143
    assert told.strip() == "stopped: the same command continues plans"
    assert not list((artifacts / "plans").iterdir())


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 64 kB, where the system lets us mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)], capture_output=True)
    if mounted.returncode:
        pytest.skip("no right to mount a small disk")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def assert_one_line_about(done: "subprocess.CompletedProcess[str]", file: Path, reason: str, remedy: str) -> None:
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith(f"error: {file}: {reason}. ")
    assert remedy in line


def test_a_full_disk_is_one_line(small_disk: Path, tmp_path: Path) -> None:
    done = run(stage(tmp_path, small_disk, "scratch.write_bytes(bytes(200_000))"))
    file = small_disk / "plans" / "plans.parquet"
    assert_one_line_about(done, file, "No space left on device", "Make room")
    assert not list(file.parent.iterdir())


def test_a_folder_that_is_read_only_is_one_line(small_disk: Path, tmp_path: Path) -> None:
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    done = run(stage(tmp_path, small_disk / "artifacts", "scratch.write_bytes(b'')"))
    assert_one_line_about(done, small_disk / "artifacts", "Read-only file system", "choose another folder")


def test_a_table_beyond_the_limit_of_a_file_is_one_line(tmp_path: Path) -> None:
    """The limit stands in for a full disk where none can be mounted; Arrow itself does not say which file it was."""
    work = (
        "import numpy, pyarrow, pyarrow.parquet; "
        "pyarrow.parquet.write_table(pyarrow.table({'x': numpy.random.default_rng(0).random(100_000)}), scratch)"
    )

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))

    environment = {"PYTHONDONTWRITEBYTECODE": "1"}
    command = stage(tmp_path, tmp_path / "artifacts", work)
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": str(ROOT)} | environment, capture_output=True, text=True,
        timeout=120, preexec_fn=limit,
    )  # fmt: skip
    file = tmp_path / "artifacts" / "plans" / "plans.parquet"
    assert_one_line_about(done, file, "File too large", "Make room")
    assert not list(file.parent.iterdir())


def test_what_the_system_refused_names_the_file() -> None:
    refused = OSError(errno.EACCES, "Permission denied", "/data/x.parquet")
    assert disk_words(refused).startswith("/data/x.parquet: Permission denied. Give permission")
    assert disk_words(OSError(errno.EIO, "Input/output error")).startswith("Input/output error. HINTERLAND_TRACEBACK=1")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("east\x1b[2Jwing", r"east\x1b[2Jwing"),
        ("a\rb\x7f\x9b", r"a\rb\x7f\x9b"),
        ("safe\u202egnp.exe", r"safe\u202egnp.exe"),
        ("\udc80.dxf", r"\udc80.dxf"),
        ("two\nlines", r"two\nlines"),
        ("Größe 3 m², 階", "Größe 3 m², 階"),
    ],
)
def test_control_characters_are_never_printed_raw(text: str, shown: str) -> None:
    assert printable(text) == shown


def test_a_message_is_one_line() -> None:
    assert one_line("a\n  b\x1b[31m\tc") == r"a b\x1b[31m c"


def test_a_refused_key_with_control_characters_is_escaped(tmp_path: Path) -> None:
    asked = ["plans.source=files", f"plans.root={tmp_path}/no\x1b[2Jthing", f"artifacts={tmp_path}/out"]
    done = run([sys.executable, "-m", "pipeline.stages.plans", *asked], cwd=ROOT)
    assert done.returncode == 1
    assert r"no\x1b[2Jthing" in done.stderr
    assert "\x1b" not in done.stderr + done.stdout
