"""Runs the programs of the package's guide and compares what they print."""

import contextlib
import io
import shutil
import subprocess
import sys
from importlib.util import find_spec

from conftest import EXAMPLES, ROOT

sys.path.insert(0, str(ROOT / "tests" / "guides"))

from run import blocks_of, same_output


def in_a_copy_of_the_examples(folder, monkeypatch):
    """Works in a copy of the examples with the recordings of a rig; returns whether it has those."""
    monkeypatch.chdir(shutil.copytree(EXAMPLES, folder / "examples"))
    if any(find_spec(module) is None for module in ("asammdf", "can", "cantools", "mcap")):
        return False
    subprocess.run([sys.executable, "-B", ROOT / "client/python/examples/make_recordings.py"],
                   check=True)
    return True


def test_the_first_page_is_true_of_python(monkeypatch):
    monkeypatch.chdir(EXAMPLES)
    blocks = [block for language, _, block in blocks_of((ROOT / "README.md").read_text())
              if language == "python"]
    assert len(blocks) == 1
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(blocks[0], {"__name__": "__main__"})
    mean, std_dev = map(float, out.getvalue().split())
    assert abs(mean - 41.3) < 3 * std_dev  # the demo's k


def test_the_guide_prints_what_it_says(tmp_path, monkeypatch):
    has_recordings = in_a_copy_of_the_examples(tmp_path, monkeypatch)
    variables, printed, compared = {"__name__": "__main__"}, "", 0
    guide = ROOT / "client" / "python" / "README.md"
    for language, line, block in blocks_of(guide.read_text()):
        if language == "python" and "polyest.io" in block and not has_recordings:
            printed = None
        elif language == "python":
            out = io.StringIO()
            # Lines of the program are those of the guide.
            program = compile("\n" * (line - 1) + block, str(guide), "exec")
            with contextlib.redirect_stdout(out):
                exec(program, variables)
            printed = out.getvalue()
        elif language == "text" and printed is not None:
            assert same_output(block, printed), f"{guide}:{line}: it printed\n{printed}"
            compared += 1
    assert compared >= 8
