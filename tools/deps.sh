#!/bin/sh
# Install what is missing: compiler, HDF5, MPI, drawing libraries; Python packages in .venv.
# Does nothing, quickly, when everything is there. `deps.sh shape test` also installs what
# requirements-shape.txt and requirements-test.txt name, and the libraries that Gmsh asks for; `paper`
# those of WeasyPrint.
set -u
cd "$(dirname "$0")/.." || exit 1
extras=$*

say() { echo "deps: $*"; }
stop() { echo "deps: $*" >&2; exit 1; }

# Addresses of package servers do not belong in a log.
without_addresses() { sed -E 's#[a-z+]*https?://[^ ]*#(server)#g'; }

library() { { ldconfig -p 2>/dev/null || /sbin/ldconfig -p; } 2>/dev/null | grep -q "$1"; }

python_ready() { python3 -c 'import ensurepip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

# Debian packages of all that is missing.
missing() {
  command -v make > /dev/null || echo make
  tools/try_compiler.sh serial "${FC_SERIAL:-h5fc}" || echo gfortran libhdf5-dev
  tools/try_compiler.sh mpi "${FC_MPI:-h5pfc}" \
    || echo gfortran libhdf5-openmpi-dev libopenmpi-dev openmpi-bin
  command -v mpirun > /dev/null || echo openmpi-bin
  python_ready || echo python3 python3-venv
  case $(uname) in
    Linux)
      library libEGL.so.1 || echo libegl1
      library libGL.so.1 || echo libgl1
      library libXcursor.so.1 || echo libxcursor1
      case $extras in
        *shape*)   # Gmsh
          library libGLU.so.1 || echo libglu1-mesa
          library libXrender.so.1 || echo libxrender1
          library libXft.so.2 || echo libxft2
          library libXinerama.so.1 || echo libxinerama1 ;;
      esac
      case $extras in
        *paper*)   # WeasyPrint
          library libpangoft2-1.0.so.0 || echo libpango-1.0-0 libpangoft2-1.0-0
          library libharfbuzz-subset.so.0 || echo libharfbuzz-subset0 ;;
      esac ;;
  esac
}

install_debian() {
  root=
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo > /dev/null || stop "not root and no sudo; as root run: apt-get install $*"
    root=sudo
  fi
  say "installing $*"
  log=$(mktemp) || exit 1
  if ! { $root apt-get update -qq && $root env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "$@"; } > "$log" 2>&1; then
    without_addresses < "$log" | tail -n 30 >&2
    rm -f "$log"
    stop 'apt-get failed'
  fi
  rm -f "$log"
}

advise() {
  say "something is missing ($*). Install it with one of these, then run make deps again:" >&2
  echo "  dnf install make gcc-gfortran hdf5-devel hdf5-openmpi-devel openmpi-devel python3 \\" >&2
  echo "    libglvnd-egl libglvnd-glx      (then: module load mpi/openmpi-x86_64)" >&2
  echo "  brew install make gcc hdf5-mpi open-mpi python      (then: make FC_SERIAL=h5pfc)" >&2
  echo "  conda install -c conda-forge make fortran-compiler 'hdf5=*=mpi_openmpi*' openmpi python" >&2
  exit 1
}

system() {
  wanted=$(missing | tr ' ' '\n' | sort -u | tr '\n' ' ')
  [ -z "$wanted" ] && return
  # shellcheck disable=SC2086
  if command -v apt-get > /dev/null; then install_debian $wanted; else advise $wanted; fi
  left=$(missing | tr '\n' ' ')
  [ -z "$left" ] || stop "still missing after installing: $left"
}

requirements=requirements.txt
for extra in $extras; do
  [ -f "requirements-$extra.txt" ] || stop "there is no requirements-$extra.txt"
  requirements="$requirements requirements-$extra.txt"
done

# Exit code 0 when .venv holds exactly the pinned versions, and `mics-tools`.
python_packages_ready() {
  # shellcheck disable=SC2086
  [ -x .venv/bin/python ] && .venv/bin/python - $requirements <<'END' 2> /dev/null
import sys
from importlib.metadata import version
from pathlib import Path

for name in sys.argv[1:]:
    for line in Path(name).read_text().splitlines():
        if line.strip() and not line.startswith('#'):
            package, pin = line.split('==')
            if version(package) != pin:
                sys.exit(1)
sys.exit(not Path('.venv/bin/mics-tools').exists())
END
}

python_packages() {
  python_packages_ready && return
  say 'installing Python packages in .venv'
  [ -x .venv/bin/python ] && .venv/bin/python -m pip --version > /dev/null 2>&1 \
    || { rm -rf .venv && python3 -m venv .venv; } || stop 'python3 -m venv failed'
  log=$(mktemp) || exit 1
  # shellcheck disable=SC2046
  if ! .venv/bin/python -m pip install --quiet --disable-pip-version-check --only-binary :all: \
    $(printf -- '-r %s ' $requirements) > "$log" 2>&1 || ! .venv/bin/python -m pip install --quiet \
    --disable-pip-version-check --no-deps --no-build-isolation --editable . >> "$log" 2>&1; then
    without_addresses < "$log" | tail -n 30 >&2
    rm -f "$log"
    stop 'pip install failed'
  fi
  rm -f "$log"
  python_packages_ready || stop 'Python packages are not the pinned ones after installing'
}

system
python_packages
