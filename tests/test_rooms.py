"""The packages of warpdyn: each imports only those before it, and `import warpdyn` imports next to nothing."""

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
# A room imports only rooms before it. Nothing but tests and users imports `truth`, the exact solutions.
ROOMS = (
    "core",
    "files",
    "methods",
    "device",
    "laws",
    "kernels",
    "structures",
    "ground_motions",
    "scene",
    "inventories",
    "sites",
    "integration",
    "accuracy",
    "portfolio",
    "reduction",
    "incremental",
    "running",
    "statistics",
    "risk",
    "exchange",
    "plots",
    "reports",
)
MOST_FILES = 13  # a dozen or so, and `__init__.py`
MOST_LINES = 400
MOST_HOMONYMS = 1  # of a function, in other rooms
# `warpdyn.kernels.source` asks the room that knows what a scene needs, when it is called.
IMPORTS_LATER_ROOM = {("kernels", "integration")}


def imported_rooms(source: str) -> set[str]:
    """Return the rooms that a module's source imports, anywhere in it."""
    modules: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module == "warpdyn":
            modules |= {f"warpdyn.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module is not None:
            modules.add(node.module)
        elif isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", None) == "import_module":
            modules |= {value.value for value in node.args if isinstance(value, ast.Constant)}
    return {module.split(".")[1] for module in modules if module.startswith("warpdyn.")}


def folders() -> list[Path]:
    return [folder for folder in PACKAGE.rglob("*") if folder.is_dir() and any(folder.glob("*.py"))]


def test_there_are_no_other_rooms():
    assert {folder.relative_to(PACKAGE).parts[0] for folder in folders()} == {*ROOMS, "truth"}


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_rooms_before_it(room):
    later = {*ROOMS[ROOMS.index(room) + 1 :], "truth"}
    for path in (PACKAGE / room).rglob("*.py"):
        wrong = imported_rooms(path.read_text()) & later - {other for one, other in IMPORTS_LATER_ROOM if one == room}
        assert not wrong, f"{path.relative_to(PACKAGE)} imports {', '.join(sorted(wrong))}, which stand after {room}"


def test_the_rule_sees_every_kind_of_import():
    source = "import warpdyn.plots\nfrom warpdyn import running\ndef f():\n    from warpdyn.portfolio.groups import g\n"
    source += "    importlib.import_module('warpdyn.accuracy.pilot')\n"
    assert imported_rooms(source) == {"plots", "running", "portfolio", "accuracy"}


def test_a_folder_holds_a_dozen_files_at_most():
    for folder in folders():
        assert len(list(folder.glob("*.py"))) <= MOST_FILES, folder.relative_to(PACKAGE)


def lines_of(path: Path) -> int:
    return len(path.read_text().splitlines())


def test_files_are_short():
    files = [*PACKAGE.rglob("*.py"), *Path(__file__).parent.glob("*.py"), *STUDIES.rglob("*.py")]
    too_long = {path: lines_of(path) for path in files if lines_of(path) > MOST_LINES}
    assert not too_long


def rooms_of_functions() -> dict[str, set[str]]:
    """Return the rooms that define a function of a name, outside of classes and other functions."""
    rooms: dict[str, set[str]] = defaultdict(set)
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.FunctionDef):
                rooms[node.name].add(path.relative_to(PACKAGE).parts[0])
    return rooms


def test_a_function_has_few_homonyms():
    # Who searches for a name finds what is meant.
    shared = {name: sorted(rooms) for name, rooms in rooms_of_functions().items() if len(rooms) > 1 + MOST_HOMONYMS}
    assert not shared


def test_no_public_name_hides_a_module():
    modules = {path.stem for path in PACKAGE.glob("*.py")} | set(ROOMS)
    assert not modules & set(wd.__all__) - {
        "inventories",
        "kernels",
        "laws",
        "plots",
        "sites",
    }  # these are the rooms themselves


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


def test_every_public_name_is_found():
    for name in wd.__all__:
        assert getattr(wd, name) is not None
    assert "simulate" in dir(wd)
