"""What the house promises of the package: types, docstrings, short files, one version."""

import inspect
import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec

import pytest

import polyest
from conftest import ROOT
from polyest import aio, datatree, io, plot, results

PACKAGE = ROOT / "client" / "python"


def public(module):
    """Yields the public names of a module and of its classes, each with what it is."""
    for name in getattr(module, "__all__", None) or [
            name for name, one in vars(module).items()
            if not name.startswith("_") and getattr(one, "__module__", "") == module.__name__]:
        one = getattr(module, name)
        yield f"{module.__name__}.{name}", one
        for member, part in vars(one).items() if inspect.isclass(one) else ():
            if not member.startswith("_") and (callable(part) or isinstance(
                    part, (property, classmethod, staticmethod))):
                yield f"{module.__name__}.{name}.{member}", part


@pytest.mark.parametrize("module", [polyest, aio, plot, results, datatree, io, io.can, io.mcap,
                                    io.mdf],
                         ids=lambda module: module.__name__)
def test_every_public_name_is_described(module):
    names = list(public(module))
    assert len(names) >= 2
    undescribed = [name for name, one in names if not inspect.getdoc(
        one.__func__ if isinstance(one, (classmethod, staticmethod)) else one)]
    assert undescribed == []


@pytest.mark.parametrize("module", [polyest, results, io, io.mdf], ids=lambda module: module.__name__)
def test_every_field_of_a_result_is_described(module):
    undescribed = []
    for name in module.__all__:
        kind = getattr(module, name)
        if not getattr(kind, "__dataclass_fields__", None) or kind.__module__ in (
                "polyest.priors", "polyest.signals"):
            continue
        lines = inspect.getsource(kind).splitlines()
        for number, line in enumerate(lines):
            field = re.match(r"    ([a-z]\w*): ", line)
            if field and not lines[number - 1].strip().startswith("#:"):
                undescribed.append(f"{name}.{field[1]}")
    assert undescribed == []


def test_files_have_one_purpose_and_at_most_400_lines():
    files = [file for folder in (PACKAGE, ROOT / "tests" / "python")
             for file in folder.rglob("*.py") if "_proto" not in file.parts
             and "build" not in file.relative_to(folder).parts]
    assert len(files) > 40
    assert [str(file) for file in files if len(file.read_text().splitlines()) > 400] == []
    assert [str(file) for file in files if file.parent != PACKAGE
            and not file.read_text().startswith('"""')] == []


def test_the_version_is_that_of_the_project():
    project = re.search(r"project\(polyest VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())
    package = re.search(r'^version = "(\S+)"', (PACKAGE / "pyproject.toml").read_text(), re.M)
    assert polyest.__version__ == project[1] == package[1]


def test_types_are_strict():
    pytest.importorskip("mypy")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", str(PACKAGE / "pyproject.toml"),
         "--cache-dir", "/dev/null", inspect.getfile(polyest).rpartition("/")[0]],
        capture_output=True, text=True, cwd="/", check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_wheel_is_pure_and_works_when_it_is_installed(tmp_path):
    # They must not be imported here: setuptools replaces modules of Python.
    missing = [name for name in ("pip", "setuptools", "wheel") if find_spec(name) is None]
    if missing:
        pytest.skip(f"without {', '.join(missing)}")
    for folder in ("client/python", "proto/polyest"):
        shutil.copytree(ROOT / folder, tmp_path / "checkout" / folder,
                        ignore=shutil.ignore_patterns("_proto", "build", "*.egg-info"))
    pip = [sys.executable, "-m", "pip", "-q", "--disable-pip-version-check", "--no-cache-dir"]
    wheels = tmp_path / "wheels"
    subprocess.run([*pip, "wheel", "--no-build-isolation", "--no-deps", "--no-index", "-w",
                    str(wheels), str(tmp_path / "checkout/client/python")], check=True)
    wheel, = wheels.iterdir()
    assert wheel.name == f"polyest-{polyest.__version__}-py3-none-any.whl"
    installed = tmp_path / "installed"
    subprocess.run([*pip, "install", "--no-deps", "--no-index", "--target", str(installed),
                    str(wheel)], check=True)
    program = ("import polyest\nwith polyest.local() as client:\n"
               "    print(polyest.__file__, client.status().version)")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                          check=True, env={**os.environ, "PYTHONPATH": str(installed)})
    assert done.stdout.startswith(str(installed))
    assert (installed / "polyest" / "py.typed").exists()
