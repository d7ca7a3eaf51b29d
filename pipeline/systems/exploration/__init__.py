"""Exploration: see a whole building, with no goal, on as short a way as possible."""
