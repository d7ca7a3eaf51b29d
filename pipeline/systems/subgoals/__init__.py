"""Learned Subgoal Planning (Stein, Bradley, Roy, CoRL 2018): labels, inputs, estimators, planner."""
