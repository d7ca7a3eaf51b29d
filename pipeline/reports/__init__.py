"""Figures and the HTML report, drawn from the files of earlier stages and nothing else."""
