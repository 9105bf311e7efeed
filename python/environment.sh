#!/usr/bin/env bash
# environment.sh FOLDER PACKAGE…: makes an environment of Python in FOLDER where there is none, with packages as pip takes them, and
# says what it installs.
set -euo pipefail
folder=$1
shift
python=$(bash "$(dirname "$0")/find_python.sh")
if [ ! -x "$folder/bin/python" ]; then
    "$python" -m venv "$folder"
fi
"$folder/bin/pip" install --disable-pip-version-check --quiet "$@" || {
    echo "pip could not install: $*" >&2
    exit 1
}
