#!/usr/bin/env bash
# Runs the tests of the package of Python on the library that `make python-test` has built, in an environment of their own.
set -euo pipefail
cd "$(dirname "$0")/.."
out=target/python
# Notes that the tests are skipped; in continuous integration only where BVHSCOPE_MAY_SKIP lists "python".
skip() {
    line="skipped for want of python: python/tests: $1"
    echo "$line"
    case "${CI:-false}" in
    false | 0 | "") [ -z "${BVHSCOPE_SKIPPED:-}" ] || echo "$line" >>"$BVHSCOPE_SKIPPED" ;;
    *)
        case " ${BVHSCOPE_MAY_SKIP:-} " in
        *" python "*) ;;
        *) exit 1 ;;
        esac
        ;;
    esac
    exit 0
}

reason=$(bash python/find_python.sh 2>&1 >/dev/null) || skip "$reason"
reason=$(bash python/environment.sh "$out/tests" -r python/tests/requirements.txt 2>&1 >/dev/null) || skip "${reason##*$'\n'}"
# trimesh's own tests are in its source package alone.
trimesh=$(grep -m1 '^trimesh==' python/tests/requirements.txt)
export BVHSCOPE_TRIMESH_SOURCE="$PWD/$out/${trimesh/==/-}.tar.gz"
if [ ! -e "$BVHSCOPE_TRIMESH_SOURCE" ]; then
    echo "Fetching the source package of $trimesh"
    "$out/tests/bin/pip" download --disable-pip-version-check --quiet --no-deps --no-binary trimesh -d "$out" "$trimesh" ||
        skip "pip could not fetch the source package of $trimesh"
fi

# The package as it is installed, beside the library.
rm -rf "$out/package"
mkdir -p "$out/package"
cp -r python/bvhscope "$out/package"
for library in target/debug/libbvhscope_python.{so,dylib}; do
    [ ! -e "$library" ] || cp "$library" "$out/package/bvhscope/_engine.abi3.so"
done
PYTHONPATH="$PWD/$out/package" "$out/tests/bin/python" -m pytest -q python/tests "$@"
