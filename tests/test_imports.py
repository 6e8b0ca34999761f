"""The rules a reader of the tree relies on: who imports whom, who touches files, how errors are raised."""

from __future__ import annotations

import ast
import builtins
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1] / "src" / "steelyard"
LONGEST = 350

CORE = {"numpy", "scipy", "numba", "click", "manifold3d"}
SHARED = {"errors", "check", "findings"}
UPPER = {
    "team", "identify", "parts", "shape", "robots", "workshop", "datasets", "logs", "inertia",
    "spatial",
}  # fmt: skip

# Unit -> what it may import beside itself and SHARED. A dotted entry admits that one module only.
MAY_IMPORT: dict[str, set[str]] = {
    "errors": set(),
    "check": set(),
    "findings": set(),
    "evidence": set(),
    "whole_files": set(),
    "threads": set(),
    "spatial": set(),
    "inertia": {"spatial"},
    "logs": {"inertia", "spatial"},
    "shape": {"inertia", "spatial"},
    "parts": {"shape", "inertia", "spatial"},
    "robots": {"spatial"},
    "tables": {"evidence", "inertia", "spatial"},
    "identify": {"evidence", "parts.parts", "parts.material", "logs", "tables", "inertia", "spatial"},
    "team": {"evidence", "identify.estimate", "logs", "inertia", "spatial"},
    "sanity": {"evidence", "identify", "logs", "inertia", "spatial"},
    "workshop": {"shape", "parts", "inertia", "spatial"},
    "datasets": {"shape", "parts", "inertia", "spatial"},
    "simulate": UPPER,
    "evaluate": UPPER,
    "report": UPPER | {"evaluate", "evidence", "tables", "whole_files"},
    "pipelines": UPPER | {"simulate", "evaluate", "sanity"},
    "io": {
        "spatial", "inertia", "logs.clock", "logs.holes", "logs.intervals", "logs.log", "logs.moments",
        "logs.recording", "logs.team_log", "logs.team_track", "logs.team_streams", "robots.omnid", "robots.serial",
        "team.estimate", "shape.mesh",
        "shape.tets", "shape.nesting", "shape.cloud", "shape.known_space", "shape.eight_bits", "shape.views",
        "parts.parts", "parts.from_mesh", "parts.hierarchy", "datasets", "identify.estimate", "evidence", "whole_files",
    },
}  # fmt: skip
MAY_IMPORT["api"] = UPPER | {"simulate", "evaluate", "sanity", "pipelines", "io", "report", "tables"}
MAY_IMPORT["bench"] = MAY_IMPORT["api"] | {"api", "threads"}
MAY_IMPORT["cli"] = MAY_IMPORT["bench"] | {"bench", ""}
MAY_IMPORT[""] = MAY_IMPORT["cli"] | {"cli"}  # the package itself: `import steelyard as sy`
MAY_IMPORT["__main__"] = {"cli"}

FILES_ALLOWED = {"whole_files", "io", "report", "cli", "bench"}
FILE_CALLS = {
    "print", "open", "input", "write_text", "write_bytes", "read_text", "read_bytes", "mkdir", "unlink",
    "load", "save", "savez", "savez_compressed", "loadtxt", "savetxt", "genfromtxt", "fromfile", "tofile",
}  # fmt: skip
VERB = ("identify", "api")  # the package `identify` is also the verb `sy.identify(log)`, which it hands on
SLOW = ("scipy.signal", "scipy.stats")  # to import: a third of the time that a short log takes to answer
PLOTTING = {"matplotlib", "plotly", "viser", "webbrowser"}
RAISABLE = {"AttributeError", "SystemExit", "StopIteration"}  # a lazy __getattr__ must raise the first


@cache
def modules() -> dict[str, str]:
    """Dotted name below the package ("" for itself) -> source text."""
    found = {}
    for path in sorted(ROOT.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text()
    return found


@cache
def trees() -> dict[str, ast.Module]:
    return {name: ast.parse(text, name or "__init__") for name, text in modules().items()}


def unit(name: str) -> str:
    return name.partition(".")[0]


def imported(name: str) -> Iterator[str]:
    """Full dotted names of everything a module imports, at any depth."""
    for node in ast.walk(trees()[name]):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{'.' * node.level}{node.module}.{alias.name}" for alias in node.names)


def own_imports(name: str) -> Iterator[str]:
    """The modules of the package that a module imports, named below the package."""
    for full in imported(name):
        if full.startswith("."):
            yield full
        if unit(full) == "steelyard":
            below = full.removeprefix("steelyard").removeprefix(".")
            yield below if below in modules() else below.rpartition(".")[0]


def admits(allowed: set[str], target: str) -> bool:
    return any(target == entry or (entry and target.startswith(f"{entry}.")) for entry in allowed)


def test_every_unit_has_a_rule_and_every_rule_a_unit() -> None:
    assert {unit(name) for name in modules()} == set(MAY_IMPORT)


def test_no_imports_go_round_in_a_circle() -> None:
    """Neither at the top of modules nor within functions: what imports what could be drawn from left to right."""
    left = {name: {target for target in own_imports(name) if target in modules()} - {name} for name in modules()}
    left.pop("")  # the package hands names on
    while free := {name for name, targets in left.items() if not targets & left.keys()}:
        left = {name: targets for name, targets in left.items() if name not in free}
    assert not left


def test_only_permitted_imports() -> None:
    offences = [
        f"{name or '__init__'} imports {target or 'the package itself'}"
        for name in modules()
        for target in own_imports(name)
        if unit(target) != unit(name) and (name, target) != VERB and not admits(MAY_IMPORT[unit(name)] | SHARED, target)
    ]
    assert offences == []


def test_the_rules_can_be_broken() -> None:
    assert not admits(MAY_IMPORT["spatial"] | SHARED, "inertia.forms")
    assert not admits(MAY_IMPORT["io"] | SHARED, "logs.alignment")
    assert not admits(MAY_IMPORT["io"] | SHARED, "logs")
    assert admits(MAY_IMPORT["io"] | SHARED, "logs.log")


def test_each_optional_package_has_one_seam() -> None:
    seams = defaultdict(set)
    for name in modules():
        for full in imported(name):
            if unit(full) not in CORE | {"steelyard", ""} | set(sys.stdlib_module_names):
                seams[unit(full)].add(name)
    assert {package: places for package, places in seams.items() if len(places) > 1} == {}


def called(node: ast.Call) -> str:
    return getattr(node.func, "id", getattr(node.func, "attr", ""))


def is_resource(node: ast.Call) -> bool:
    """Whether the call reads a file shipped inside the package."""
    return "importlib.resources" in ast.unparse(node) or "resources.files(" in ast.unparse(node)


def test_no_printing_plotting_or_files_below_io() -> None:
    lower = [name for name in modules() if unit(name) not in FILES_ALLOWED]
    offences = [
        f"{name}:{node.lineno} calls {called(node)}"
        for name in lower
        for node in ast.walk(trees()[name])
        if isinstance(node, ast.Call) and called(node) in FILE_CALLS and not is_resource(node)
    ]
    offences += [f"{name} imports {full}" for name in lower for full in imported(name) if unit(full) in PLOTTING]
    assert offences == []


def test_no_answer_waits_for_a_slow_import() -> None:
    offences = [
        f"{name} imports {full}"
        for name in modules()
        if unit(name) not in {"bench", "simulate"}
        for full in imported(name)
        if full.startswith(SLOW)
    ]
    assert offences == []


def raised(node: ast.Raise) -> str:
    target = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
    return target.id if isinstance(target, ast.Name) else ""


def is_builtin_exception(name: str) -> bool:
    kind = getattr(builtins, name, None)
    return isinstance(kind, type) and issubclass(kind, BaseException)


def test_errors_are_ours() -> None:
    offences = []
    for name, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Assert):
                offences.append(f"{name}:{node.lineno} asserts")
            if isinstance(node, ast.Raise) and is_builtin_exception(raised(node)) and raised(node) not in RAISABLE:
                offences.append(f"{name}:{node.lineno} raises {raised(node)}")
    assert offences == []


def test_nothing_is_left_to_do() -> None:
    marks = ("TODO", "FIXME", "XXX", "NotImplementedError")
    assert [f"{name}: {mark}" for name, text in modules().items() for mark in marks if mark in text] == []


def test_modules_are_short() -> None:
    lengths = {name: text.count("\n") for name, text in modules().items()}
    assert {name: lines for name, lines in lengths.items() if lines > LONGEST} == {}


@pytest.mark.skipif(not (ROOT / "cli" / "main.py").exists(), reason="there is no command line yet")
@pytest.mark.parametrize("call", ["", "import steelyard.cli.main as m; m.main(['--help'])"])
def test_help_needs_neither_numpy_nor_numba(call: str) -> None:
    script = f"""
import sys
import steelyard.cli.main
try:
    {call or "pass"}
except SystemExit:
    pass
heavy = [name for name in ("numpy", "scipy", "numba") if name in sys.modules]
sys.exit("loads " + ", ".join(heavy) if heavy else 0)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
