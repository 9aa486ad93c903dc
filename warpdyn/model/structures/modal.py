"""Undamped modes of a structure, and damping matrices that are computed from modes."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.linalg import eigh

from warpdyn.engine.tracing.arrays import is_traced
from warpdyn.foundations.core.checks import check_dataset, shortened, unmasked
from warpdyn.foundations.core.description import Text

# A squared frequency is rounding if it is below ROUNDINGS * number of modes * machine epsilon times the highest one.
ROUNDINGS = 16


def undamped_modes(stiffness: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the squared circular frequencies and the shapes of undamped modes, by increasing frequency.

    Squared frequencies of rigid-body modes are exactly 0. Shapes are scaled to unit modal mass.

    Args:
        stiffness: Stiffness matrix [N/m], symmetric, shape [dof, dof].
        mass: Mass matrix [kg], symmetric and positive definite, shape [dof, dof].

    Returns:
        Squared circular frequencies [rad2/s2], shape [mode], and mode shapes, shape [dof, mode].
    """
    squared, shape = eigh(stiffness, mass)
    rounding = len(squared) * ROUNDINGS * np.finfo(float).eps * np.abs(squared).max()
    return np.where(np.abs(squared) <= rounding, 0.0, squared), shape


def modal_properties(
    mass: np.ndarray,
    stiffness: np.ndarray,
    influence: np.ndarray | None = None,
    *,
    load_mass: np.ndarray | None = None,
    may_move_freely: bool = False,
) -> xr.Dataset:
    """Return periods, shapes, participation factors and effective masses of undamped modes, by increasing frequency.

    Each shape is scaled so that its largest component is +1; participation factors refer to the scaled shapes. See
    Chopra, Dynamics of Structures, sections 10.2 and 13.2.

    Args:
        mass: Masses [kg], shape [dof], or mass matrix, symmetric and positive definite, shape [dof, dof].
        stiffness: Stiffness matrix [N/m], symmetric and positive definite, shape [dof, dof].
        influence: Displacement of each degree of freedom (DOF) per unit base displacement [1], shape [dof]; None: ones.
            For several components of base motion: shape [dof, component].
        load_mass: Mass matrix of the load [kg], shape [dof, dof]; None: the mass.
        may_move_freely: Whether the stiffness may be singular, so that some periods (but not all) are infinite.

    Returns:
        Dataset with the dimensions `mode` and `dof`; periods in s, effective masses in kg. Participation factors and
        effective masses also have the dimension `component` if `influence` has several columns.

    Raises:
        ValueError: If a shape is wrong, or a matrix is asymmetric, singular or not positive definite.
    """
    matrix, stiffness = _checked_matrices(mass, stiffness)
    influence = np.ones(len(matrix)) if influence is None else unmasked("influence", influence, np.float64)
    is_vector = influence.ndim == 1
    if influence.ndim > 2 or len(influence) != len(matrix) or not np.isfinite(influence).all() or not influence.any():
        raise ValueError(f"influence must be finite, not all 0, and of shape [{len(matrix)}], got {influence}")
    eigenvalue, shape = _checked_modes(matrix, stiffness, may_move_freely=may_move_freely)
    shape = shape.T  # [mode, dof]
    shape /= np.take_along_axis(shape, np.abs(shape).argmax(axis=1)[:, None], axis=1)
    modal_mass = np.einsum("mi,ij,mj->m", shape, matrix, shape)
    pull = (matrix if load_mass is None else load_mass) @ influence
    excitation = shape @ pull
    modal_mass = modal_mass if is_vector else modal_mass[:, None]
    effective_mass = excitation**2 / modal_mass
    total = effective_mass.sum(axis=0)  # of all modes: the moved mass, influence^T M influence
    omega = np.sqrt(eigenvalue)
    with np.errstate(divide="ignore"):
        period = 2 * np.pi / omega
    columns = {
        "period": (period, "natural period", "s"),
        "circular_frequency": (omega, "natural circular frequency", "rad s-1"),
        "participation_factor": (excitation / modal_mass, "modal participation factor", "1"),
        "effective_mass": (effective_mass, "effective modal mass", "kg"),
        "effective_mass_ratio": (effective_mass / np.where(total > 0, total, 1.0), "effective modal mass ratio", "1"),
    }
    dims = ("mode", "component")
    dataset = xr.Dataset(
        {k: (dims[: v.ndim], v, {"long_name": name, "units": unit}) for k, (v, name, unit) in columns.items()}
    )
    if not is_vector:
        numbers = np.arange(1, influence.shape[1] + 1)
        dataset["component"] = ("component", numbers, {"long_name": "component of the base motion", "units": "1"})
    dataset["shape"] = (("mode", "dof"), shape, {"long_name": "mode shape, largest component 1", "units": "1"})
    return dataset.assign_coords(
        mode=("mode", np.arange(1, len(omega) + 1), {"long_name": "mode number", "units": "1"}),
        dof=("dof", np.arange(1, len(omega) + 1), {"long_name": "degree of freedom", "units": "1"}),
    )


def natural_periods(mass: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the periods of the undamped modes [s], longest first, shape [mode]; arguments as for `modal_properties`.

    It makes no dataset, whose first variable imports Dask if Dask is installed, which takes 0.3 s.
    """
    matrix, stiffness = _checked_matrices(mass, stiffness)
    eigenvalue, _ = _checked_modes(matrix, stiffness)
    return 2 * np.pi / np.sqrt(eigenvalue)


def _checked_matrices(mass: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass and the stiffness matrix; raise a ValueError if one is not symmetric, or a mass is missing."""
    mass = unmasked("mass", mass, np.float64)
    stiffness = unmasked("stiffness", stiffness, np.float64)
    matrix = np.diag(mass) if mass.ndim == 1 else mass
    for name, value in (("mass", matrix), ("stiffness", stiffness)):
        if value.ndim != 2 or value.shape != (len(mass), len(mass)) or value.size == 0:
            raise ValueError(f"{name} must be square with one row per DOF ({len(mass)}), got shape {value.shape}")
        _check_symmetric(name, value)
    least, *_, most = np.linalg.eigvalsh(matrix)[[0, -1]]
    if least <= len(matrix) * np.finfo(float).eps * most:
        raise ValueError(
            f"mass must be positive definite, but its least eigenvalue is {least:.6g} kg: give every degree of freedom "
            "mass"
        )
    return matrix, stiffness


def _checked_modes(
    mass: np.ndarray, stiffness: np.ndarray, *, may_move_freely: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return the result of `undamped_modes`; raise a ValueError if a mode moves freely that may not."""
    eigenvalue, shape = undamped_modes(stiffness, mass)
    if may_move_freely and (eigenvalue[0] < 0 or not eigenvalue.any()):
        what = "negative" if eigenvalue[0] < 0 else "all 0"
        raise ValueError(
            f"eigenvalues of the stiffness are {what} (least generalised eigenvalue {eigenvalue[0]:.6g} rad2/s2): "
            "some may be 0 (rigid-body modes), but none may be negative, and at least one must be above 0. Correct the "
            "matrix"
        )
    if not may_move_freely and eigenvalue[0] <= 0:
        raise ValueError(
            f"stiffness must be positive definite; its generalised eigenvalues are {eigenvalue[0]:.6g} to "
            f"{eigenvalue[-1]:.6g} rad2/s2 (a part of the structure can move freely): correct the matrix, or restrain "
            "this part"
        )
    return eigenvalue, shape


def modal_table(modes: xr.Dataset) -> str:
    """Return the modes as a text table: periods, frequencies, participation, effective masses and their sums.

    For several components of base motion, the table has columns of effective masses for each component.

    Args:
        modes: The result of a structure's `modal()`, or some modes of it, such as `modal().isel(mode=slice(3))`.

    Raises:
        ValueError, TypeError: If `modes` is not the result of `modal()`.

    Example:
        >>> print(wd.modal_table(building.modal()))
        mode  period [s]  frequency [Hz]  participation  effective mass [t]    share  sum of shares
           1     0.53208          1.8794         1.1934              183.21  91.60 %        91.60 %
           2     0.21419          4.6688         0.3613              16.795   8.40 %       100.00 %
    """
    check_dataset(
        "modal_table", modes, "period", "effective_mass_ratio", advice="give building.modal()", argument="modes"
    )
    columns = [
        ["mode", *(f"{mode:d}" for mode in modes["mode"].values)],
        ["period [s]", *(f"{period:.5g}" for period in modes["period"].values)],
        ["frequency [Hz]", *(f"{omega / (2 * np.pi):.5g}" for omega in modes["circular_frequency"].values)],
    ]
    if "component" in modes.dims:
        parts = {f"base {each}: ": modes.sel(component=each) for each in modes["component"].values}
    else:
        parts = {"": modes}
    for name, part in parts.items():
        ratio = 100 * part["effective_mass_ratio"].values
        if not name:
            columns.append(["participation", *(f"{factor:.4f}" for factor in part["participation_factor"].values)])
        columns += [
            [f"{name}effective mass [t]", *(f"{mass / 1000:.5g}" for mass in part["effective_mass"].values)],
            ["share", *(f"{share:.2f} %" for share in ratio)],
            ["sum of shares", *(f"{share:.2f} %" for share in np.cumsum(ratio))],
        ]
    rows = list(zip(*columns, strict=True))
    widths = [max(len(row[column]) for row in rows) for column in range(len(columns))]
    return Text(
        "\n".join("  ".join(f"{text:>{width}}" for text, width in zip(row, widths, strict=True)) for row in rows)
    )


def chain_stiffness_matrix(storey_stiffness: np.ndarray) -> np.ndarray:
    """Return the stiffness matrices of shear buildings on a fixed base.

    Args:
        storey_stiffness: Storey stiffness [N/m], from the ground up, shape [..., storey]. If dashpot coefficients
            [N s/m] are given instead, the result is the damping matrix.

    Returns:
        Stiffness [N/m], shape [..., storey, storey].

    Raises:
        ValueError: If a value is not finite, or there is no storey.
    """
    storey_stiffness = np.asarray(storey_stiffness, dtype=np.float64)
    if storey_stiffness.ndim == 0 or storey_stiffness.shape[-1] == 0 or not np.isfinite(storey_stiffness).all():
        raise ValueError(
            "storey_stiffness must be finite numbers of shape [..., storey], such as [2e8, 1e8], got "
            f"{shortened(storey_stiffness)}"
        )
    storeys = np.arange(storey_stiffness.shape[-1])
    matrix = np.zeros((*storey_stiffness.shape, storeys.size))
    matrix[..., storeys, storeys] = storey_stiffness
    matrix[..., storeys[:-1], storeys[:-1]] += storey_stiffness[..., 1:]
    matrix[..., storeys[:-1], storeys[1:]] = matrix[..., storeys[1:], storeys[:-1]] = -storey_stiffness[..., 1:]
    return matrix


def modal_damping_matrix(mass: np.ndarray, stiffness_matrix: np.ndarray, ratio: np.ndarray | float) -> np.ndarray:
    """Return damping matrices that give every mode the same damping ratio.

    C = M (sum of 2 zeta w_n phi_n phi_n^T) M with mass-normalised shapes (Chopra, Dynamics of Structures, 11.4.2).

    Args:
        mass: Masses [kg], shape [..., dof].
        stiffness_matrix: Stiffness matrices [N/m], symmetric and positive definite, shape [..., dof, dof].
        ratio: Damping ratio [-], 0 or above, shape [...] or [].

    Returns:
        Damping [N s/m], shape [..., dof, dof].

    Raises:
        ValueError: If a shape is wrong, a mass is not above 0, a ratio is below 0, or a stiffness matrix is asymmetric
            or not positive definite.
    """
    mass = _positive("mass", mass)
    stiffness_matrix = np.asarray(stiffness_matrix, dtype=np.float64)
    if stiffness_matrix.shape != (*mass.shape, mass.shape[-1]):
        raise ValueError(
            f"stiffness_matrix must have shape {(*mass.shape, mass.shape[-1])}, got {stiffness_matrix.shape}"
        )
    _check_symmetric("stiffness_matrix", stiffness_matrix)
    ratio = np.asarray(ratio, dtype=np.float64)
    if ratio.shape not in ((), mass.shape[:-1]) or not (np.isfinite(ratio) & (ratio >= 0)).all():
        raise ValueError(f"ratio must be finite, 0 or above, and of shape () or {mass.shape[:-1]}, got {ratio}")
    root = np.sqrt(mass)
    eigenvalue, shape = np.linalg.eigh(stiffness_matrix / root[..., :, None] / root[..., None, :])
    if (eigenvalue <= 0).any():
        where = [int(i) for i in np.argwhere(eigenvalue <= 0)[0][:-1]]
        raise ValueError(
            f"stiffness_matrix{where or ''} must be positive definite, but its least generalised eigenvalue is "
            f"{eigenvalue.min():.6g} rad2/s2: correct the matrix, or restrain the part that can move freely"
        )
    scaled = root[..., :, None] * shape
    return np.einsum("...im,...m,...jm->...ij", scaled, 2 * ratio[..., None] * np.sqrt(eigenvalue), scaled)


def rayleigh_coefficients(
    omega_i: np.ndarray | float, omega_j: np.ndarray | float, ratio: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return Rayleigh coefficients of C = a0 M + a1 K for a damping ratio at two frequencies (Chopra, eq. 11.4.10).

    Args:
        omega_i: Circular frequency of one mode [rad/s], shape [...].
        omega_j: Circular frequency of the other mode [rad/s], shape [...].
        ratio: Damping ratio at both frequencies [-], 0 or above, shape [...].

    Returns:
        Mass coefficient a0 [1/s] and stiffness coefficient a1 [s], each with the broadcast shape of the arguments.

    Raises:
        ValueError: If a frequency is not finite and above 0, or a ratio is not finite and 0 or above.
    """
    if not is_traced(omega_i, omega_j, ratio):
        omega_i, omega_j = _positive("omega_i", omega_i), _positive("omega_j", omega_j)
        ratio = np.asarray(ratio, dtype=np.float64)
        if not (np.isfinite(ratio) & (ratio >= 0)).all():
            raise ValueError(f"ratio must be finite and 0 or above, got {ratio}")
    a1: np.ndarray = 2 * ratio / (omega_i + omega_j)  # type: ignore[assignment] # arrays, or recorded values of a trace
    a0: np.ndarray = omega_i * omega_j * a1  # arrays, or recorded values of a trace
    return a0, a1


def _positive(name: str, value: np.ndarray | float) -> np.ndarray:
    value = np.asarray(value, dtype=np.float64)
    bad = np.argwhere(~(np.isfinite(value) & (value > 0)))
    if len(bad):
        where = [int(i) for i in bad[0]]
        raise ValueError(f"{name}{where or ''} is {value[tuple(bad[0])]:g}; it must be finite and above 0")
    return value


def _check_symmetric(name: str, matrix: np.ndarray) -> None:
    if not np.isfinite(matrix).all():
        place = [int(i) for i in np.argwhere(~np.isfinite(matrix))[0]]
        raise ValueError(f"{name}{place} is {matrix[tuple(place)]}; every value must be finite")
    gap = np.abs(matrix - np.swapaxes(matrix, -1, -2))
    if (gap > 1e-9 * np.abs(matrix).max(axis=(-2, -1), keepdims=True)).any():
        where = [int(i) for i in np.unravel_index(gap.argmax(), gap.shape)]
        raise ValueError(
            f"{name} must be symmetric; {name}{where} differs from its mirror by {gap.max():.6g}: correct the matrix"
        )
