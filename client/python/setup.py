"""Generates the messages before the package is built; pyproject.toml says the rest."""

import pathlib
import sys

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = pathlib.Path(__file__).resolve().parent
PACKAGE = HERE / "src" / "polyest"
sys.path.insert(0, str(HERE))


def generate_messages():
    """Generates the messages in a checkout; a source distribution has them."""
    from generate_messages import CONTRACT, generate

    if CONTRACT.is_dir():
        generate(PACKAGE)
    elif not (PACKAGE / "_proto").is_dir():
        sys.exit(f"neither {CONTRACT} nor {PACKAGE / '_proto'} exists")


class BuildWithMessages(build_py):
    """Builds the package with its messages."""

    def finalize_options(self):
        """Finds packages once the messages are there."""
        generate_messages()
        super().finalize_options()
        self.packages = sorted({*self.packages, "polyest._proto", "polyest._proto.rpc",
                                "polyest._proto.v1"})


class SourceWithMessages(sdist):
    """Makes a source distribution with the messages, which needs neither contract nor protoc."""

    def run(self):
        """Generates the messages first."""
        generate_messages()
        super().run()


setup(cmdclass={"build_py": BuildWithMessages, "sdist": SourceWithMessages})
