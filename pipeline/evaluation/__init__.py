"""Trials as tables, and what they say: paired costs, ratios with intervals, RANSAC fits, calibration."""
