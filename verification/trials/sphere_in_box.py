"""Drag of a sphere held in a stream, by a body-fitted solver: the references of `held_sphere`.

usage: python verification/trials/sphere_in_box.py RE ... [--tank R BEFORE BEHIND] [--out OUT]

Needs blockMesh and simpleFoam of OpenFOAM. The flow is steady and axisymmetric, so a wedge of a
round tank will do: as wide as the square box of the cases in area (5.4 diameters across), with as
much before and behind the sphere, slip at its side; --tank: another, in diameters. A wide one is
15 15 25, those of `rebound` are 3.385 10 12 (St 152) and 5.642 10 12 (St 27). Prints the drag
coefficient and its parts by pressure and friction. Some minutes each.
"""

import argparse
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

WEDGE = np.radians(5.0)
BOX = (5.4 / np.sqrt(np.pi), 3.0, 6.0)  # radius of the tank, before, behind [diameters]
CELLS_ALONG = {"A0 A1 B1 B0": 60, "A1 A2 B2 B1": 90, "A2 A3 B3 B2": 60}  # the arc of each block
SCHEMES = """ddtSchemes { default steadyState; }
gradSchemes { default Gauss linear; }
divSchemes { default none; div(phi,U) bounded Gauss linearUpwind grad(U);
  div((nuEff*dev2(T(grad(U))))) Gauss linear; }
laplacianSchemes { default Gauss linear corrected; }
interpolationSchemes { default linear; }
snGradSchemes { default corrected; }
"""
SOLUTION = """solvers { p { solver GAMG; smoother GaussSeidel; tolerance 1e-9; relTol 0.02; }
  U { solver smoothSolver; smoother symGaussSeidel; tolerance 1e-10; relTol 0.05; } }
SIMPLE { nNonOrthogonalCorrectors 1; consistent yes; residualControl { p 1e-7; U 1e-7; } }
relaxationFactors { equations { U 0.9; } }
"""
CONTROL = """application simpleFoam; startFrom startTime; startTime 0; stopAt endTime; endTime 1500;
deltaT 1; writeControl timeStep; writeInterval 1500; writeFormat ascii;
functions { forces { type forces; libs (forces); writeControl timeStep; writeInterval 50;
  patches (sphere); rho rhoInf; rhoInf 1; CofR (0 0 0); log false; } }
"""
SIDES = "back { type wedge; } front { type wedge; } axis { type empty; }"
VELOCITY = f"""dimensions [0 1 -1 0 0 0 0]; internalField uniform (1 0 0);
boundaryField {{ sphere {{ type noSlip; }} inlet {{ type fixedValue; value uniform (1 0 0); }}
  side {{ type slip; }} outlet {{ type zeroGradient; }} {SIDES} }}
"""
PRESSURE = f"""dimensions [0 2 -2 0 0 0 0]; internalField uniform 0;
boundaryField {{ sphere {{ type zeroGradient; }} inlet {{ type zeroGradient; }}
  side {{ type slip; }} outlet {{ type fixedValue; value uniform 0; }} {SIDES} }}
"""


def mesh(tank: tuple[float, float, float]) -> str:
    """Three blocks from the sphere (points A) to the tank (B), in diameters, axis along x."""
    radius, before, behind = tank
    half = 0.5 * np.sqrt(0.5)
    out, grading = (150, 50) if radius < 10 else (200, 300)  # cells from the sphere to the tank
    places = {
        "A0": (-0.5, 0.0), "A1": (-half, half), "A2": (half, half), "A3": (0.5, 0.0),
        "B0": (-before, 0.0), "B1": (-before, radius), "B2": (behind, radius), "B3": (behind, 0.0),
    }  # fmt: skip
    points: list[str] = []
    number: dict[str, int] = {}

    def point(x: float, r: float, sign: int) -> str:
        return f"({x} {r * np.cos(WEDGE / 2)} {sign * r * np.sin(WEDGE / 2)})"

    for name, (x, r) in places.items():
        for side, sign in (("-", -1), ("+", 1)):
            if r > 0 or sign < 0:
                points.append(point(x, r, sign))
            number[name + side] = len(points) - 1

    def corners(names: str, side: str) -> str:
        return " ".join(str(number[name + side]) for name in names.split())

    def face(a: str, b: str) -> str:
        return f"({number[a + '-']} {number[b + '-']} {number[b + '+']} {number[a + '+']})"

    blocks = "".join(
        f"hex ({corners(names, '-')} {corners(names, '+')}) ({along} {out} 1) "
        f"simpleGrading (1 {grading} 1)\n"
        for names, along in CELLS_ALONG.items()
    )
    arcs = "".join(
        f"arc {number[a + side]} {number[b + side]} "
        f"{point(0.5 * np.cos(np.radians(angle)), 0.5 * np.sin(np.radians(angle)), sign)}\n"
        for a, b, angle in (("A0", "A1", 157.5), ("A1", "A2", 90.0), ("A2", "A3", 22.5))
        for side, sign in (("-", -1), ("+", 1))
    )
    wedges = {side: " ".join(f"({corners(n, side)})" for n in CELLS_ALONG) for side in "-+"}
    return f"""convertToMeters 1;
vertices ({" ".join(points)});
blocks ({blocks});
edges ({arcs});
boundary (
sphere {{ type wall; faces ({face("A0", "A1")} {face("A1", "A2")} {face("A2", "A3")}); }}
inlet {{ type patch; faces ({face("B0", "B1")}); }}
side {{ type patch; faces ({face("B1", "B2")}); }}
outlet {{ type patch; faces ({face("B2", "B3")}); }}
back {{ type wedge; faces ({wedges["-"]}); }}
front {{ type wedge; faces ({wedges["+"]}); }}
axis {{ type empty; faces ({face("A0", "B0")} {face("A3", "B3")}); }}
);
"""


def drag(reynolds: float, tank: tuple[float, float, float], folder: Path) -> np.ndarray:
    """Drag coefficient; its parts by pressure and by friction."""
    files = {
        "system/blockMeshDict": ("dictionary", mesh(tank)),
        "system/controlDict": ("dictionary", CONTROL),
        "system/fvSchemes": ("dictionary", SCHEMES),
        "system/fvSolution": ("dictionary", SOLUTION),
        "constant/transportProperties": (
            "dictionary",
            f"transportModel Newtonian;\nnu [0 2 -1 0 0 0 0] {1 / reynolds};\n",
        ),
        "constant/turbulenceProperties": ("dictionary", "simulationType laminar;\n"),
        "0/U": ("volVectorField", VELOCITY),
        "0/p": ("volScalarField", PRESSURE),
    }
    for name, (kind, text) in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        head = f"FoamFile {{ version 2.0; format ascii; class {kind}; object {Path(name).name}; }}"
        (folder / name).write_text(f"{head}\n{text}")
    env = dict(os.environ)
    solver = shutil.which("simpleFoam")
    if solver is None:
        raise SystemExit("needs OpenFOAM: there is no simpleFoam")
    # The packages of some systems keep the data of OpenFOAM beside its programs.
    env.setdefault("WM_PROJECT_DIR", str(Path(solver).parents[1] / "share" / "openfoam"))
    for program in ("blockMesh", "simpleFoam"):
        with (folder / f"{program}.log").open("w") as log:
            subprocess.run([program], cwd=folder, env=env, stdout=log, check=True)
    (rows,) = folder.glob("postProcessing/forces/0/force*.dat")
    last = rows.read_text().split("\n")[-2]
    force = [float(x) for x in re.findall(r"[-+0-9.]+e[-+]\d+", last)]
    return np.array(force[0::3]) * (2 * np.pi / WEDGE) / (np.pi / 8)


def main() -> None:
    """Print a line for each Reynolds number."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("reynolds", metavar="RE", type=float, nargs="+")
    parser.add_argument("--tank", type=float, nargs=3, default=BOX)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    for reynolds in options.reynolds:
        folder = (options.out or Path(tempfile.mkdtemp())) / f"{reynolds:g}"
        total, pressure, friction = drag(reynolds, options.tank, folder)
        print(f"Re {reynolds:g}: {total:.4f} = {pressure:.4f} + {friction:.4f}", flush=True)


if __name__ == "__main__":
    main()
