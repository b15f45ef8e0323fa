# Everything a newcomer needs; only Python 3.11 with venv must be there.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
CORES ?= 2
# A test of a whole run waits now and then: one worker more than cores fills the gaps.
TESTERS = $(shell expr $(CORES) + 1)
PYTEST = OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $(TESTERS) \
	--dist loadgroup --no-loadscope-reorder

# Each job is a process: modules are to be compiled once, not at every start.
unexport PYTHONDONTWRITEBYTECODE

# Names of folders and words of messages go beyond ASCII, whatever the locale says.
export PYTHONUTF8 := 1

# Snakemake ends with a Python stack where it cannot keep its cache, as on nodes without a home folder.
CACHE_HOME := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)
ifneq ($(shell mkdir -p "$(CACHE_HOME)/snakemake" 2>/dev/null && test -w "$(CACHE_HOME)/snakemake" && echo yes),yes)
export XDG_CACHE_HOME := $(CURDIR)/.snakemake/cache
export MPLCONFIGDIR := $(XDG_CACHE_HOME)/matplotlib
endif

.PHONY: all full demo wheel test test-full test-fast test-kernels lint bench validate mutants figures site report env dev-env lock audit clean

all: env  ## build the studies that config/config.yaml chooses
	$(BIN)/python -m spinepipe.jobs.if_changed all $(BIN)/snakemake -j$(CORES) all

full: env  ## build the long studies too, and what takes long of the others
	$(BIN)/python -m spinepipe.jobs.if_changed full $(BIN)/snakemake -j$(CORES) full

demo: env  ## a first answer: compute the example l4l5_disc
	$(BIN)/spinepipe init --demo

wheel: env  ## dist/spinepipe-*.whl, which holds the workflow and the examples too; no network
	$(BIN)/python -m pip wheel --quiet --no-deps --no-index --no-build-isolation --wheel-dir dist .

test: dev-env  ## run the tests that a change must pass
	$(PYTEST) -m "not full"

test-full: dev-env  ## run all tests, those that are too slow for make test too
	$(PYTEST)

test-fast: dev-env  ## run unit and property tests, in a minute
	$(PYTEST) tests/unit tests/properties -m "not slow and not full"

test-kernels: dev-env  ## numeric tests under each kernel of the linear algebra that this processor can run
	$(BIN)/python -m tests.kernels $(KERNELS) -n $(CORES) --dist loadfile

lint: dev-env  ## format, lint and type checks, and Snakemake's own linter
	$(BIN)/ruff format --check .
	$(BIN)/ruff check --no-cache .
	$(BIN)/mypy
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint

bench: dev-env  ## measure speed side by side with OpenSim
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks

validate: dev-env  ## measure what is too slow for a test; goes on where it was cut off
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.validation
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 PYTHONPATH=.:tests/cases $(BIN)/python -m tests.validation.displaced_joints
	PYTHONPATH=.:tests/cases $(BIN)/python -m tests.validation.soak

mutants: dev-env  ## put small faults into the code and count those that tests see; writes docs/mutants.md
	$(BIN)/python -m tests.mutants --workers $(CORES)

figures: all  ## renew the pictures of README and tutorial from results
	$(BIN)/spinepipe docs --figures

site: dev-env  ## build the documentation as a site that needs no network: site/index.html
	$(BIN)/mkdocs build --strict --quiet

report: env  ## one HTML file with all figures and their captions
	$(BIN)/snakemake --report results/report.html

env: $(VENV)/runtime.done
dev-env: $(VENV)/dev.done

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/runtime.done: $(VENV)/bin/python requirements.lock pyproject.toml setup.py workflow/plugins/pyproject.toml
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable . --editable workflow/plugins
	$(BIN)/python -m spinepipe.cli.engine >/dev/null  # compiles the kernels, else the first study waits for it
	touch $@

$(VENV)/dev.done: $(VENV)/runtime.done requirements-dev.lock
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements-dev.lock
	touch $@

lock:  ## renew the lock files from requirements*.in (needs uv)
	uv pip compile requirements.in $(LOCK) -o requirements.lock
	uv pip compile requirements-dev.in $(LOCK) -o requirements-dev.lock

audit:  ## ask for known faults of the locked packages (needs uv and the network)
	uvx pip-audit --require-hashes --disable-pip --requirement requirements.lock

LOCK := --python-version 3.11 --generate-hashes --no-emit-index-url --no-header \
	--no-annotate --prerelease=if-necessary

clean:  ## remove the environment, results and engine state
	rm -rf $(VENV) results .snakemake build dist
