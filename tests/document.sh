#!/bin/sh
# Cargo's RUSTDOC for the tests in the documentation: runs them and writes the documentation, in which warnings are errors.
# `cargo doc` would read every dependency a second time.
rustdoc "$@" || exit
skips=0
for argument do
    shift
    case $argument in
        --test) ;;
        --test-run-directory) skips=1 ;;
        *) if [ "$skips" = 1 ]; then skips=0; else set -- "$@" "$argument"; fi ;;
    esac
done
exec rustdoc "$@" -D warnings --out-dir target/doc
