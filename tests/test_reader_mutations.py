"""Readers of damaged files raise errors that name the file, and no others."""

import pytest
from reader_mutations import SOUND, faults, write_sound

pytestmark = pytest.mark.fast


@pytest.mark.parametrize("name", SOUND)
def test_errors_of_damaged_files_name_the_file(name, tmp_path):
    write_sound(tmp_path)
    read, wrong = faults(tmp_path, name, 25, 1)
    assert not wrong
    assert read < 25  # some are refused
