"""Solvers for the order in which to try subgoals: exactly, and with a bound where there are many."""
