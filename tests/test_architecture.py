import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "lerobot_excav"
MODULES = sorted(PACKAGE.rglob("*.py"))

# Each layer may import itself, what stands before it in its row, and what all share. Policies stand alone; the last of
# a row may use the other row. `plugin`, the list of what is registered with LeRobot, is imported by LeRobot alone.
LAYERS = [
    [
        *(
            "envs.constants",
            "envs.holder",
            "envs.plugins",
            "envs.soil",
            "envs.machines",
            "envs.masks",
            "envs.tasks",
            "envs",
        ),
        *("testbed", "cameras", "page", "robots", "teleoperators", "datasets", "evaluation", "console", "scripts"),
    ],
    ["policies"],
]
SHARED = {"errors", "loopback", "run_lock", "setting", "whole_file"}
DATASET_LAYERS = ["format", "pairs", "record", "complete", "check", "card", "masks", "clicks", "alignment"]
FREE = {"plugin", "scripts.export"}


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
    """Yield what a file imports of this package, also within functions; `from a import b` may mean the module `a.b`."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules = [f"{node.module}.{alias.name}" for alias in node.names]
            names = [name if (ROOT / f"{name.replace('.', '/')}.py").exists() else node.module for name in modules]
        yield from (n.removeprefix("lerobot_excav.") for n in names if n.startswith("lerobot_excav."))


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_run_one_way(path):
    importer = name_of(path)
    if importer in FREE or part_of(importer) is None:
        return
    row, rank = part_of(importer)
    for imported in imported_modules(path):
        assert imported != "plugin", f"{importer} imports the list of what is registered"
        if imported in SHARED:
            continue
        imported_row, imported_rank = part_of(imported)
        assert imported_row == row, f"{importer} imports {imported}"
        assert imported_rank <= rank, f"{importer} imports {imported}"


def test_what_all_share_knows_nobody():
    for name in SHARED:
        assert set(imported_modules(PACKAGE / f"{name}.py")) <= SHARED


def test_datasets_are_read_before_they_are_recorded_completed_and_checked():
    for path in sorted((PACKAGE / "datasets").rglob("*.py")):
        rank = DATASET_LAYERS.index(path.parent.name) if path.parent.name in DATASET_LAYERS else 0
        for imported in imported_modules(path):
            parts = imported.split(".")
            if parts[0] == "datasets" and len(parts) > 2:
                assert DATASET_LAYERS.index(parts[1]) <= rank, f"{name_of(path)} imports {imported}"


def test_no_modules_import_each_other_in_a_circle():
    graph = {name_of(path): set(imported_modules(path)) for path in MODULES}
    seen, path_here = set(), []

    def visit(module):
        assert module not in path_here, " -> ".join([*path_here[path_here.index(module) :], module])
        if module in seen or module not in graph:
            return
        seen.add(module)
        path_here.append(module)
        for imported in sorted(graph[module] - {module}):
            visit(imported)
        path_here.pop()

    for module in sorted(graph):
        visit(module)


@pytest.mark.parametrize("machine", ["excavator", "fr5"])
def test_a_machine_knows_no_scene_no_target_and_no_other_machine(machine):
    for path in sorted((PACKAGE / "envs/machines" / machine).rglob("*.py")):
        for imported in imported_modules(path):
            ours = f"envs.machines.{machine}"
            shared = imported.startswith("envs.machines.") and imported.count(".") == 2
            allowed = (ours, "envs.soil", "envs.constants", "errors")
            assert shared or imported.startswith(allowed), f"{name_of(path)} imports {imported}"


def test_tasks_are_listed_in_the_registry_alone():
    ids = ("Scoop-v0", "FR5Grasp-v0", "Clear-v0")
    for path in MODULES:
        if path.parent.parent.name == "tasks" or name_of(path) == "":
            continue  # a task's own folder, and the map of the package
        strings = {
            node.value
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Constant) and isinstance(node.value, str)
        }
        assert not strings & set(ids), path


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_files_and_functions_stay_short(path):
    text = path.read_text()
    assert text.count("\n") <= 400
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno - node.lineno + 1 <= 60, node.name


def lacks_encoding(call):
    """Return whether a call opens, reads or writes a text without naming its encoding."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    named = {keyword.arg: keyword.value for keyword in call.keywords}
    if name in ("run", "Popen", "check_output", "getoutput"):
        return name == "getoutput" or ("encoding" not in named and bool({"text", "universal_newlines"} & set(named)))
    if name in ("read_text", "write_text"):
        return "encoding" not in named
    others = ("Image.open", "av.open", "os.open", "webbrowser.open")
    if name not in ("open", "NamedTemporaryFile", "fdopen") or ast.unparse(call.func) in others:
        return False
    is_path = isinstance(call.func, ast.Attribute) and name == "open"
    mode = named.get("mode") or next(iter(call.args[not is_path :]), None)
    return "encoding" not in named and not (isinstance(mode, ast.Constant) and "b" in str(mode.value))


@pytest.mark.parametrize("folder", ["lerobot_excav", "validation", "bench", "docs", "examples"])
def test_texts_name_their_encoding_since_that_of_the_machine_may_lack_characters(folder):
    for path in sorted((ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            assert not (isinstance(node, ast.Call) and lacks_encoding(node)), f"{path}:{node.lineno}"


def test_no_module_imports_what_only_some_systems_have():
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            assert not {"fcntl", "grp", "msvcrt", "pwd", "resource", "termios", "winreg"} & set(names), path


def test_soil_knows_nothing_of_mujoco():
    for path in (PACKAGE / "envs/soil").rglob("*.py"):
        assert "import mujoco" not in path.read_text()


def imported_names(path):
    """Yield the first part of every absolute import of a file."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]


def test_nothing_is_imported_that_windows_lacks():
    only_posix = {"crypt", "fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"}
    assert [name_of(path) for path in MODULES if only_posix & set(imported_names(path))] == []


def test_mujoco_is_imported_where_a_wrong_mujoco_gl_is_told():
    # Its context classes are for whoever knows which backend works.
    allowed = {"envs.machines.simulator", "envs.machines.opengl_backend"}
    assert {name_of(path) for path in MODULES if "mujoco" in imported_names(path)} == allowed


def test_importing_the_package_imports_nothing_heavy():
    code = (
        "import sys, lerobot_excav; "
        "print([m for m in ('torch', 'mujoco', 'numba', 'lerobot', 'datasets', 'pandas') if m in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "[]"
