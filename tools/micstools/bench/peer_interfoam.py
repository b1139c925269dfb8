"""The dam break of the bench by OpenFOAM's `interFoam` (Debian: openfoam).

Cells, walls that let slip, open top, fluids and Courant number are those of `DAM_BREAK` in
`micstools.bench.jobs`; three pressure corrections, van Leer with compression, no surface tension.
"""

import os
import re
import shutil
from pathlib import Path

import numpy as np

from micstools.bench.jobs import DAM
from micstools.bench.timing import Timing, timed

_PRESSURE = "solver PCG; preconditioner DIC;"
_FILES = {
    "system/controlDict": """
application interFoam; startFrom startTime; startTime 0; stopAt endTime; endTime {seconds};
deltaT 1e-3; writeControl adjustableRunTime; writeInterval {seconds}; writePrecision 10;
timePrecision 8; runTimeModifiable no; adjustTimeStep yes; maxCo 0.5; maxAlphaCo 0.5; maxDeltaT 1;
""",
    "system/fvSchemes": """
ddtSchemes {{ default Euler; }}
gradSchemes {{ default Gauss linear; }}
divSchemes {{ default none; div(rhoPhi,U) Gauss linearUpwind grad(U); div(phi,alpha) Gauss vanLeer;
  div(phirb,alpha) Gauss linear; div(((rho*nuEff)*dev2(T(grad(U))))) Gauss linear; }}
laplacianSchemes {{ default Gauss linear corrected; }}
interpolationSchemes {{ default linear; }}
snGradSchemes {{ default corrected; }}
""",
    "system/fvSolution": """
solvers {{
  "alpha.water.*" {{ nAlphaCorr 2; nAlphaSubCycles 1; cAlpha 1; MULESCorr yes; nLimiterIter 5;
    solver smoothSolver; smoother symGaussSeidel; tolerance 1e-8; relTol 0; }}
  "pcorr.*" {{ {pressure} tolerance 1e-5; relTol 0; }}
  p_rgh {{ {pressure} tolerance 1e-7; relTol 0.05; }}
  p_rghFinal {{ {pressure} tolerance 1e-7; relTol 0; }}
  "U.*" {{ solver smoothSolver; smoother symGaussSeidel; tolerance 1e-6; relTol 0; }}
}}
PIMPLE {{ momentumPredictor no; nOuterCorrectors 1; nCorrectors 3; nNonOrthogonalCorrectors 0; }}
relaxationFactors {{ equations {{ ".*" 1; }} }}
""",
    "system/blockMeshDict": """
vertices ((0 0 0) ({x} 0 0) ({x} {y} 0) (0 {y} 0) (0 0 {z}) ({x} 0 {z}) ({x} {y} {z}) (0 {y} {z}));
blocks (hex (0 1 2 3 4 5 6 7) ({nx} {ny} {nz}) simpleGrading (1 1 1));
boundary (
  walls {{ type wall; faces ((0 4 7 3) (1 2 6 5) (0 1 5 4) (3 7 6 2) (0 3 2 1)); }}
  top {{ type patch; faces ((4 5 6 7)); }}
);
""",
    "constant/g": "dimensions [0 1 -2 0 0 0 0]; value (0 0 -9.81);\n",
    "constant/turbulenceProperties": "simulationType laminar;\n",
    "constant/dynamicMeshDict": "dynamicFvMesh staticFvMesh;\n",
    "constant/transportProperties": """
phases (water air); sigma 0;
water {{ transportModel Newtonian; nu {nu_water}; rho {rho_water}; }}
air {{ transportModel Newtonian; nu {nu_air}; rho {rho_air}; }}
""",
    "0/U": """
dimensions [0 1 -1 0 0 0 0]; internalField uniform (0 0 0);
boundaryField {{ walls {{ type slip; }}
  top {{ type pressureInletOutletVelocity; value uniform (0 0 0); }} }}
""",
    "0/p_rgh": """
dimensions [1 -1 -2 0 0 0 0]; internalField uniform 0;
boundaryField {{ walls {{ type fixedFluxPressure; value uniform 0; }}
  top {{ type totalPressure; p0 uniform 0; value uniform 0; }} }}
""",
    "0/alpha.water": """
dimensions [0 0 0 0 0 0 0]; internalField nonuniform List<scalar> {count} ({shares});
boundaryField {{ walls {{ type zeroGradient; }}
  top {{ type inletOutlet; inletValue uniform 0; value uniform 0; }} }}
""",
}
_CLASSES = {"0/U": "volVectorField", "0/p_rgh": "volScalarField", "0/alpha.water": "volScalarField",
            "constant/g": "uniformDimensionedVectorField"}  # fmt: skip


def installed() -> bool:
    """Is there an interFoam?"""
    return shutil.which("interFoam") is not None


def write_case(folder: Path) -> None:
    """The case of the dam break."""
    n, h = np.array(DAM.cells), np.array(DAM.length) / DAM.cells
    along, up = (np.clip(DAM.column[d] / h[d] - np.arange(n[d]), 0, 1) for d in (0, 2))
    shares = np.broadcast_to(up[:, None, None] * along, n[::-1]).ravel()
    values = {
        "seconds": DAM.seconds, "pressure": _PRESSURE, "count": len(shares),
        "shares": " ".join(f"{share:.10g}" for share in shares),
        "nu_water": DAM.water[1] / DAM.water[0], "nu_air": DAM.air[1] / DAM.air[0],
        "rho_water": DAM.water[0], "rho_air": DAM.air[0],
    }  # fmt: skip
    values |= dict(zip(("nx", "ny", "nz"), DAM.cells, strict=True))
    values |= dict(zip("xyz", DAM.length, strict=True))
    for name, text in _FILES.items():
        path, kind = folder / name, _CLASSES.get(name, "dictionary")
        path.parent.mkdir(parents=True, exist_ok=True)
        head = f"FoamFile {{ version 2.0; format ascii; class {kind}; object {path.name}; }}\n"
        path.write_text(head + text.format(**values))


def dam_break(folder: Path) -> Timing:
    """Run it; the mesh is not timed."""
    write_case(folder)
    program = Path(str(shutil.which("interFoam"))).resolve()
    data = program.parents[1] / "share" / "openfoam"  # of the package of Debian
    settings = {} if "WM_PROJECT_DIR" in os.environ else {"WM_PROJECT_DIR": str(data)}
    timed(["blockMesh"], folder, settings)
    wall, cpu, memory, said = timed(["interFoam"], folder, settings)
    steps = len(re.findall(r"^Time = ", said, re.MULTILINE))
    return Timing(wall, cpu, memory, DAM.seconds, steps, int(np.prod(DAM.cells)))
