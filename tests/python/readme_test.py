"""Runs the programs of the package's guide and compares what they print."""

import contextlib
import io
import sys

from conftest import EXAMPLES, ROOT

sys.path.insert(0, str(ROOT / "tests" / "guides"))

from run import blocks_of, same_output


def test_the_guide_prints_what_it_says(monkeypatch):
    monkeypatch.chdir(EXAMPLES)
    variables, printed, compared = {"__name__": "__main__"}, "", 0
    guide = ROOT / "client" / "python" / "README.md"
    for language, line, block in blocks_of(guide.read_text()):
        if language == "python":
            out = io.StringIO()
            # Lines of the program are those of the guide.
            program = compile("\n" * (line - 1) + block, str(guide), "exec")
            with contextlib.redirect_stdout(out):
                exec(program, variables)
            printed = out.getvalue()
        elif language == "text":
            assert same_output(block, printed), f"{guide}:{line}: it printed\n{printed}"
            compared += 1
    assert compared >= 8
