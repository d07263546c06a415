"""The indexed heap against a sorted list."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh.numerics import _kernels_heap as heaps


@given(st.lists(st.tuples(st.integers(0, 11), st.sampled_from([0.0, 1.0, 2.0, 2.5, np.inf])), max_size=60))
def test_the_queue_is_a_sorted_list(puts):
    heap, expected = heaps.new_heap(12), {}
    for item, cost in puts:
        heaps.put(heap, item, cost)
        expected.pop(item, None)
        if cost < np.inf:
            expected[item] = cost
        assert heap.size[0] == len(expected)
        assert set(heap.item[: len(expected)].tolist()) == set(expected)
        assert_array_equal(heap.place[heap.item[: len(expected)]], np.arange(len(expected)))
        if expected:
            assert heap.item[0] == min(expected, key=lambda x: (expected[x], x))
    order = []
    while heap.size[0]:
        order.append(int(heap.item[0]))
        heaps.put(heap, order[-1], np.inf)
    assert order == sorted(expected, key=lambda x: (expected[x], x))
