"""BLAS uses one thread while many small matrices are computed, and its own number of threads before and after."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from warpdyn.foundations.core.thread_pool import in_parts

pytestmark = pytest.mark.fast


@pytest.fixture(autouse=True)
def two_threads():
    with threadpool_limits(limits=2, user_api="blas"):
        yield


def threads():
    np.linalg.eigvalsh(np.eye(2))
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def test_parts_use_one_thread_of_blas_each():
    assert in_parts(lambda part: threads(), 4, 2, at_a_time=1) == [{1}] * 4
    assert in_parts(lambda part: threads(), 4, 2, at_a_time=4) == [{1}]
    assert in_parts(lambda part: threads(), 1, 2) == [{2}]  # a single matrix may be large
    assert threads() == {2}


def test_the_number_of_threads_is_restored_if_a_part_fails():
    def fails(part):
        raise ValueError("part")

    with pytest.raises(ValueError, match="part"):
        in_parts(fails, 4, 2, at_a_time=1)
    assert threads() == {2}


def test_parts_in_several_threads_restore_the_number():
    def computes():
        return in_parts(lambda part: threads(), 4, 2, at_a_time=1)

    with ThreadPoolExecutor(4) as pool:
        for task in [pool.submit(computes) for _ in range(40)]:
            task.result()
    assert threads() == {2}
