"""Imports point down: a module uses lower layers, or modules left of it in its own."""

import ast
from pathlib import Path

import laserimg

LAYERS = [
    ["errors", "files", "workers"],
    ["projection", "scan", "boxes", "seen_box", "captions", "thinning"],
    ["geometry", "normals"],
    ["images", "formats", "readers"],
    ["lattice", "regions", "mixed_pixels", "clusters", "measure", "surfaces", "ground", "cellular"],
    ["polar_cells", "linked_points", "rbnn", "hanging", "object_clusters"],
    ["descriptors", "evidence", "matching", "truth"],
    ["samples", "cascade", "detectors", "hog_training", "classify"],
    ["rules", "sources"],
    ["evaluate", "pipeline", "semantic_map", "simulate", "sheet", "draw"],
    ["settings", "records", "build", "batch", "report", "recipes", "labels", "sensors"],
    ["cli", "__main__"],
]
ROOT = Path(laserimg.__file__).parent
PLACE = {name: (layer, column) for layer, names in enumerate(LAYERS) for column, name in enumerate(names)}


def imported(path: Path) -> set[str]:
    """Top-level laserimg modules that a file imports, also inside functions."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            if node.module == "laserimg":
                names |= {alias.name for alias in node.names}
            elif node.module.startswith("laserimg."):
                names.add(node.module.split(".")[1])
        elif isinstance(node, ast.Import):
            names |= {alias.name.split(".")[1] for alias in node.names if alias.name.startswith("laserimg.")}
    return names & PLACE.keys()


def files() -> list[tuple[str, Path]]:
    paths = [path for path in ROOT.rglob("*.py") if path.parent != ROOT or path.stem != "__init__"]
    return [(path.relative_to(ROOT).parts[0].removesuffix(".py"), path) for path in sorted(paths)]


def test_every_module_has_a_layer():
    assert {name for name, _ in files()} <= PLACE.keys()


def test_imports_point_down():
    wrong = [
        f"{path.relative_to(ROOT)} imports {other}"
        for name, path in files()
        for other in imported(path)
        if other != name and PLACE[other] >= PLACE[name]
    ]
    assert wrong == []


def test_nothing_prints_or_exits_outside_the_command_line():
    calls = []
    for name, path in files():
        if name == "cli":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func) in ("print", "sys.exit", "exit", "quit"):
                calls.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert calls == []
