"""The layers and packages of warpdyn: each imports only earlier ones, and `import warpdyn` imports next to nothing."""

import ast
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest

import warpdyn as wd

pytestmark = pytest.mark.fast

PACKAGE = Path(wd.__file__).parent
STUDIES = Path(__file__).parents[1] / "studies"
# The packages of each layer. A package imports only packages before it. Only tests and users import `truth`, the exact
# solutions.
LAYERS = {
    "foundations": ("core", "files"),
    "engine": ("tracing", "methods", "device", "laws", "controllers", "kernels"),
    "model": ("structures", "ground_motions", "control", "scene", "inventories", "sites"),
    "campaigns": (
        "integration",
        "accuracy",
        "preparation",
        "portfolio",
        "reductions",
        "incremental",
        "running",
        "live",
        "inference",
    ),
    "answers": ("fragility", "risk", "sensitivity", "reliability", "contents"),
    "interfaces": ("exchange", "plots", "reports", "hybrid", "live_display", "command_line"),
}
PACKAGES = [f"{layer}.{package}" for layer, packages in LAYERS.items() for package in packages]
MOST_FILES = 13  # a dozen, and `__init__.py`
MOST_LINES = 400
MOST_HOMONYMS = 1  # functions of the same name in other packages
# `warpdyn.kernels.source` and `warpdyn.laws.certify` import later packages when they are called.
IMPORTS_LATER_PACKAGE = {("engine.kernels", "campaigns.integration"), ("engine.laws", "campaigns.running")}


def imported_packages(source: str) -> set[str]:
    """Return the packages that a module's source imports, anywhere in it, as "layer.package"."""
    modules: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module is not None:
            modules |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", None) == "import_module":
            modules |= {value.value for value in node.args if isinstance(value, ast.Constant)}
    return {".".join(module.split(".")[1:3]) for module in modules if module.startswith("warpdyn.")}


def folders() -> list[Path]:
    return [folder for folder in PACKAGE.rglob("*") if folder.is_dir() and any(folder.glob("*.py"))]


def test_there_are_no_other_layers_and_packages():
    found = {folder.relative_to(PACKAGE).parts for folder in folders()}
    assert {parts[0] for parts in found} == {*LAYERS, "truth"}
    assert {".".join(parts[:2]) for parts in found if len(parts) > 1} == set(PACKAGES)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_imports_only_packages_before_it(package):
    later = {*PACKAGES[PACKAGES.index(package) + 1 :], "truth"}
    for path in (PACKAGE / package.replace(".", "/")).rglob("*.py"):
        allowed = {other for one, other in IMPORTS_LATER_PACKAGE if one == package}
        wrong = imported_packages(path.read_text()) & later - allowed
        assert not wrong, f"{path.relative_to(PACKAGE)} imports {', '.join(sorted(wrong))}, which are after {package}"


def test_the_rule_detects_every_kind_of_import():
    source = """
import warpdyn.interfaces.plots
from warpdyn.campaigns import running
def f():
    from warpdyn.campaigns.portfolio.groups import g
    importlib.import_module('warpdyn.campaigns.accuracy.pilot')
"""
    packages = {"interfaces.plots", "campaigns.running", "campaigns.portfolio", "campaigns.accuracy"}
    assert imported_packages(source) == packages


def test_a_folder_holds_a_dozen_files_at_most():
    for folder in folders():
        assert len(list(folder.glob("*.py"))) <= MOST_FILES, folder.relative_to(PACKAGE)


def lines_of(path: Path) -> int:
    return len(path.read_text().splitlines())


def test_files_are_short():
    files = [*PACKAGE.rglob("*.py"), *Path(__file__).parent.glob("*.py"), *STUDIES.rglob("*.py")]
    too_long = {path: lines_of(path) for path in files if lines_of(path) > MOST_LINES}
    assert not too_long


def packages_of_functions() -> dict[str, set[str]]:
    """Return the packages that define a function of a name, outside of classes and other functions."""
    packages: dict[str, set[str]] = defaultdict(set)
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.FunctionDef):
                packages[node.name].add(".".join(path.relative_to(PACKAGE).parts[:2]))
    return packages


def test_a_function_has_few_homonyms():
    # A search for a name finds its definition.
    packages = packages_of_functions()
    shared = {name: sorted(found) for name, found in packages.items() if len(found) > 1 + MOST_HOMONYMS}
    assert not shared


def test_no_public_name_hides_a_module():
    modules = {path.stem for path in PACKAGE.glob("*.py")} | set(LAYERS)
    assert not modules & set(wd.__all__)


def modules_after(statements: str) -> set[str]:
    """Return the modules that a fresh interpreter holds after some statements."""
    script = f"{statements}\nimport sys\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_import_loads_no_heavy_module():
    loaded = modules_after("import warpdyn")
    assert not loaded & {"warp", "numpy", "scipy", "xarray", "matplotlib"}


def test_warp_is_loaded_when_something_runs():
    scene = """
import warpdyn as wd
from warpdyn import plots, records
building = wd.ShearBuilding(1.0, 100.0, 3.0, law="bouc_wen", yield_force=1.0, hardening_ratio=0.1)
motion = wd.GroundMotion([0.0, 1.0, 0.0], 0.01, "pulse")
scene = wd.Scene(building, wd.Stripes([motion], [0.1], wd.PeakGroundAcceleration()))
assert wd.records is records
"""
    assert not modules_after(scene) & {"warp", "scipy.optimize"}
    # Of a kernel that other tests compile too.
    assert "warp" in modules_after(scene + "wd.response_spectra([motion], [0.5], [0.05])")


def test_a_run_imports_only_what_it_needs():
    script = """
import warpdyn as wd
building = wd.ShearBuilding(1.0, 100.0, 3.0)
scene = wd.Scene(building, wd.GroundMotion([0.0, 1.0, 0.0], 0.01, "pulse"))
building.fundamental_period
wd.simulate(scene, device="cpu")
"""
    # xarray imports Dask for some operations, if Dask is installed, which takes 0.3 s.
    assert not modules_after(script) & {"dask", "matplotlib", "scipy.sparse", "warpdyn.model.structures.frames.frame"}


def test_every_public_name_is_found():
    for name in wd.__all__:
        assert getattr(wd, name) is not None
    assert "simulate" in dir(wd)
