#!/bin/sh
# Style of the Fortran and Python sources, sizes; every tool runs, the exit code tells whether all passed.
cd "$(dirname "$0")/.." || exit 1
bin=.venv/bin
status=0
$bin/fortitude check --output-format concise src verification || status=1
$bin/ruff check --quiet --output-format concise || status=1
$bin/ruff format --check --quiet || { $bin/ruff format --check; status=1; }
$bin/python tools/budgets.py || status=1
$bin/mypy --strict -p micstools -p measures -m packages -m budgets || status=1
exit $status
