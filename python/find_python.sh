#!/usr/bin/env bash
# Prints an interpreter of Python 3.10 or newer that can make environments: PYTHON, or python3. Fails, and says what it lacks, otherwise.
set -euo pipefail
python=${PYTHON:-python3}
if ! command -v "$python" >/dev/null; then
    echo "Python is missing: install Python 3.10 or newer, or name it with PYTHON=…" >&2
    exit 1
fi
if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))'; then
    echo "$("$python" --version) is too old: install Python 3.10 or newer, or name it with PYTHON=…" >&2
    exit 1
fi
if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    echo "$("$python" --version) cannot make environments: install its package venv (Debian: python3-venv)" >&2
    exit 1
fi
command -v "$python"
