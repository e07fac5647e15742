# SPDX-License-Identifier: BSD-3-Clause
"""Compile a tape with the C compiler of the system, if there is one.

The text of a tape is one loop body without branches, which compilers turn into vector instructions
that work on several samples at once and keep most values in registers.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn.dynamics._recursion import Program
from skidyn.dynamics._source import C, renumber, statements
from skidyn.dynamics._tape import Scalar

#: Samples that go through the loop body together: enough for every vector length, and their signals
#: stay in the first-level cache.
_BLOCK = 64

_FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC")

_TEMPLATE = """\
#include <math.h>
#if defined(__GLIBC__) && defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
/* Say that glibc has vector versions of these (libmvec); otherwise they stay scalar calls. */
__attribute__((simd("notinbranch"))) double sin(double);
__attribute__((simd("notinbranch"))) double cos(double);
#endif

void evaluate(long n_samples, const double *restrict q_in, const double *restrict dq_in,
              const double *restrict ddq_in, const double *restrict parameter,
              double *restrict out, long stride)
{{
    static const int place[{n_outputs}] = {{ {places} }};
    double q[{n}][{block}] = {{{{0}}}}, dq[{n}][{block}] = {{{{0}}}}, ddq[{n}][{block}] = {{{{0}}}};
    double result[{n_outputs}][{block}], wave[{n_waves}][{block}];
    for (long start = 0; start < n_samples; start += {block}) {{
        long size = n_samples - start < {block} ? n_samples - start : {block};
        for (int i = 0; i < {n}; i++)
            for (long k = 0; k < size; k++) {{
                q[i][k] = q_in[(start + k) * {n} + i];
                dq[i][k] = dq_in[(start + k) * {n} + i];
                ddq[i][k] = ddq_in[(start + k) * {n} + i];
            }}
{waves}
        for (int k = 0; k < {block}; k++) {{
{body}
        }}
        for (int i = 0; i < {n_outputs}; i++)
            for (long k = 0; k < size; k++)
                out[place[i] * stride + start + k] = result[i][k];
    }}
}}
"""


def find_compiler() -> str | None:
    """Path of the C compiler: ``$CC``, else cc, gcc or clang, else None."""
    for name in (os.environ.get("CC"), "cc", "gcc", "clang"):
        found = shutil.which(name) if name else None
        if found:
            return found
    return None


def compile_library(text: str, flags: tuple[str, ...] = _FLAGS) -> ctypes.CDLL:
    """Compile C text to a library and load it; a SkidynError without a C compiler."""
    compiler = find_compiler()
    if compiler is None:
        raise SkidynError(
            "backend='compiled' needs a C compiler, and neither $CC nor cc, gcc or clang is one. "
            "Install one or use backend='numpy'."
        )
    with tempfile.TemporaryDirectory(prefix="skidyn-") as folder:
        source, library = Path(folder) / "program.c", Path(folder) / "program.so"
        source.write_text(text, encoding="utf-8")
        command = [compiler, *flags, "-o", str(library), str(source), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise SkidynError(f"The C compiler {compiler} failed: {done.stderr[-500:]}")
        return ctypes.CDLL(str(library))


class CompiledProgram:
    """A program of one robot as machine code.

    Outputs of one sample have the ``shape``; those that are ``vanishing`` are zero for every motion
    and not written.
    """

    def __init__(self, program: Program) -> None:
        self.shape = program.shape
        self.vanishing = np.ones(program.shape, dtype=bool)
        for key in program.outputs:
            self.vanishing[key] = False
        self._library = compile_library(_batch_text(program))
        self._function: Callable[..., Any] = self._library.evaluate
        self._function.restype = None
        self._function.argtypes = (ctypes.c_long, *5 * (ctypes.c_void_p,), ctypes.c_long)

    def __call__(
        self,
        signals: dict[str, np.ndarray],
        parameters: np.ndarray | None = None,
        out: np.ndarray | None = None,
    ) -> np.ndarray:
        """Outputs with the samples last; ``out`` may be longer than there are samples."""
        arrays = [np.ascontiguousarray(signals[name]) for name in ("q", "dq", "ddq")]
        arrays.append(np.ascontiguousarray(np.zeros(1) if parameters is None else parameters))
        if out is None:
            out = np.zeros((*self.shape, len(arrays[0])))
        pointers = [a.ctypes.data for a in (*arrays, out)]
        self._function(len(arrays[0]), *pointers, out.shape[-1])
        return out


def _batch_text(program: Program) -> str:
    tape = program.tape
    # A sine and a cosine of one angle in one loop would be merged into a call of sincos, which has
    # no vector version; each gets a loop of its own.
    waves = [i for i in tape.live(program.outputs.values()) if tape.nodes[i][0] in ("sin", "cos")]
    loops = []
    for row, index in enumerate(waves):
        alone = Program(tape, {(row,): Scalar(tape, index)}, ())
        lines = _lines(alone, {}, f"wave[{row}]")
        loops.append(f"for (int k = 0; k < {_BLOCK}; k++) {{ {' '.join(lines)} }}")
    given = {index: f"wave[{row}][k]" for row, index in enumerate(waves)}
    return _TEMPLATE.format(
        n=program.shape[0],
        n_outputs=max(1, len(program.outputs)),
        places=", ".join(_places(program)) or "0",
        block=_BLOCK,
        n_waves=max(1, len(waves)),
        waves="\n".join(f"        {loop}" for loop in loops),
        body="\n".join(f"            {line}" for line in _lines(program, given, "result")),
    )


def _places(program: Program) -> list[str]:
    """Position of every output in the flattened outputs of a sample."""
    return [str(np.ravel_multi_index(key, program.shape)) for key in program.outputs]


def _lines(program: Program, given: dict[int, str], target: str) -> list[str]:
    """Statements for sample k that write the outputs to ``target[..][k]``."""

    def name(signal: str, position: int) -> str:
        return f"parameter[{position}]" if signal == "parameter" else f"{signal}[{position}][k]"

    lines, outputs = statements(
        program, input_name=name, prefix="const double ", suffix=";", language=C, given=given
    )
    for row, value in enumerate(outputs.values()):
        where = f"{target}[{row}][k]" if target == "result" else f"{target}[k]"
        lines.append(f"{where} = {value};")
    return renumber(lines)
