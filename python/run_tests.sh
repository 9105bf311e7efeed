#!/usr/bin/env bash
# Runs the tests of the package of Python on the library that `make python-test` has built, in an environment of their own.
set -euo pipefail
cd "$(dirname "$0")/.."
out=target/python
if ! reason=$(bash python/find_python.sh 2>&1 >/dev/null); then
    line="skipped for want of python: python/tests: $reason"
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
fi

bash python/environment.sh "$out/tests" -r python/tests/requirements.txt
# trimesh's own tests are in its source package alone.
trimesh=$(grep -m1 '^trimesh==' python/tests/requirements.txt)
export BVHSCOPE_TRIMESH_SOURCE="$PWD/$out/${trimesh/==/-}.tar.gz"
if [ ! -e "$BVHSCOPE_TRIMESH_SOURCE" ]; then
    echo "Fetching the source package of $trimesh"
    "$out/tests/bin/pip" download --disable-pip-version-check --quiet --no-deps --no-binary trimesh -d "$out" "$trimesh"
fi

# The package as it is installed, beside the library.
rm -rf "$out/package"
mkdir -p "$out/package"
cp -r python/bvhscope "$out/package"
for library in target/debug/libbvhscope_python.{so,dylib}; do
    [ ! -e "$library" ] || cp "$library" "$out/package/bvhscope/_engine.abi3.so"
done
PYTHONPATH="$PWD/$out/package" "$out/tests/bin/python" -m pytest -q python/tests "$@"
