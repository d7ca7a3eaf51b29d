"""Subgoals, the expected-cost solver, the protocols of planners and estimators, the optimistic planner."""
