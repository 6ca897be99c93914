# For users: `make demo`, `make test`. Everything else is CMake; see CMakePresets.json.
SHELL := bash
JOBS ?= $(shell nproc)
# Two more than there are processors: some tests wait, for the moment of a signal, a lock, a browser.
TEST_JOBS ?= $(shell echo $$(($(JOBS) + 2)))
BUILD := build
LINT_TOOLS := build-lint/tools
PYTHON_TOOLS := build-python/tools
DOCS_TOOLS := build-docs/tools
SOURCES := $(shell git ls-files '*.cpp' '*.hpp' 2>/dev/null)

.PHONY: help setup build everything demo test flight bench peers slots mutants validation campaign filters consistency forecasts verdict fuzz fuzz-build fuzz-briefly thorough docs shown \
  format lint alone \
  standard sanitize coverage interop wheel wheel-test python-test deb deb-test image image-test conan-test install clean

help:
	@echo 'make demo     install what is missing, build, repeat the experiment of the paper, say where the report is'
	@echo 'make test     build and run the tests, all but a few that fly longest'
	@echo 'make build    the program alone, at $(BUILD)/trihedron'
	@echo 'make everything  with tests and benches'
	@echo 'make bench    measure again what docs/performance.md tells: half an hour; goes on where it was interrupted'
	@echo 'make peers    fly the filters of others, and the batch with Ceres, over the same pass (PEERS: further programs): two minutes'
	@echo 'make slots    count the instructions of each slot of the on-board application'
	@echo 'make flight   fly core on an emulated Cortex-M7 and three other processors; writes the tables of docs/flight.md'
	@echo 'make validation  measure again what docs/validation.md tells'
	@echo 'make campaign  fly the campaign that docs/validation.md tells of; goes on where it was interrupted'
	@echo 'make filters  fly ten thousand flights of the filter alone, of which docs/validation.md tells: five minutes'
	@echo 'make consistency  measure again what docs/consistency.md tells: hours; goes on where it was interrupted'
	@echo 'make forecasts  measure again what docs/forecasts.md tells: hours; goes on where it was interrupted'
	@echo 'make verdict  measure again what docs/verdict.md tells (WORLDS=pattern, SEEDS=number); goes on where it was interrupted'
	@echo 'make mutants  whether the tests of core notice wrong formulas; goes on where it was interrupted'
	@echo 'make interop  whether ccsds-ndm-py, Orekit, SPICE, space_packet_parser and spacepackets read what export writes, and import what they write: a minute'
	@echo 'make wheel    the Python package, in out/wheel (WHEEL_PYTHON=python3.13: for 3.12 and later); make wheel-test tries it'
	@echo 'make python-test  the Python package and its tests, which are part of `make test`'
	@echo 'make deb      Debian packages, in out/deb, and what lintian says of them; make deb-test tries them in fresh roots'
	@echo 'make image    an OCI image of the program, in out/image, after `make deb`; make image-test tries it'
	@echo 'make conan-test  the Conan package of the flight library, used by another project'
	@echo 'make fuzz-briefly  each reader against libFuzzer for twenty seconds or less'
	@echo 'make thorough  before a change is handed in, what .ci/run has no time for: the tests that fly longest, lint, sanitize, coverage, interop, fuzz-briefly'
	@echo 'make fuzz     each reader against libFuzzer for FUZZ_SECONDS (3600) each, measures again what docs/reliability.md tells: hours'
	@echo 'make docs     the site of all documents: tutorials, how-to, reference, explanation, in out/docs/index.html'
	@echo 'make shown    run the commands that the documents show, and write what they print into them'
	@echo 'make install  into PREFIX (default /usr/local)'
	@echo 'make sanitize build with clang under address and undefined-behaviour sanitizers, and run the tests that are not long'
	@echo 'make coverage the tests of core in that build, and the lines and branches of core that they take'
	@echo 'make setup | format | lint | clean'
	@echo 'All files of a module are compiled in one unit, which makes a whole build shorter. Who edits one is served sooner with'
	@echo 'CMAKE_FLAGS=-DCMAKE_UNITY_BUILD=OFF, which compiles each on its own.'

setup:
	@cmake/setup.sh

# The program alone. A build directory that has tests keeps them.
build:
	@cmake/setup.sh program
	cmake $(if $(wildcard $(BUILD)/CMakeCache.txt),$(BUILD),--preset program) $(CMAKE_FLAGS)
	cmake --build $(BUILD) --parallel $(JOBS) --target trihedron

everything: $(PYTHON_TOOLS)/installed
	@cmake/setup.sh program tests flight mpi
	cmake --preset release -DTRIHEDRON_BUILD_PYTHON=ON -DPython_EXECUTABLE=$(abspath $(PYTHON_TOOLS)/bin/python) $(CMAKE_FLAGS)
	cmake --build $(BUILD) --parallel $(JOBS)

demo: build
	$(BUILD)/trihedron demo -o out/demo

test: everything
	ctest --test-dir $(BUILD) --output-on-failure --parallel $(TEST_JOBS) -LE thorough

# What the Python package is built with, needs and is tested with.
$(PYTHON_TOOLS)/installed: python/requirements.txt
	@cmake/setup.sh python
	/usr/bin/python3 -m venv $(PYTHON_TOOLS)
	$(PYTHON_TOOLS)/bin/pip install --quiet --disable-pip-version-check --requirement $<
	touch $@

python-test: $(PYTHON_TOOLS)/installed
	@cmake/setup.sh program tests
	cmake --preset release -DTRIHEDRON_BUILD_PYTHON=ON -DPython_EXECUTABLE=$(abspath $(PYTHON_TOOLS)/bin/python) $(CMAKE_FLAGS)
	cmake --build $(BUILD) --parallel $(JOBS) --target trihedron trihedron_python_stub
	ctest --test-dir $(BUILD) --output-on-failure -R '^python\.'

# With the libraries of this machine that it needs put in. WHEEL_PYTHON: of version 3.12 or later, for one wheel for all of these.
WHEEL_PYTHON ?= $(PYTHON_TOOLS)/bin/python
# By the compiler of the program: by another one the last digits of the ground are others.
wheel: $(PYTHON_TOOLS)/installed
	@cmake/setup.sh program python
	rm -rf out/wheel
	CC=clang-16 CXX=clang++-16 $(WHEEL_PYTHON) -m pip wheel --quiet --no-deps --wheel-dir out/wheel/plain .
	PATH=$(abspath $(PYTHON_TOOLS)/bin):$$PATH $(PYTHON_TOOLS)/bin/auditwheel repair --plat auto --wheel-dir out/wheel out/wheel/plain/trihedron-*.whl
	rm -rf out/wheel/plain
	@ls -l out/wheel
	@test -z "$$(find out/wheel -size +5M)" || { echo 'the wheel is larger than 5 MB' >&2; exit 1; }

# In a fresh environment of WHEEL_PYTHON, with what else the tests need; they compare with the program.
wheel-test: build
	@cmake/setup.sh python
	rm -rf build-python/fresh
	$(WHEEL_PYTHON) -m venv build-python/fresh
	build-python/fresh/bin/pip install --quiet --disable-pip-version-check "$$(ls $(abspath out/wheel)/*.whl)[plots,parquet]" \
	  $$(grep -E '^(mypy|pytest|nbclient|nbformat|ipykernel)=' python/requirements.txt)
	TRIHEDRON_BUILD=$(abspath $(BUILD)) PYTHONDONTWRITEBYTECODE=1 build-python/fresh/bin/python -m pytest -q -p no:cacheprovider python/test


# Debian packages from a copy of the sources. deb-test installs them into a fresh root of Debian.
deb:
	@cmake/setup.sh program packaging
	packaging/deb.sh

deb-test:
	@cmake/setup.sh packaging
	packaging/deb-test.sh

# An OCI image with the package of the program, in out/image.
image:
	@cmake/setup.sh packaging
	packaging/image.sh

image-test:
	@cmake/setup.sh packaging
	packaging/image-test.sh

conan-test:
	@cmake/setup.sh program packaging
	packaging/conan-test.sh

flight:
	@cmake/setup.sh program tests flight targets
	cmake $(if $(wildcard $(BUILD)/CMakeCache.txt),$(BUILD),--preset program) $(CMAKE_FLAGS)
	cmake --build $(BUILD) --parallel $(JOBS) --target trihedron trihedron_fly
	flight/targets/fly.py $(abspath $(BUILD)) docs/flight.md

BENCHES = trihedron trihedron_bench trihedron_count_parts
bench:
	@cmake/setup.sh program tests
	cmake --preset release $(CMAKE_FLAGS)
	cmake --build $(BUILD) --parallel $(JOBS) --target $(BENCHES)
	bench/performance.py $(BUILD) docs/performance.md

# Before `make bench`, which puts the result into docs/performance.md. PEERS: programs of others, each PROGRAM=HOW, that print as
# bench/peers/paper_model.hpp does.
peers:
	@cmake/setup.sh program tests peers
	cmake --preset release $(CMAKE_FLAGS)
	cmake --build $(BUILD) --parallel $(JOBS) --target trihedron trihedron_peers
	@test -e build-peers/bin/pip || python3 -m venv build-peers
	@build-peers/bin/pip install --quiet --disable-pip-version-check --requirement bench/peers/requirements.txt
	build-peers/bin/python bench/peers/peers.py $(BUILD) out/bench/peers.json $(PEERS)

# Instructions of each slot of the on-board application.
slots:
	@cmake/setup.sh program tests
	cmake --preset release $(CMAKE_FLAGS)
	cmake --build $(BUILD) --target trihedron_slots
	bench/slots.py $(BUILD)/trihedron_slots

validation: everything
	validation/validate.py $(BUILD)/trihedron docs/validation.md

campaign: build
	@cmake/setup.sh tests
	@mkdir -p out
	validation/validate.py $(BUILD)/trihedron docs/validation.md --campaign out/campaign

filters: build
	@cmake/setup.sh tests
	@mkdir -p out
	validation/validate.py $(BUILD)/trihedron docs/validation.md --filters out/filters

interop: build
	@cmake/setup.sh interop
	@test -e build-interop/bin/pip || python3 -m venv build-interop
	@build-interop/bin/pip install --quiet --disable-pip-version-check --requirement validation/interop/requirements.txt
	TRIHEDRON_BUILD=$(abspath $(BUILD)) build-interop/bin/python -m pytest -q -p no:cacheprovider validation/interop

mutants:
	@cmake/setup.sh program tests
	validation/mutants/mutants.py build-mutants out/mutants.jsonl --document docs/flight-standard.md --jobs $(JOBS)

sanitize:
	@cmake/setup.sh program tests sanitizers
	cmake --preset sanitize $(CMAKE_FLAGS)
	cmake --build build-sanitize --parallel $(JOBS)
	ctest --test-dir build-sanitize --output-on-failure --parallel $(TEST_JOBS) -LE long

coverage:
	@cmake/setup.sh program tests sanitizers
	cmake --preset sanitize $(CMAKE_FLAGS)
	cmake --build build-sanitize --parallel $(JOBS) --target core_test core_application_test core_no_heap_test
	rm -rf build-sanitize/coverage
	ctest --test-dir build-sanitize --output-on-failure --parallel $(TEST_JOBS) -R '^core' -LE long
	core/test/coverage.py build-sanitize

# The runs of a campaign outlive an interruption, not a change of the program. Status 1: it says of itself "do not use", as estimator paper makes it.
CONSISTENCY = out/consistency
define flown
@if [ $(BUILD)/trihedron -nt $(CONSISTENCY)/$(1)/runs.journal ]; then rm -rf $(CONSISTENCY)/$(1); fi
$(BUILD)/trihedron campaign validation/consistency/$(1).toml -o $(CONSISTENCY)/$(1) --resume || [ $$? = 1 ]
endef
TABULATED = $(BUILD)/trihedron_consistency validation/consistency/$(1).toml $(CONSISTENCY)/$(1) docs/consistency.md

consistency: everything
	@mkdir -p $(CONSISTENCY)
	$(call flown,filters)
	$(call flown,steady)
	$(call flown,whole-pass)
	$(call TABULATED,filters)
	$(call TABULATED,steady) --place batch
	$(call TABULATED,whole-pass) --cells /plane-plane/ --place batch100
	$(call TABULATED,whole-pass) --cells /plane-plane/ --table observable --place observable100
	$(call TABULATED,whole-pass) --runs 30 --table observable --place observable
	$(call TABULATED,whole-pass) --runs 30 --table agreement --place agreement
	$(call TABULATED,steady) --table agreement --place agreement20

forecasts: everything
	@mkdir -p out
	@if [ $(BUILD)/trihedron_forecasts -nt out/forecasts.csv ]; then rm -f out/forecasts.csv; fi
	$(BUILD)/trihedron_forecasts --resume out/forecasts.csv docs/forecasts.md

# WORLDS: a regular expression that their names contain. SEEDS: passes of each world. The table is of all worlds that were measured.
SEEDS ?= 12
verdict: build
	@mkdir -p out
	validation/verdict/verdict.py $(BUILD)/trihedron out/verdict.jsonl --document docs/verdict.md --worlds '$(WORLDS)' --seeds $(SEEDS) --jobs $(JOBS)

# FUZZ_SECONDS: of processor time for each target. FUZZ_TARGETS: those alone, separated by commas. What is found is in out/fuzz/found, and the
# corpus, with which the next run goes on, beside it.
FUZZ_SECONDS ?= 3600
FUZZ_JOBS ?= $(JOBS)
FUZZ = fuzz/run.py build-sanitize --jobs $(FUZZ_JOBS) $(if $(FUZZ_TARGETS),--targets $(FUZZ_TARGETS))

fuzz-build:
	@cmake/setup.sh program tests sanitizers
	cmake --preset sanitize $(CMAKE_FLAGS)
	cmake --build build-sanitize --parallel $(JOBS) --target trihedron_fuzz

fuzz: fuzz-build
	$(FUZZ) --seconds $(FUZZ_SECONDS) --document docs/reliability.md

# The same, for twenty seconds or less of each, and no document. At a priority that gives it a quarter of a processor beside two other processes: a
# quarter of a second, which the longest inputs take, is then far from what counts as a hang.
fuzz-briefly: fuzz-build
	nice -n 5 $(FUZZ) --briefly

thorough: everything lint alone sanitize coverage interop fuzz-briefly
	ctest --test-dir $(BUILD) --output-on-failure --parallel $(JOBS) -L thorough

# Fails on each warning, but those that docs/reference.sh lets pass, and on each broken link.
docs: build $(DOCS_TOOLS)/installed
	@cmake/setup.sh docs
	docs/reference.sh out/docs
	TRIHEDRON_BUILD=$(abspath $(BUILD)) $(DOCS_TOOLS)/bin/python -m sphinx --quiet --fail-on-warning --doctree-dir build-docs/doctrees docs out/docs
	docs/links.py out/docs
	@echo 'out/docs/index.html'

$(DOCS_TOOLS)/installed: docs/requirements.txt
	@cmake/setup.sh docs
	/usr/bin/python3 -m venv $(DOCS_TOOLS)
	$(DOCS_TOOLS)/bin/pip install --quiet --disable-pip-version-check --requirement $<
	touch $@

shown: build
	docs/shown.py $(BUILD) --write

format: $(LINT_TOOLS)/installed
	@$(LINT_TOOLS)/bin/clang-format -i $(SOURCES)

# Each source by itself: packages group them otherwise into units, in which one may live on what another has included.
alone:
	@cmake/setup.sh program
	cmake --preset lint -B build-alone -DCMAKE_UNITY_BUILD=OFF
	cmake/alone.py build-alone --jobs $(JOBS)

# Of one version everywhere. That clang-tidy of Debian 12 runs each check over all that the headers of others contain.
$(LINT_TOOLS)/installed: cmake/lint-requirements.txt
	@cmake/setup.sh lint
	python3 -m venv $(LINT_TOOLS)
	$(LINT_TOOLS)/bin/pip install --quiet --disable-pip-version-check --requirement $<
	touch $@

# What docs/flight-standard.md has checked of core by tools of their own. A view of rows is small enough to be copied.
standard: $(LINT_TOOLS)/installed
	@cmake/setup.sh lint
	cppcheck --quiet --enable=warning,performance,portability --suppress=missingInclude --suppress=passedByValue --std=c++20 --language=c++ \
	  --error-exitcode=1 -I core/include core/src
	$(LINT_TOOLS)/bin/lizard -l cpp core/src core/include -T cyclomatic_complexity=15 -T nloc=60 -T parameter_count=8 -w

# In units of several files: clang-tidy reads Eigen once for each unit instead of once for each file.
# Recursion is forbidden in core alone. The kernels are read once, not for each kind of processor.
UNITS = sed -n 's/^ *"file": "\(.*\/\(Unity\|src\)\/.*\)".*/\1/p' build-lint/compile_commands.json
TIDY = xargs -P $(JOBS) -n 1 $(LINT_TOOLS)/bin/clang-tidy --quiet --extra-arg=-Wno-unused-command-line-argument -p build-lint

lint: standard $(PYTHON_TOOLS)/installed
	@cmake/setup.sh program
	@$(LINT_TOOLS)/bin/clang-format --dry-run --Werror $(SOURCES)
	cmake --preset lint -DTRIHEDRON_BUILD_PYTHON=ON -DPython_EXECUTABLE=$(abspath $(PYTHON_TOOLS)/bin/python)
	$(UNITS) | grep '/trihedron_core\.dir/' | $(TIDY) --checks=misc-no-recursion
	$(UNITS) | grep -v '/trihedron_core\.dir/\|/nanobind\|_avx2\.dir/' | $(TIDY)
	$(LINT_TOOLS)/bin/clang-tidy --quiet validation/mutants/mutant.cpp -- -std=c++20  # no build directory has it

install: build
	cmake --install $(BUILD) $(if $(PREFIX),--prefix $(PREFIX))

clean:
	rm -rf build build-* out node_modules
