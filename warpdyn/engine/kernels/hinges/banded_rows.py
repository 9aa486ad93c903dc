"""Text of the statements that factorise and solve a banded system, for one row and one lane.

The matrix is stored by rows: from the first column of the band to the diagonal. BAND rows of zeros before and after the
matrix take the place of columns that do not exist. If all places within a row are written out, a CPU computes all lanes
at once without loops over the band.
"""

from __future__ import annotations


def factor_of_row(band: int) -> str:
    """Return statements that compute row k of the factor of a matrix with this half bandwidth, for lane j."""
    lines = []
    for column in range(band):
        lines.append(f"factor_{column} = lower_factor[row_place + {column}, j]")
        for other in range(column):
            at = (band + 1) * column + other - column + band
            lines.append(f"factor_{column} -= factor_{other} * lower_factor[first_place + {at}, j]")
    lines.append(f"pivot = lower_factor[row_place + {band}, j]")
    for column in range(band):
        lines.append(f"scaled_{column} = factor_{column} * inverse_pivot[k + {column}, j]")
        lines.append(f"pivot -= factor_{column} * scaled_{column}")
        lines.append(f"lower_factor[row_place + {column}, j] = scaled_{column}")
    return "\n".join([*lines, f"inverse_pivot[k + {band}, j] = dtype(1.0) / pivot"])


def reduction_of_row(band: int) -> str:
    """Return statements of the forward substitution in row k, for lane j."""
    terms = [f"reduced_now -= lower_factor[row_place + {at}, j] * reduced[k + {at}, j]" for at in range(band)]
    return "\n".join(["reduced_now = entry_now[j]", *terms, f"reduced[k + {band}, j] = reduced_now"])


def solution_of_row(band: int) -> str:
    """Return statements of the backward substitution in row k, for lane j."""
    lines = [f"solved_now = reduced[k + {band}, j] * inverse_pivot[k + {band}, j]"]
    for at in range(1, band + 1):
        # Column k of the row that is `at` rows above.
        lines.append(f"solved_now -= lower_factor[row_place + {(band + 1) * at + band - at}, j] * solved[k + {at}, j]")
    return "\n".join([*lines, "solved[k, j] = solved_now"])
