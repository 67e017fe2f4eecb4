# `make demo` and `make test` do all the set-up themselves, in .venv; they need Python 3.11 and a C++ compiler.

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
SHELL := /bin/bash
.PHONY: help demo recover test test-slow test-gui test-window extension compile-check lint docs benchmark benchmark-derivatives benchmark-triangles throughput compare-cycles stability torture sanitize sanitize-threads check-machine which-python clean

# A pyenv shim exists for every version and fails for those that are not active: run it to know.
# 3.11 comes first, because its Blender module is the oldest that is supported.
PYTHON ?= $(shell for p in python3.11 python3.13 python3 python; do \
    $$p -c 'import sys; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 13)))' >/dev/null 2>&1 && { echo $$p; exit; }; \
  done; echo python3)

# Instruction sets of the kernels: this machine's fastest and the scalar reference that tests compare it with.
# all: each set and the reference; empty: as in release wheels, without the reference that tests need.
KERNELS ?= native

VENV := .venv
RUN := $(VENV)/bin/python
PIP := $(RUN) -m pip install --quiet --disable-pip-version-check
SOURCES := $(shell find native core addon -type f -not -name '*.so' -not -name '*.pyc' 2>/dev/null)
# What demos need: an installation with the tests serves as well, and replacing it would cost its kernels.
TO_RUN := $(if $(wildcard $(VENV)/installed),$(VENV)/installed,$(VENV)/demo-installed)
# Whatever is installed as a package: a change of these asks for a new build.
PACKAGE := pyproject.toml CMakeLists.txt $(SOURCES)

help:
	@echo "make demo        fit a real .blend to a Cycles picture, headless (about 3 minutes the first time)"
	@echo "make recover     find again what was lost, from pictures: shapes, materials, lamps, textures, cameras"
	@echo "make test        run the tests"
	@echo "make test-slow   run the slow tests"
	@echo "make extension   build the Blender extension for this platform in dist/ (needs Python 3.11 and 3.12 or newer)"
	@echo "make compile-check  compile the native sources for Linux on ARM, Windows and macOS, without linking (minutes)"
	@echo "make test-gui    run the tests in a real Blender: BLENDER=blender EXTENSION=dist/edgegrad-0.1.0-linux_x64.zip"
	@echo "make test-window run the tests in a Blender with a window: EXTENSION=… WINDOW_DIR=folder for a chroot"
	@echo "make lint        ruff, clang-format, mypy"
	@echo "make docs        build the documentation in build/docs"
	@echo "make benchmark   times beside Mitsuba 3 (installs it; needs LLVM >= 17)"
	@echo "make benchmark-derivatives  run time against error of derivatives, beside Mitsuba 3 (about 12 minutes)"
	@echo "make benchmark-triangles    run times by the number of triangles, up to a million"
	@echo "make compare-cycles  Blender scenes beside Cycles: figures and pictures (about 15 minutes)"
	@echo "make throughput  rays per second beside Embree, updates, memory"
	@echo "make stability   how errors of derivatives grow as scenes get hard: table and plot"
	@echo "make torture     random scenes over the whole interface: crashes, both modes, threads, differences (minutes)"
	@echo "make sanitize-threads  run tests of many threads on a build with ThreadSanitizer"
	@echo "make sanitize    run the tests and random scenes on a build with AddressSanitizer and UndefinedBehaviorSanitizer"

demo: $(TO_RUN)
	$(RUN) blend_examples/run_demo.py

recover: $(TO_RUN)
	$(RUN) blend_examples/recover.py

# Most tests keep one core busy. worksteal: the tests of a file follow each other in one process, which computes what they
# share once.
test: $(VENV)/installed
	$(RUN) -m pytest -n auto --maxprocesses 4 --dist worksteal

test-slow: $(VENV)/installed
	$(RUN) -m pytest -m slow

test-gui: $(VENV)/installed
	$(RUN) -m pytest -m gui

test-window: $(VENV)/installed
	$(RUN) -m pytest -m window tests/gui

lint: $(VENV)/installed $(VENV)/installed-lint
	$(RUN) -m ruff check .
	$(VENV)/bin/clang-format --dry-run -Werror $$(git ls-files 'native/*.h' 'native/*.cpp')
	$(RUN) -m mypy

# A warning is an error: a broken link, a name that does not exist, a docstring that cannot be read.
docs: $(VENV)/installed $(VENV)/installed-docs
	$(RUN) -m sphinx --quiet --fail-on-warning --keep-going -b html -d build/docs/.doctrees docs build/docs

throughput: $(VENV)/installed
	$(RUN) -m tests.benchmarks.throughput

benchmark: $(VENV)/installed $(VENV)/installed-benchmark
	$(RUN) -m tests.benchmarks.versus_mitsuba

benchmark-derivatives: $(VENV)/installed $(VENV)/installed-benchmark
	$(RUN) -m tests.benchmarks.derivatives --plot blend_examples/pictures/derivatives.png

benchmark-triangles: $(VENV)/installed
	$(RUN) -m tests.benchmarks.triangles --plot blend_examples/pictures/triangles.png

compare-cycles: $(VENV)/installed
	$(RUN) -m tests.benchmarks.versus_cycles

stability: $(VENV)/installed
	$(RUN) -m tests.stability

torture: $(VENV)/installed
	$(RUN) -m tests.torture.run --count 5000 --differences 0.1 --gloss 0.1 --features 0.1

check-machine:
	@$(PYTHON) .ci/check_machine.py

which-python:
	@echo $(PYTHON)

$(RUN): | check-machine
	$(PYTHON) -m venv --upgrade-deps $(VENV)

# $(call install,GROUP,KERNELS): Edgegrad, and the packages of a dependency group.
# Edgegrad is built in a folder that stays, so that a later build compiles only what has changed since: CMake and
# nanobind must then stay too, so they stand in $(VENV). The group's packages and what Edgegrad itself depends on download
# and unpack while the compiler works; modules are compiled when they are first imported.
define install
	@echo "Building Edgegrad and installing it with Blender's Python module into $(VENV) (a few minutes the first time)"
	$(PIP) --no-compile --group build
	$(RUN) -c "import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['project']['dependencies'], sep='\n')" > $(VENV)/dependencies
	$(PIP) --no-compile --group $(1) -r $(VENV)/dependencies & packages=$$!; \
	  $(PIP) --no-build-isolation --no-deps -C build-dir=build/package -C cmake.define.EDGEGRAD_KERNELS=$(2) . && wait $$packages
endef

$(VENV)/installed: $(PACKAGE) | $(RUN)
	$(call install,test,$(KERNELS))
	@touch $@

# Without the tests' packages and their reference kernels, which take a third of the time.
$(VENV)/demo-installed: $(PACKAGE) | $(RUN)
	$(call install,demo,fastest)
	@touch $@

$(VENV)/installed-%: pyproject.toml $(VENV)/installed
	$(PIP) --group $*
	@touch $@

# ---- The Blender extension, built in an environment of its own ----
PACKAGING := .venv-extension

extension: $(PACKAGING)/installed
	$(PACKAGING)/bin/python -m extension.build $(if $(BLENDER),--blender $(BLENDER))

compile-check: $(PACKAGING)/installed
	$(PACKAGING)/bin/python -m pip install --quiet --disable-pip-version-check --group build
	PATH="$(CURDIR)/$(PACKAGING)/bin:$$PATH" $(PACKAGING)/bin/python -m extension.compile_check

$(PACKAGING)/installed: pyproject.toml | check-machine
	test -x $(PACKAGING)/bin/python || $(PYTHON) -m venv --upgrade-deps $(PACKAGING)
	$(PACKAGING)/bin/python -m pip install --quiet --disable-pip-version-check --group extension
	@touch $@

# ---- Debug build under the sanitizers, in its own environment, without the tests that need bpy ----
SANITIZED := .venv-sanitize
# Python itself is not built with ASan, so its run-time comes first in the process; libstdc++ beside it, so that
# exceptions are seen. Leaks are not looked for: the interpreter keeps what it allocated until it ends.
# --capture=sys: pytest must not swallow the report of an error that ends the process.
# CXX=clang++ CC=clang builds ten times as fast as GCC; the name of its run-time is another one.
ASAN_LIBRARY = for name in libclang_rt.asan-$$(uname -m).so libclang_rt.asan.so libasan.so; do \
  file=$$($(or $(CXX),c++) -print-file-name=$$name); if test -e "$$file"; then echo "$$file"; break; fi; done
SANITIZER_ENV = LD_PRELOAD="$$($(ASAN_LIBRARY)) $$($(or $(CXX),c++) -print-file-name=libstdc++.so)" \
  ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1

sanitize: $(SANITIZED)/installed
	$(SANITIZER_ENV) $(SANITIZED)/bin/python -m pytest --capture=sys
	$(SANITIZER_ENV) $(SANITIZED)/bin/python -m tests.torture.run --count 500 --timeout 600

# Races don't depend on the width of packets: one instruction set will do. ThreadSanitizer needs fixed addresses
# (setarch -R), and knows neither the interpreter's locks nor those of Embree's own threads.
sanitize-threads: $(SANITIZED)-threads/installed
	LD_PRELOAD="$$($(or $(CXX),c++) -print-file-name=libtsan.so)" \
	  TSAN_OPTIONS="halt_on_error=1 suppressions=$(CURDIR)/tests/stability/threads.suppressions" \
	  setarch -R $(SANITIZED)-threads/bin/python -m pytest --capture=sys tests/stability/test_threads.py

$(SANITIZED)/installed: SANITIZERS := -C cmake.define.EDGEGRAD_SANITIZE=address,undefined -C cmake.define.EDGEGRAD_KERNELS=all
$(SANITIZED)-threads/installed: SANITIZERS := -C cmake.define.EDGEGRAD_SANITIZE=thread -C cmake.define.EDGEGRAD_KERNELS=scalar
$(SANITIZED)/installed $(SANITIZED)-threads/installed: %/installed: $(PACKAGE) | check-machine
	test -x $*/bin/python || $(PYTHON) -m venv --upgrade-deps $*
	$*/bin/python -m pip install --quiet --disable-pip-version-check . --group test-core -C cmake.build-type=Debug $(SANITIZERS)
	@touch $@

clean:
	rm -rf $(VENV) $(PACKAGING) $(SANITIZED) $(SANITIZED)-threads build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
