"""A pressure system solved by hypre: conjugate gradients with one PFMG cycle, its best method here.

usage: python -m micstools.bench.peer_hypre FILE TOLERANCE REPEATS jacobi|red_black

Prints a row as `solve_dump` does; `mpirun -n 2 python ...` cuts the tank into layers. hypre is
called through its shared library, built for Open MPI (Debian: libhypre-dev).
"""

import ctypes
import ctypes.util
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from micstools.bench.pressure_dump import read
from micstools.shapes.geometry import Array

_RELAXATION = {"jacobi": 1, "red_black": 2}  # weighted; symmetric
_OFFSETS = ((0, 0, 0), (-1, 0, 0), (0, -1, 0), (0, 0, -1))


def installed() -> bool:
    """Is there a hypre to call?"""
    return ctypes.util.find_library("HYPRE") is not None


class _Mpi:
    """What is needed of Open MPI."""

    def __init__(self) -> None:
        name = ctypes.util.find_library("mpi")
        self.calls = ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL)
        self.calls.MPI_Init(None, None)
        world = ctypes.c_char.in_dll(self.calls, "ompi_mpi_comm_world")
        self.world = ctypes.c_void_p(ctypes.addressof(world))

    def ask(self, name: str) -> int:
        """`MPI_Comm_rank` or `MPI_Comm_size`."""
        number = ctypes.c_int()
        getattr(self.calls, name)(self.world, ctypes.byref(number))
        return number.value

    def over_all(self, values: list[float], name: str) -> list[float]:
        """Each number over all processes: `max` or `sum`."""
        mine, found = (ctypes.c_double * len(values))(*values), (ctypes.c_double * len(values))()
        kind = ctypes.c_char.in_dll(self.calls, "ompi_mpi_double")
        op = ctypes.c_char.in_dll(self.calls, f"ompi_mpi_op_{name}")
        self.calls.MPI_Allreduce(
            mine, found, len(values), ctypes.c_void_p(ctypes.addressof(kind)),
            ctypes.c_void_p(ctypes.addressof(op)), self.world)  # fmt: skip
        return list(found)


class _System:
    """Matrix and vectors of hypre for a slab of the tank."""

    def __init__(self, mpi: _Mpi, path: Path) -> None:
        self.hypre = ctypes.CDLL(ctypes.util.find_library("HYPRE"))
        self.call("Init")
        self.mpi = mpi
        self.cells, (cx, cy, cz), right = read(path)
        nx, ny, nz = self.cells
        rank, ranks = mpi.ask("MPI_Comm_rank"), mpi.ask("MPI_Comm_size")
        first, last = nz * rank // ranks, nz * (rank + 1) // ranks
        mine = slice(first, last)
        self.corners = _ints(0, 0, first), _ints(nx - 1, ny - 1, last - 1)
        grid, stencil = self.new("StructGrid", mpi.world, 3), self.new("StructStencil", 3, 4)
        self.call("StructGridSetExtents", grid, *self.corners)
        self.call("StructGridAssemble", grid)
        for k, offset in enumerate(_OFFSETS):
            self.call("StructStencilSetElement", stencil, k, _ints(*offset))
        middle = cx[:, :, :-1] + cx[:, :, 1:] + cy[:, :-1] + cy[:, 1:] + cz[:-1] + cz[1:]
        below = -cz[:-1].copy()
        below[0] = 0.0
        values = np.stack([middle, -cx[:, :, :-1], -cy[:, :-1], below], axis=-1)[mine]
        self.matrix = self.new("StructMatrix", mpi.world, grid, stencil)
        self.call("StructMatrixSetSymmetric", self.matrix, 1)
        self.call("StructMatrixInitialize", self.matrix)
        numbers = _ints(0, 1, 2, 3)
        self.call(
            "StructMatrixSetBoxValues", self.matrix, *self.corners, 4, numbers, _doubles(values)
        )
        self.call("StructMatrixAssemble", self.matrix)
        self.right, self.found = (self._vector(grid, v[mine]) for v in (right, 0 * right))

    def _vector(self, grid: ctypes.c_void_p, values: Array) -> ctypes.c_void_p:
        vector = self.new("StructVector", self.mpi.world, grid)
        self.call("StructVectorInitialize", vector)
        self.call("StructVectorSetBoxValues", vector, *self.corners, _doubles(values))
        self.call("StructVectorAssemble", vector)
        return vector

    def call(self, name: str, *given: Any) -> None:
        """`HYPRE_name(given)`."""
        if getattr(self.hypre, "HYPRE_" + name)(*given):
            raise RuntimeError(f"HYPRE_{name} failed")

    def new(self, kind: str, *given: Any) -> ctypes.c_void_p:
        """`HYPRE_kindCreate(given, &made)`."""
        made = ctypes.c_void_p()
        self.call(kind + "Create", *given, ctypes.byref(made))
        return made

    def solve(self, tolerance: float, relaxation: str) -> tuple[float, float, float, int, float]:
        """Seconds of set-up and solve, CPU seconds, iterations, residual; from nothing."""
        self.call("StructVectorSetConstantValues", self.found, ctypes.c_double(0.0))
        began, cpu = time.perf_counter(), time.process_time()
        cycle = self.new("StructPFMG", self.mpi.world)
        self.call("StructPFMGSetRelaxType", cycle, _RELAXATION[relaxation])
        self.call("StructPFMGSetMaxIter", cycle, 1)
        self.call("StructPFMGSetTol", cycle, ctypes.c_double(0.0))
        self.call("StructPFMGSetZeroGuess", cycle)
        outer = self.new("StructPCG", self.mpi.world)
        self.call("StructPCGSetTol", outer, ctypes.c_double(tolerance))
        self.call("StructPCGSetMaxIter", outer, 1000)
        self.call("StructPCGSetTwoNorm", outer, 1)
        function = [getattr(self.hypre, "HYPRE_StructPFMG" + name) for name in ("Solve", "Setup")]
        self.call("StructPCGSetPrecond", outer, *function, cycle)
        self.call("StructPCGSetup", outer, self.matrix, self.right, self.found)
        ready = time.perf_counter()
        self.call("StructPCGSolve", outer, self.matrix, self.right, self.found)
        done, cpu = time.perf_counter(), time.process_time() - cpu
        count, residual = ctypes.c_int(), ctypes.c_double()
        self.call("StructPCGGetNumIterations", outer, ctypes.byref(count))
        self.call("StructPCGGetFinalRelativeResidualNorm", outer, ctypes.byref(residual))
        self.call("StructPCGDestroy", outer)
        self.call("StructPFMGDestroy", cycle)
        return ready - began, done - ready, cpu, count.value, residual.value


def _ints(*values: int) -> Any:
    return (ctypes.c_int * len(values))(*values)


def _doubles(values: Array) -> Any:
    return np.ascontiguousarray(values, float).ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def main(words: list[str]) -> None:
    """Solve and print."""
    path, tolerance, repeats, relaxation = words
    mpi = _Mpi()
    system = _System(mpi, Path(path))
    runs = [system.solve(float(tolerance), relaxation) for _ in range(int(repeats))]
    setup, solve = (mpi.over_all([run[k] for run in runs], "max") for k in (0, 1))
    cpu = mpi.over_all([run[2] for run in runs], "sum")
    if mpi.ask("MPI_Comm_rank") == 0:
        row = [*system.cells, mpi.ask("MPI_Comm_size"), runs[0][3]]
        print(*row, *(f"{v:.5e}" for v in (min(setup), min(solve), min(cpu), runs[0][4])), sep=",")
    sys.stdout.flush()
    mpi.calls.MPI_Finalize()


if __name__ == "__main__":
    main(sys.argv[1:])
