"""Solvers for the order in which to try subgoals: exactly, and with a bound where there are many."""

from typing import Final

MOST_EXACT: Final = 20
MOST_SUBGOALS: Final = 62  # a set of subgoals and the robot are the bits of one number
