"""Thin entry points, one per DVC stage: read files, call the packages below, write files.

Threads are limited here because every stage imports this package before numpy or torch: two OpenMP threads gain
nothing on networks of this size and cost up to fifty times the time on a busy machine. Work is spread over processes.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")
