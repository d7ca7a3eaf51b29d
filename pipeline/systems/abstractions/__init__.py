"""Perceptually informed abstractions (Stadler 2020, chapter 5)."""
