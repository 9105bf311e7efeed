#!/bin/sh
# Cargo's RUSTC_WORKSPACE_WRAPPER: compiles a crate of this workspace by Clippy's driver, which is the compiler with more lints. Warnings
# are errors. Checking for lints apart from compiling would read every dependency a second time.
exec clippy-driver "$@" -D warnings
