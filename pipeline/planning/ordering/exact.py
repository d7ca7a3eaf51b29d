"""The exact ordering: a dynamic programme over subsets, block by block.

With W(a, S) the expected cost that remains after subgoal ``a`` has failed while the set S is untried,

    W(a, {}) = 0
    W(a, S)  = min over b in S of  D(a, b) + onward(b, S)
    onward(b, S) = gain_b + (1 - P_b) W(b, S - b)

so n subgoals cost n^2 2^n / 4 steps instead of n! orderings. A subset is a number whose bit b says whether b is in it.
Subsets are walked in ascending blocks of 32 that differ in the five lowest subgoals only. For a pair of other subgoals
the minimum is then a loop over contiguous numbers, which compiles to vector code; inside a block the five wait for each
other, one subset after the other. Kept between blocks is W(a, S) of the other subgoals alone, without bit a of S, since
a is never in it: (n - 5) 2^(n - 1) numbers, 63 MB for n = 20. No choice is stored: the best ordering is read off by
solving again the blocks that lie along it.
"""

import numpy as np
from numba import njit

from pipeline.planning.ordering.problem import Indices, Problem, Vector

LOW = 5
BLOCK = 1 << LOW


def solve_exactly(problem: Problem) -> tuple[Indices, float]:
    """Return the ordering of least expected cost, and that cost; memory doubles with every subgoal.

    Where several subgoals are equally good to try next, the one with the lowest index comes first.
    """
    count = problem.gain.size
    legs, gain, fail = problem
    if count < LOW:  # every block needs its low subgoals; one that is made up is in no subset that is read
        legs, gain, fail = np.zeros((LOW + 1, LOW)), np.zeros(LOW), np.zeros(LOW)
        legs[:count, :count], legs[LOW, :count] = problem.legs[:-1], problem.legs[-1]
        gain[:count], fail[:count] = problem.gain, problem.fail
    high = gain.size - LOW
    # Numpy asks the system for huge pages and numba would not, which costs 20 subgoals almost half their time.
    table = np.empty((high, (1 << high) // 2, BLOCK))
    order, cost = _solve(legs, gain, fail, count, table)
    return order, float(cost)


@njit(cache=True, nogil=True)
def _solve(legs: Vector, gain: Vector, fail: Vector, count: int, table: Vector) -> tuple[Indices, float]:
    order = np.empty(count, dtype=np.int64)
    cost = 0.0
    last = gain.size  # the robot
    subset = (1 << count) - 1
    for step in range(count):
        block = subset >> LOW
        members, onward = _solve_blocks(block if step else 0, block + 1, legs, gain, fail, table)
        first, least = -1, np.inf
        for k in range(members.size):
            b = members[k]
            if subset >> b & 1:
                total = legs[last, b] + onward[k, subset & (BLOCK - 1)]
                if total < least or first < 0:
                    least, first = total, b
        if step == 0:
            cost = least
        order[step] = last = first
        subset ^= 1 << first
    return order, cost


@njit(cache=True, nogil=True)
def _solve_blocks(
    start: int, stop: int, legs: Vector, gain: Vector, fail: Vector, table: Vector
) -> tuple[Indices, Vector]:
    """Extend ``table`` over the blocks from ``start`` to ``stop``.

    Returns members [M], the subgoals of the last block, ascending, and onward [M.., BLOCK]: onward(members[k], S) for
    every subset S of that block, inf where members[k] is not in S.
    """
    size = gain.size
    near = np.empty((LOW, BLOCK))  # W(a, S) of the low subgoals, in this block
    onward = np.empty((size + 2, BLOCK))
    members = np.zeros(size + 2, dtype=np.int64)  # the low subgoals and those that the whole block holds
    others = np.zeros(size, dtype=np.int64)  # the low subgoals and those that it does not hold
    for b in range(LOW):
        members[b] = others[b] = b
    held = LOW
    for block in range(start, stop):
        held = rest = LOW
        for high in range(size - LOW):
            if block >> high & 1:
                members[held] = LOW + high
                _look_on(onward[held], gain[LOW + high], fail[LOW + high], table[high, _without(block, high)])
                held += 1
            else:
                others[rest] = LOW + high
                rest += 1
        for low in range(BLOCK):  # members come in threes below
            onward[held, low] = onward[held + 1, low] = np.inf
        for j in range(rest):
            a = others[j]
            first, least = (LOW, near[a]) if j < LOW else (0, table[a - LOW, _without(block, a - LOW)])
            _reach(least, block, first, held, legs[a], members, onward)
            if j == LOW - 1:
                _settle(legs, gain, fail, near, onward)
    return members[:held], onward


@njit(inline="always")
def _look_on(onward: Vector, gain: float, fail: float, after: Vector) -> None:
    """Set onward(b, S) for every subset of a block that holds b, from ``after``, W(b, S - b)."""
    for low in range(BLOCK):
        onward[low] = gain + fail * after[low] if fail > 0.0 else gain  # a sure subgoal ends it, even before inf


@njit(inline="always")
def _reach(least: Vector, block: int, first: int, held: int, leg: Vector, members: Indices, onward: Vector) -> None:
    """Set ``least`` to W(a, S) for every subset of the block, as far as members from ``first`` to ``held`` go."""
    for low in range(BLOCK):
        least[low] = np.inf
    if block == 0:
        least[0] = 0.0  # nothing left to try
    for k in range(first, held, 3):  # three at a time, so that ``least`` is read and written a third as often
        leg_1, leg_2, leg_3 = leg[members[k]], leg[members[k + 1]], leg[members[k + 2]]
        for low in range(BLOCK):
            so_far = least[low]
            by_1, by_2, by_3 = leg_1 + onward[k, low], leg_2 + onward[k + 1, low], leg_3 + onward[k + 2, low]
            by_1 = by_1 if by_1 < by_2 else by_2
            by_3 = by_3 if by_3 < so_far else so_far
            least[low] = by_1 if by_1 < by_3 else by_3


@njit(inline="always")
def _settle(legs: Vector, gain: Vector, fail: Vector, near: Vector, onward: Vector) -> None:
    """Complete ``near`` and the first rows of ``onward``: the low subgoals, one subset after the other."""
    for b in range(LOW):
        for low in range(BLOCK):
            onward[b, low] = np.inf
    for low in range(1, BLOCK):
        for b in range(LOW):
            if low >> b & 1:
                total = gain[b] + fail[b] * near[b, low ^ (1 << b)] if fail[b] > 0.0 else gain[b]
                onward[b, low] = total
                for a in range(LOW):
                    if not low >> a & 1:
                        so_far, by_b = near[a, low], legs[a, b] + total
                        near[a, low] = by_b if by_b < so_far else so_far


@njit(inline="always")
def _without(block: int, bit: int) -> int:
    """Return the number with one bit taken out and those above it moved down."""
    return (block & ((1 << bit) - 1)) | (block >> (bit + 1) << bit)
