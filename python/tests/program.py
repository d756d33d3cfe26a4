"""The program beside the package: the same call must give the same document."""

import json
import os
import pathlib
import subprocess

import pytest

PROGRAM = os.environ.get("TORSIO_PROGRAM", "")

needs_program = pytest.mark.skipif(not PROGRAM, reason="TORSIO_PROGRAM names the program torsio")


def run(folder: pathlib.Path, *arguments: str) -> None:
    """Calls the program in a folder; fails with what it prints."""
    done = subprocess.run([PROGRAM, *arguments], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def document(folder: pathlib.Path, *arguments: str) -> dict:
    """What the call writes with --json."""
    run(folder, *arguments, "--json", "result.json")
    return json.loads((folder / "result.json").read_text())
