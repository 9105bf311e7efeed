# Two commands set everything up on a fresh Debian or Ubuntu machine that has Rust:
#   make run      opens the viewer on the built-in teapot (without a display: writes teapot.png)
#   make test     checks everything that continuous integration checks
# Others for packages and measurements:
#   make install  installs program, desktop entry, icons, man pages and completions under PREFIX
#   make deb      builds a Debian package of the same files in target/debian/
#   make wheel    builds the package of Python in target/wheels/; make python-test tests it
#   make peers    measures beside other engines, with flags as in PEERS="--scenes bunny,dragon --json",
#                 or writes their trees as files: PEERS="--scenes bunny --dump trees"
# Each installs missing system packages first. Everything else is plain cargo.

SHELL := /bin/bash
.SHELLFLAGS := -o pipefail -c

# Loaded by the window and the overlay at run time; compiling needs a C linker only.
RUN_PACKAGES := mesa-vulkan-drivers libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0
# Further packages for the tests of the real window.
TEST_PACKAGES := $(RUN_PACKAGES) xvfb xdotool x11-apps python3-venv python3-xlib

# The commit that rows of measurements name; with "-dirty" where files were changed since. Empty without git or outside of a clone.
export BVHSCOPE_COMMIT ?= $(shell git describe --always --abbrev=12 --dirty --exclude '*' 2>/dev/null)

# Where tests list what they could not check here, and the needs that continuous integration may lack (tests/support/skip.rs).
export BVHSCOPE_SKIPPED := $(CURDIR)/target/skipped.log
export BVHSCOPE_MAY_SKIP ?= models tools python
LIST_SKIPPED = if [ -s "$$BVHSCOPE_SKIPPED" ]; then echo "Not checked here:"; sort "$$BVHSCOPE_SKIPPED"; fi
# The output of all tests, whose results are added up at the end.
TEST_LOG := target/tests.log

# The workspace without the crate of Python, whose library has symbols that only an interpreter has: tests cannot be linked with it.
RUST_WORKSPACE := --workspace --exclude bvhscope-python

.PHONY: run test format unit docs headless python-test python-examples wheel peers counts tables screenshots dist install deb deps-run deps-test deps-peers deps-deb

run: deps-run
	cargo build --release
	@if [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ]; then \
		cargo run -q --release -- $(MODEL); \
	else \
		echo "There is no display here, so the built-in scene is drawn into a file."; \
		cargo run -q --release -- render builtin:teapot --overlay box --depth 4..6 --size 1280x800 -o teapot.png; \
	fi

test: deps-test format unit docs headless python-test
	@$(LIST_SKIPPED)
	@echo "Passed: format, lints, $$(awk '/^test result:/ { n += $$4 } END { print n }' $(TEST_LOG)) tests, documentation."

format:
	cargo fmt --check

# Everything is compiled with lints, and once: no second time in release, as debug assertions are switched by `cfg!(debug_assertions)`,
# which is compiled either way.
unit docs headless python-test: export RUSTC_WORKSPACE_WRAPPER := $(CURDIR)/tests/compile_and_lint.sh

# The tests of the real window mostly wait for it, so they run beside others, one more of these than there are cores, and those of the
# engine and of memory follow: either half takes about as long as the other.
# Without the variable Mesa asks a Wayland display for its device, and each test that draws writes an error about it (src/main.rs).
unit: export NODEVICE_SELECT ?= 1
unit:
	cargo test $(RUST_WORKSPACE) --all-targets --no-run
	@rm -f "$$BVHSCOPE_SKIPPED"; beside_log=$$(mktemp); trap 'rm -f "$$beside_log"' EXIT; \
	cargo test $(RUST_WORKSPACE) --no-fail-fast --test window --test engine --test memory >"$$beside_log" 2>&1 & \
	RUST_TEST_THREADS=$$(($$(nproc) + 1)) cargo test $(RUST_WORKSPACE) --no-fail-fast --lib --test '[!emw]*' 2>&1 | tee $(TEST_LOG); others=$$?; \
	wait $$!; beside=$$?; tee -a $(TEST_LOG) <"$$beside_log"; [ $$((others | beside)) = 0 ] || { $(LIST_SKIPPED); exit 1; }

# The documentation is written while its examples are tested (tests/document.sh).
docs: export RUSTDOC := $(CURDIR)/tests/document.sh
docs:
	cargo test $(RUST_WORKSPACE) --doc 2>&1 | tee -a $(TEST_LOG)

# The program for servers, without window and overlay, the one that writes man pages, and the engine as others use it. The tests need
# the window. With the examples, of which there are none, because the development dependencies leave fewer crates to check again.
headless:
	cargo check --no-default-features --features dist,ktx2 --lib --bins --examples
	cargo check -p bvhscope-engine --no-default-features --lib

# The package of Python: its library is built with the workspace, so that it takes the engine that `unit` has compiled. Neither needs an
# interpreter; where there is none, the tests are skipped.
python-test: export PYO3_NO_PYTHON := 1
python-test: export PYO3_BUILD_EXTENSION_MODULE := 1
python-test:
	cargo build --workspace --lib
	@bash python/run_tests.sh $(PYTEST)

# The package of Python for this machine, for all versions from 3.10 on.
wheel:
	@bash python/environment.sh target/python/build 'maturin>=1.16,<2'
	target/python/build/bin/maturin build --release --locked -m python/Cargo.toml -o target/wheels

# The notebooks, and the examples that spread a sweep, each on two processes of this machine: what they need is large.
python-examples: wheel
	@bash python/environment.sh target/python/examples 'dask[distributed]' matplotlib ray
	target/python/examples/bin/pip install --quiet --force-reinstall --no-deps target/wheels/bvhscope-*.whl
	target/python/examples/bin/python python/examples/run_notebooks.py python/notebooks/*.ipynb
	target/python/examples/bin/python python/examples/sweep.py | cut -f 1-3,5- > target/python/sweep.txt
	for spread in dask ray; do \
		target/python/examples/bin/python python/examples/sweep_$$spread.py | cut -f 1-3,5- | diff target/python/sweep.txt - || exit 1; \
	done

# Takes every picture of README.md, docs and assets/screenshots again: those of the window, with which tests compare it, and those by
# the command `render`, of the models in BVHSCOPE_MODELS. Look at all of them. The figures in assets/paper are made by the commands
# of docs/paper.md.
screenshots: deps-test
	UPDATE_SCREENSHOTS=1 cargo test --test window -- screenshots documents

# This engine beside Embree, obvhs and tinybvh. The rows replace older ones of the same machine and flags in docs/performance.jsonl.
peers: deps-peers
	cargo run --release --no-default-features --features peers --bin peers -- --append docs/performance.jsonl $(PEERS)

# Runs the commands of docs/counts.txt on the models in BVHSCOPE_MODELS, some minutes, and writes their counts to docs/counts.jsonl.
counts:
	UPDATE_COUNTS=1 cargo test --test cli counts

# Writes the tables between marker comments in docs/ from docs/performance.jsonl and docs/counts.jsonl. A test compares them.
tables:
	UPDATE_TABLES=1 cargo test $(RUST_WORKSPACE) --test source tables

# Where `make install` puts the files; DESTDIR goes in front, for packages.
PREFIX ?= /usr/local
DESTDIR ?=
INSTALLED := $(DESTDIR)$(PREFIX)

# The program, with support for screen readers, and the other files of packages. Without cargo, as often under sudo, takes an earlier build.
dist:
	@if command -v cargo >/dev/null; then \
		set -x; rm -rf target/dist; \
		cargo build --release --locked --features accessibility,ktx2 && \
		cargo run --locked --no-default-features --features dist --bin bvhscope-dist -- target/dist; \
	elif [ -x target/release/bvhscope ] && [ -e target/dist/bvhscope.1 ]; then \
		echo "Rust is not in the PATH: taking what was built before."; \
	else \
		echo "Rust is missing: install it from https://rustup.rs, or run 'make dist' as a user who has it." >&2; exit 1; \
	fi

install: dist
	install -Dm755 target/release/bvhscope "$(INSTALLED)/bin/bvhscope"
	install -Dm644 assets/bvhscope.desktop "$(INSTALLED)/share/applications/bvhscope.desktop"
	install -Dm644 assets/bvhscope.mime.xml "$(INSTALLED)/share/mime/packages/bvhscope.xml"
	install -Dm644 assets/bvhscope.metainfo.xml "$(INSTALLED)/share/metainfo/local.bvhscope.bvhscope.metainfo.xml"
	install -Dm644 assets/icon.svg "$(INSTALLED)/share/icons/hicolor/scalable/apps/bvhscope.svg"
	install -Dm644 assets/icon-256.png "$(INSTALLED)/share/icons/hicolor/256x256/apps/bvhscope.png"
	install -d "$(INSTALLED)/share/man/man1"
	install -m644 target/dist/*.1 "$(INSTALLED)/share/man/man1/"
	install -Dm644 target/dist/bvhscope.bash "$(INSTALLED)/share/bash-completion/completions/bvhscope"
	install -Dm644 target/dist/_bvhscope "$(INSTALLED)/share/zsh/site-functions/_bvhscope"
	install -Dm644 target/dist/bvhscope.fish "$(INSTALLED)/share/fish/vendor_completions.d/bvhscope.fish"
	install -Dm644 assets/bvhscope_tree.h "$(INSTALLED)/include/bvhscope_tree.h"
	install -Dm644 -t "$(INSTALLED)/share/bvhscope" assets/bvhscope_tree.py assets/convert_tree.py
	install -Dm644 docs/tree-file.md "$(INSTALLED)/share/doc/bvhscope/tree-file.md"
	install -Dm644 docs/ray-file.md "$(INSTALLED)/share/doc/bvhscope/ray-file.md"
	install -Dm644 LICENSE-MIT "$(INSTALLED)/share/doc/bvhscope/LICENSE-MIT"
	install -Dm644 LICENSE-APACHE "$(INSTALLED)/share/doc/bvhscope/LICENSE-APACHE"
	install -Dm644 assets/debian/copyright "$(INSTALLED)/share/doc/bvhscope/copyright"

deb: deps-deb dist
	@cargo deb --version >/dev/null 2>&1 || { echo "Installing cargo-deb"; cargo install --locked cargo-deb; }
	cargo deb --no-build --locked

deps-run:
	@bash tests/install_packages.sh $(RUN_PACKAGES)

deps-test:
	@bash tests/install_packages.sh $(TEST_PACKAGES)

deps-peers:
	@bash tests/install_packages.sh libembree-dev g++

deps-deb:
	@bash tests/install_packages.sh dpkg-dev
