"""What variables of a dataset say of themselves."""

import xarray as xr


def check_labels(dataset: xr.Dataset, leave_out: tuple[str, ...] = ()) -> None:
    """Assert that every variable has a long name, and units unless it is text, which has none."""
    for name, variable in dataset.variables.items():
        if name in leave_out:
            continue
        assert "long_name" in variable.attrs, name
        is_text = variable.dtype.kind in "UOT"
        assert ("units" in variable.attrs) != is_text, name
