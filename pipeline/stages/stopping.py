"""Signals and disks: what ends a run from outside, as an exit code and one sentence."""

import errno
import os
import signal
import subprocess
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from types import FrameType

import psutil

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_GRACE_S = 15.0

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NOT_ALLOWED = (errno.EROFS, errno.EACCES, errno.EPERM)


class Stopped(KeyboardInterrupt):
    """A signal asked the program to end. What is under way is cleaned up as after Ctrl-C."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.exit_code = 128 + number


@contextmanager
def ending_by_signal() -> Iterator[None]:
    """Raise :class:`Stopped` where one of the ENDING signals arrives, so that nothing half-written stays behind."""

    def stop(number: int, _: FrameType | None) -> None:
        raise Stopped(number)

    before = {number: signal.signal(number, stop) for number in ENDING if signal.getsignal(number) != signal.SIG_IGN}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def run_below(command: Sequence[str], environment: Mapping[str, str]) -> int:
    """Run ``command`` in a process group of its own and return its exit code; when stopped, all of the group ends.

    ``command`` itself gets SIGINT, as from Ctrl-C, and all below it SIGTERM, which no worker answers with a trace. What
    still runs after 15 s is killed.
    """
    with subprocess.Popen(command, env=environment, start_new_session=True) as below:
        try:
            return below.wait()
        except BaseException:
            _end_group(below)
            raise


def _end_group(below: subprocess.Popen[bytes]) -> None:
    try:
        for process in psutil.Process(below.pid).children(recursive=True):
            with suppress(psutil.NoSuchProcess):
                process.terminate()
        below.send_signal(signal.SIGINT)
        limit = time.monotonic() + _GRACE_S
        while time.monotonic() < limit and (below.poll() is None or _tell_group(below.pid, 0)):
            time.sleep(0.05)
    except psutil.NoSuchProcess:
        return  # it ended by itself in this very moment
    finally:
        _tell_group(below.pid, signal.SIGKILL)


def _tell_group(leader: int, number: int) -> bool:
    """Send a signal to the group of ``leader``; return whether anybody is left in it."""
    try:
        os.killpg(leader, number)
    except (ProcessLookupError, PermissionError):
        return False
    return True


def disk_words(error: OSError) -> str:
    """Return what the system refused as a sentence that names the file and says what to do."""
    reason = error.strerror or str(error)
    file = error.filename2 or error.filename
    what = f"{file}: {reason}" if file else reason
    if error.errno in _NO_ROOM:
        return f"{what}. Make room, then run the same command again: what is finished is kept."
    if error.errno in _NOT_ALLOWED:
        return f"{what}. Give permission to write there, or choose another folder (artifacts=... for a single stage)."
    return f"{what}. HINTERLAND_TRACEBACK=1 shows where it happened."
