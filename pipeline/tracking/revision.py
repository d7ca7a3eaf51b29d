"""Which code and which data a run came from: the git commit, the DVC lock file and DVC's experiment."""

import hashlib
import os
import subprocess
from pathlib import Path

_DVC_VARIABLES = ("DVC_STAGE", "DVC_EXP_NAME", "DVC_EXP_BASELINE_REV")


def revision_tags(root: Path) -> dict[str, str]:
    """Return tags for the checkout at ``root``; outside git, ``git.revision`` says so."""
    commit = _git(root, "rev-parse", "HEAD")
    tags = {"git.revision": commit or "not under git"}
    if commit:
        tags["git.dirty"] = str(bool(_git(root, "status", "--porcelain", "--untracked-files=no"))).lower()
    lock = root / "dvc.lock"
    if lock.is_file():
        tags["dvc.lock_sha256"] = hashlib.sha256(lock.read_bytes()).hexdigest()
    for variable in _DVC_VARIABLES:
        if value := os.environ.get(variable):
            tags[variable.lower().replace("_", ".", 1)] = value
    return tags


def _git(root: Path, *arguments: str) -> str:
    if not (root / ".git").exists():
        return ""
    try:
        answer = subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True, timeout=20)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return answer.stdout.strip() if answer.returncode == 0 else ""
