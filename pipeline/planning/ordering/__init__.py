"""The exact solver for the order in which to try subgoals."""

from typing import Final

MOST_SUBGOALS: Final = 20
"""Twice the memory and the time for each one more: 63 MB and 0.1 s for 20."""
