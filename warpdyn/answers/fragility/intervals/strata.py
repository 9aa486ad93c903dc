"""Strata of records: if each level of a multiple stripe analysis has its own records, only these are compared.

The variances of the strata are added (stratified sampling: Cochran 1977, Sampling Techniques, section 5.3).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def strata_of_records(is_run: np.ndarray) -> np.ndarray:
    """Return the number of each record's stratum, shape [record]: records that share a level are in one stratum.

    Sharing is transitive: A and C are in one stratum if A shares a level with B, and B shares a level with C. Records
    that all run at every level (crossed design) are one stratum. If no two records share a level, all records are one
    stratum too: they are one sample of records and levels. A stratum with only one record is merged with the stratum at
    the next higher level (collapsed strata: Cochran 1977, section 5A.12), which is conservative.

    Args:
        is_run: Whether a record has samples at a level, shape [record, im_level], levels increasing.
    """
    records, levels = is_run.shape
    record, level = np.nonzero(is_run)
    links = coo_matrix((np.ones(record.size), (record, records + level)), shape=(records + levels,) * 2)
    stratum = connected_components(links, directed=False)[1][:records]
    numbers, stratum, sizes = np.unique(stratum, return_inverse=True, return_counts=True)
    if numbers.size == 1 or (sizes == 1).all():
        return np.zeros(records, dtype=np.int64)
    lowest = np.full(numbers.size, levels)
    np.minimum.at(lowest, stratum[record], level)
    order = np.argsort(lowest, kind="stable")  # the strata in the order of their lowest level
    merged, count, waiting = np.zeros(numbers.size, dtype=np.int64), 0, 0
    for place in order:
        merged[place] = count
        waiting += sizes[place]
        if waiting > 1:
            count, waiting = count + 1, 0
    if waiting == 1:  # the stratum of the highest level has only one record
        merged[order[-1]] = count - 1
    return merged[stratum]
