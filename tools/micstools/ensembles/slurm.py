"""A script that runs an ensemble as a Slurm job array."""

import shlex
from pathlib import Path

SCRIPT = Path(__file__).with_name("slurm.sh").read_text()


def script(folder: Path, numbers: list[int], program: Path, options: list[str]) -> str:
    """The text of the script for the runs that are missing; options such as `time=2:00:00`."""
    return SCRIPT.format(
        name=folder.name.replace(" ", "-"),
        array=",".join(map(str, numbers)),
        options="".join(f"#SBATCH --{option}\n" for option in options),
        here=shlex.quote(str(Path.cwd())),
        folder=shlex.quote(str(folder)),
        program=shlex.quote(str(program)),
    )
