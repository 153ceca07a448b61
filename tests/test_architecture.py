import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "lerobot_excav"
MODULES = sorted(PACKAGE.rglob("*.py"))

# Each part may import itself, what stands before it in its row, and errors.
LAYERS = [
    ["envs.soil", "envs.machines", "envs.masks", "envs.tasks", "envs", "robots", "teleoperators", "datasets", "evaluation", "scripts"],
    ["policies"],
]
# The list of what is registered names everything; the benchmark and the export use the policies from outside.
FREE = {"plugin", "evaluation.speed", "scripts.main", "scripts.export"}


def name_of(path):
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")


def part_of(module):
    """Return the row and rank of the layer that a module belongs to, by its longest matching name."""
    matches = [
        (len(layer), row, rank)
        for row, layers in enumerate(LAYERS)
        for rank, layer in enumerate(layers)
        if module == layer or module.startswith(f"{layer}.")
    ]
    return max(matches)[1:] if matches else None


def imported_modules(path):
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module]
        yield from (n.removeprefix("lerobot_excav.") for n in names if n.startswith("lerobot_excav."))


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_run_one_way(path):
    importer = name_of(path)
    if importer in FREE or part_of(importer) is None:
        return
    row, rank = part_of(importer)
    for imported in imported_modules(path):
        if imported in ("errors", "plugin"):
            continue
        imported_row, imported_rank = part_of(imported)
        assert imported_row == row, f"{importer} imports {imported}"
        assert imported_rank <= rank, f"{importer} imports {imported}"


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_files_and_functions_stay_short(path):
    text = path.read_text()
    assert text.count("\n") <= 400
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno - node.lineno + 1 <= 60, node.name


@pytest.mark.parametrize("path", sorted((PACKAGE / "envs/soil").rglob("*.py")), ids=name_of)
def test_soil_knows_nothing_of_mujoco(path):
    assert "import mujoco" not in path.read_text()


def test_importing_the_package_imports_nothing_heavy():
    code = (
        "import sys, lerobot_excav; "
        "print([m for m in ('torch', 'mujoco', 'numba', 'lerobot', 'datasets') if m in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "[]"
