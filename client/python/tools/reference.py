"""Writes the section "Reference" of docs/python.md from the docstrings of the package, or checks it.

    python client/python/tools/reference.py --write
    python client/python/tools/reference.py --check

Enters: the sources of the package, which are parsed and never imported, so that every version of Python makes the same
page. Leaves: the lines between two markers of the page.
"""

from __future__ import annotations

import argparse
import ast
import inspect
import itertools
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "client/python/src/nappe"
PAGE = ROOT / "docs/python.md"
BEGIN, END = "<!-- reference: begin -->\n", "<!-- reference: end -->\n"
LONGEST_LINE = 110
"""Signatures that are longer have an argument per line."""

GROUPS = {
    "Servers and sessions": ("connect", "serve", "Server", "Session", "Changes", "Pending", "Accepted", "Uploaded"),
    "Streams": ("Stream", "Frames", "DiagnosticsStream"),
    "Frames": ("Frame", "BodyArrays", "Grid", "Topology", "Body", "Collider"),
    "Trajectories": ("Trajectory",),
    "Errors": (
        "Error",
        "Diverged",
        "Refused",
        "NotFound",
        "FileNotFound",
        "Full",
        "Expired",
        "TooSlow",
        "Unauthenticated",
        "Unavailable",
        "Closed",
        "REASONS",
        "Reason",
    ),
    "Values": (
        "ServerInfo",
        "SessionInfo",
        "SessionEnd",
        "SessionRanks",
        "Durability",
        "Failure",
        "Change",
        "RejectedStep",
        "Parameters",
        "ClothParameters",
        "ColliderPose",
        "Air",
        "SpringParameters",
        "Diagnostics",
        "ColliderLoad",
        "SurfaceReport",
        "RestReport",
        "ClothSteps",
        "SnowDiagnostics",
        "SolveReport",
        "Notices",
    ),
}
"""What is listed, in this order: every name that the package exports, but `v1`, which docs/contract.md lists."""

TYPES = {
    "Array": "_arrays",
    "Vector": "_reports",
    "PerKind": "_requests",
    "Forces": "_acting",
    "States": "_acting",
    "Pulls": "_pulls",
    "Poses": "_moving",
    "FramePoses": "_poses",
    "Quaternion": "_reports",
}
"""Names of types that stand in signatures, and the modules that say what they are."""


@dataclass
class Module:
    """A parsed module: what it defines, and the constants that stand for numbers in its signatures."""

    tree: ast.Module
    definitions: dict[str, ast.stmt]
    values: dict[str, ast.expr]
    aliases: set[str]
    """Names under which it imports other modules of the package."""


@dataclass
class Attribute:
    """A field, a property, or a documented attribute."""

    name: str
    kind: str
    words: str


class Package:
    """The sources of the package."""

    def __init__(self) -> None:
        """Parses every module."""
        paths = [*PACKAGE.glob("*.py"), *PACKAGE.glob("_*/_[a-z]*.py")]
        self.modules = {path.stem: _parsed(path) for path in sorted(paths)}
        exports = [item for item in self.modules["__init__"].tree.body if isinstance(item, ast.ImportFrom)]
        self.home = {name.name: (item.module or "").rpartition(".")[2] for item in exports for name in item.names}
        self.exported: list[str] = ast.literal_eval(self.modules["__init__"].values["__all__"])

    def text(self, expression: ast.expr | None, module: Module) -> str:
        """An expression in words: constants by their value, names without the module that they come from."""
        if expression is None:
            return ""
        if isinstance(expression, ast.Name) and expression.id.isupper():
            return ast.unparse(self._constant(expression.id, module))
        return ast.unparse(_Shortened(module.aliases).visit(expression))

    def _constant(self, name: str, module: Module) -> ast.expr:
        for imported in (item for item in module.tree.body if isinstance(item, ast.ImportFrom)):
            if name in {alias.name for alias in imported.names} and (imported.module or "").startswith("nappe."):
                return self._constant(name, self.modules[(imported.module or "").rpartition(".")[2]])
        return module.values[name]

    def bases(self, definition: ast.ClassDef, module: Module) -> list[tuple[ast.ClassDef, Module]]:
        """The classes of the package that a class is made from, farthest first."""
        found = []
        for base in definition.bases:
            name = base.value if isinstance(base, ast.Subscript) else base
            known = isinstance(name, ast.Name) and self._find(name.id, module)
            if known:
                found += [*self.bases(*known), known]
        return found

    def _find(self, name: str, module: Module) -> tuple[ast.ClassDef, Module] | None:
        if isinstance(definition := module.definitions.get(name), ast.ClassDef):
            return definition, module
        for imported in (item for item in module.tree.body if isinstance(item, ast.ImportFrom)):
            if name in {alias.name for alias in imported.names} and (imported.module or "").startswith("nappe."):
                return self._find(name, self.modules[(imported.module or "").rpartition(".")[2]])
        return None


class _Shortened(ast.NodeTransformer):
    """`requests.PerKind` becomes `PerKind`."""

    def __init__(self, aliases: set[str]) -> None:
        self.aliases = aliases

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        self.generic_visit(node)
        is_ours = isinstance(node.value, ast.Name) and node.value.id in self.aliases
        return ast.Name(node.attr) if is_ours else node


def _is_folder(module: str) -> bool:
    """Whether a module is the package, or a folder in it."""
    return module.startswith("nappe") and (PACKAGE.parent / module.replace(".", "/")).is_dir()


def _parsed(path: Path) -> Module:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    definitions: dict[str, ast.stmt] = {}
    values: dict[str, ast.expr] = {}
    aliases: set[str] = set()
    for item in tree.body:
        if isinstance(item, (ast.ClassDef, ast.FunctionDef)):
            definitions[item.name] = item
        elif isinstance(item, ast.Assign) and isinstance(item.targets[0], ast.Name):
            values[item.targets[0].id] = item.value
        elif isinstance(item, ast.ImportFrom) and _is_folder(item.module or ""):
            aliases |= {alias.asname or alias.name for alias in item.names}
    return Module(tree, definitions, values, aliases)


def reference(package: Package) -> str:
    """The lines between the markers."""
    listed = [name for names in GROUPS.values() for name in names]
    if missing := sorted(set(package.exported) - {*listed, "v1"}):
        raise SystemExit(f"GROUPS of {Path(__file__).name} leaves out {', '.join(missing)}, which the package exports")
    parts = [
        "`client/python/tools/reference.py` writes this section from the docstrings of the package; CI compares them.\n"
        "`nappe.aio` has the same servers, sessions and streams with `await`; all else is shared.\n"
    ]
    for title, names in GROUPS.items():
        parts.append(f"- {title}: {', '.join(f'[`{name}`](#{_anchor(name)})' for name in names)}")
    parts.append("\n| in signatures | stands for | |\n|---|---|---|")
    parts += [_type(package, name, module) for name, module in TYPES.items()]
    for title, names in GROUPS.items():
        parts.append(f"\n### {title}")
        parts += [_entry(package, name) for name in names]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(parts)).rstrip("\n") + "\n"


def _anchor(name: str) -> str:
    return f"nappe{name.lower()}"


def _type(package: Package, name: str, home: str) -> str:
    module = package.modules[home]
    return f"| `{name}` | `{_cell(ast.unparse(module.values[name]))}` | {_cell(_words_below(module.tree.body, name))} |"


def _entry(package: Package, name: str) -> str:
    """What is said of one name."""
    module = package.modules[package.home[name]]
    definition = module.definitions.get(name)
    parts = [f"\n#### nappe.{name}\n"]
    if isinstance(definition, ast.FunctionDef):
        parts += [_block(_signature(package, definition, module, f"nappe.{name}")), _words(definition)]
    elif isinstance(definition, ast.ClassDef):
        parts += _class(package, definition, module)
    else:
        parts.append(_words_below(module.tree.body, name) + "\n")
    return "\n".join(parts)


def _class(package: Package, definition: ast.ClassDef, module: Module) -> Iterator[str]:
    yield _words(definition)
    merged = [(definition, module)]
    for base in reversed(package.bases(definition, module)):
        if base[0].name in package.exported:
            yield f"Has all that [`{base[0].name}`](#{_anchor(base[0].name)}) has.\n"
            break
        merged.insert(0, base)
    attributes = [found for one in merged for found in _attributes(package, *one)]
    if attributes:
        has_words = any(attribute.words for attribute in attributes)
        yield "| attribute | type | |\n|---|---|---|" if has_words else "| attribute | type |\n|---|---|"
        for attribute in attributes:
            kind = f"`{_cell(attribute.kind)}`" if attribute.kind else ""
            yield f"| `{attribute.name}` | {kind} |" + (f" {_cell(attribute.words)} |" if has_words else "")
        yield ""
    for one, home in merged:
        for method in one.body:
            if isinstance(method, ast.FunctionDef) and _is_listed(method) and not _is_property(method):
                yield _block(_signature(package, method, home, method.name))
                yield _words(method)


def _attributes(package: Package, definition: ast.ClassDef, module: Module) -> Iterator[Attribute]:
    """Fields, documented attributes that are set when an object is made, and properties."""
    for item in definition.body:
        if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name) and not item.target.id.startswith("_"):
            name = item.target.id
            yield Attribute(name, package.text(item.annotation, module), _words_below(definition.body, name))
        elif isinstance(item, ast.FunctionDef) and item.name == "__init__":
            for set_here in item.body:
                name, annotation = _set_on_self(set_here)
                words = _words_below(item.body, name)
                if isinstance(set_here, ast.Assign) and isinstance(set_here.value, ast.Name):
                    # `self.name = name`: its type is that of the argument.
                    given = {argument.arg: argument.annotation for argument in item.args.args}
                    annotation = given.get(set_here.value.id)
                if words:
                    yield Attribute(name, package.text(annotation, module), words)
        elif isinstance(item, ast.FunctionDef) and _is_property(item) and _is_listed(item):
            yield Attribute(item.name, package.text(item.returns, module), _words(item))


def _set_on_self(statement: ast.stmt) -> tuple[str, ast.expr | None]:
    """The name and the type of `self.name: type = ...`."""
    target = statement.targets[0] if isinstance(statement, ast.Assign) else None
    annotation = None
    if isinstance(statement, ast.AnnAssign):
        target, annotation = statement.target, statement.annotation
    is_own = isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name) and target.value.id == "self"
    return (target.attr, annotation) if is_own and isinstance(target, ast.Attribute) else ("", None)


def _words_below(body: list[ast.stmt], name: str) -> str:
    """The text that stands below the statement that sets a name."""
    for statement, below in itertools.pairwise(body):
        target = statement.targets[0] if isinstance(statement, ast.Assign) else getattr(statement, "target", None)
        is_it = (isinstance(target, ast.Name) and target.id == name) or (name and _set_on_self(statement)[0] == name)
        if is_it and isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            return inspect.cleandoc(str(below.value.value))
    return ""


def _is_listed(method: ast.FunctionDef) -> bool:
    return not method.name.startswith("_") and "overload" not in map(ast.unparse, method.decorator_list)


def _is_property(method: ast.FunctionDef) -> bool:
    return any(ast.unparse(decorator) in ("property", "cached_property") for decorator in method.decorator_list)


def _words(definition: ast.ClassDef | ast.FunctionDef) -> str:
    return (ast.get_docstring(definition) or "") + "\n"


def _signature(package: Package, function: ast.FunctionDef, module: Module, name: str) -> str:
    given = function.args
    written = []
    defaults = [None] * (len(given.args) - len(given.defaults)) + list(given.defaults)
    for argument, default in zip(given.args, defaults, strict=True):
        if argument.arg != "self":
            written.append(_argument(package, argument, default, module))
    if given.kwonlyargs:
        written.append("*")
    for argument, default in zip(given.kwonlyargs, given.kw_defaults, strict=True):
        written.append(_argument(package, argument, default, module))
    if given.kwarg is not None:
        written.append("**" + _argument(package, given.kwarg, None, module))
    answer = f" -> {package.text(function.returns, module)}"
    line = f"{name}({', '.join(written)}){answer}"
    if len(line) <= LONGEST_LINE:
        return line
    return f"{name}(\n" + "".join(f"    {argument},\n" for argument in written) + f"){answer}"


def _argument(package: Package, argument: ast.arg, default: ast.expr | None, module: Module) -> str:
    written = f"{argument.arg}: {package.text(argument.annotation, module)}"
    return written if default is None else f"{written} = {package.text(default, module)}"


def _block(text: str) -> str:
    return f"```text\n{text}\n```\n"


def _cell(text: str) -> str:
    """A text as it stands in a cell of a table: one line, in which `|` is no border."""
    return " ".join(text.split()).replace("|", r"\|")


def main() -> None:
    """Writes the section, or compares it with the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--write", action="store_true", help="write the section into the page")
    what.add_argument("--check", action="store_true", help="exit with 1 if the page has another section")
    options = parser.parse_args()

    page = PAGE.read_text(encoding="utf-8")
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise SystemExit(f"{PAGE.relative_to(ROOT)} has no section between {BEGIN.strip()} and {END.strip()}")
    made = f"{before}{begin}\n{reference(Package())}\n{end}{after}"
    if options.write:
        PAGE.write_text(made, encoding="utf-8")
    elif made != page:
        sys.exit(f"{PAGE.relative_to(ROOT)} is out of date: python client/python/tools/reference.py --write")


if __name__ == "__main__":
    main()
