"""The order of subgoals."""

import numpy as np
import pytest

from pipeline.planning.expected_cost import order_subgoals


@pytest.mark.parametrize("count", [4, 8, 12, 15, 18, 20])
def test_order(benchmark, count: int) -> None:
    benchmark.group = "order of subgoals"
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 50, (count, 2))
    pairs = np.linalg.norm(points[:, None] - points[None], axis=2)
    # P of 0.02 to 0.2 leaves the most to decide: no order is good at a glance.
    p, success, exploration = rng.uniform(0.02, 0.2, count), rng.uniform(10, 90, count), rng.uniform(1, 60, count)
    found = benchmark(order_subgoals, pairs[0] + 1.0, pairs, p, success, exploration)
    assert sorted(found.order) == list(range(count))
    benchmark.extra_info |= {"ms": 1e3 * benchmark.stats.stats.median}
