# Two commands set everything up on a fresh Debian or Ubuntu machine that has Rust:
#   make run    opens the viewer on the built-in teapot (without a display: writes teapot.png)
#   make test   checks everything that continuous integration checks
# A third one measures: make peers, with flags as in PEERS="--scenes bunny,dragon --json".
# Both first install the system packages that are missing. Everything else is plain cargo.

SHELL := /bin/bash

# What the window and the overlay load at run time (nothing is needed to compile beyond a C linker).
RUN_PACKAGES := mesa-vulkan-drivers libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0
# What the tests of the real window need on top.
TEST_PACKAGES := $(RUN_PACKAGES) xvfb xdotool x11-apps python3-xlib

.PHONY: run test format lint unit docs headless peers deps-run deps-test deps-peers

run: deps-run
	cargo build --release
	@if [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ]; then \
		cargo run --release -- $(MODEL); \
	else \
		echo "There is no display here: drawing the built-in scene with its containers into teapot.png instead."; \
		cargo run --release -- render builtin:teapot --overlay box --depth 4..6 --size 1280x800 -o teapot.png; \
	fi

test: deps-test format lint unit headless docs

format:
	cargo fmt --check

# No second time in release: whatever depends on debug assertions asks `cfg!(debug_assertions)`, which is compiled either way.
lint:
	cargo clippy --workspace --all-targets -- -D warnings

# Not the examples, which lint has compiled.
unit:
	cargo test --workspace --lib --test '*' --no-fail-fast
	cargo test --workspace --doc

# The program for servers, without window and overlay, and the engine as others use it. The tests need the window.
headless:
	cargo clippy --no-default-features --lib --bins -- -D warnings
	cargo clippy -p bvhscope-engine --no-default-features --lib -- -D warnings

docs:
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps

# This engine beside Embree and obvhs.
peers: deps-peers
	cargo run --release --no-default-features --features peers --bin peers -- $(PEERS)

deps-run:
	@bash tests/install_packages.sh $(RUN_PACKAGES)

deps-test:
	@bash tests/install_packages.sh $(TEST_PACKAGES)

deps-peers:
	@bash tests/install_packages.sh libembree-dev
