"""Guard zones between the arrays of a workspace (native/util/scratch_block.h)."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent
NATIVE = HERE.parents[1] / "native"


def test_a_write_beyond_an_array_is_found(tmp_path: Path) -> None:
    compiler = shutil.which(os.environ.get("CXX", "c++"))
    if compiler is None or os.name == "nt":
        pytest.skip("needs a C++ compiler")
    program = tmp_path / "scratch_block"
    subprocess.run(
        [compiler, "-std=c++20", "-DNDEBUG", f"-I{NATIVE}", "-o", str(program), str(HERE / "scratch_block.cpp")],
        check=True,
    )
    done = subprocess.run([str(program)], check=True, capture_output=True, text=True)
    assert done.stdout == "array 2 of a workspace was written beyond its end\n"
