# Needs python3 (3.11 or newer, with venv) and make. Each target builds what it needs.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
MADE := $(VENV)/.made
EXTRAS := $(VENV)/.extras
OUTPUT ?= outputs/table1
PAPER ?= outputs/paper
DOCS ?= outputs/docs
SECONDS ?= 30
# Pages whose examples are run, as an expression of pytest's -k: all of them by default.
PAGES ?=
STUDY ?= workflows/studies/table1.toml
PROFILE ?= workflows/profiles/default
# Snakemake has its own environment, because it needs older packages than the tools in $(VENV).
WORKFLOW := .venv-workflow
SNAKEMAKE = PATH="$(CURDIR)/$(BIN):$$PATH" $(WORKFLOW)/bin/snakemake -s workflows/Snakefile

# Both install the same packages, with the hashes of the lock file. `make setup UV=` never uses uv.
UV ?= $(shell command -v uv 2>/dev/null)
WITH_UV = $(UV) venv --quiet --clear --seed --python $(PYTHON) $(VENV) && \
	$(UV) pip install --quiet --python $(BIN)/python --require-hashes -r requirements.lock && \
	$(UV) pip install --quiet --python $(BIN)/python --no-deps --no-build-isolation -e .
# Python compiles the modules that it imports. To compile all of them first takes half of the time.
PIP = $(BIN)/python -m pip --quiet --disable-pip-version-check
WITH_PIP = $(PYTHON) -m venv --clear $(VENV) && $(PIP) install --no-compile --require-hashes -r requirements.lock && \
	$(PIP) install --no-deps --no-build-isolation -e .

# Tests with a target of their own: `make test` leaves them out where their extras are installed.
BROWSER := tests/report/test_browser.py tests/explorer/test_browser.py
DASK := tests/engines/test_dask.py tests/runs/test_dask_run.py

# `make test-all` draws other random examples in each run; all other targets draw the same.
DRAWS =
PYTEST = MAKEFLAGS= $(BIN)/python -m pytest -q $(DRAWS) --numprocesses auto --maxprocesses 4 --dist
# Processes share compiled bytecode through __pycache__, where numba's compiled code is too.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help setup table1 study report explore paper docs validation findings test test-examples test-browser test-dask test-workflow test-faults test-processors test-wheel test-benchmarks test-all check lint types rules format bench coverage fuzz clean

help:
	@echo "make table1   run all stages on the bundled records; table, figures and files in $(OUTPUT)"
	@echo "              (RECORDS='FILE or FOLDER ...' for your own, STRUCTURE=NAME for one structure)"
	@echo "make study    STUDY=FILE with Snakemake, stage by stage, into OUTPUT (default: outputs/study-NAME);"
	@echo "              'rockframe run FILE --output FOLDER' does the same without Snakemake"
	@echo "make report   one page of the run in $(OUTPUT) to look at in a browser: $(OUTPUT)/report.html"
	@echo "make explore  a live page: sliders for the frame and the record, answered by the kernel"
	@echo "make paper    the paper, checked: its figures, and each number and claim beside ours, in $(PAPER)"
	@echo "              (RECORDS=FOLDER with the paper's own records checks its Table 1 too)"
	@echo "make test     run the tests (but for those of the next targets; doctests are in check)"
	@echo "make test-examples  run the examples of the README and the documentation as they stand"
	@echo "              (PAGES='README or tutorial' for some of them)"
	@echo "make test-browser  run the tests of both pages in Chromium (Debian: apt-get install chromium)"
	@echo "make test-dask  run the tests of the engine of Dask clusters"
	@echo "make test-workflow  run the tests of the workflow, with Snakemake"
	@echo "make test-faults  kill, starve and damage runs, and see that they resume (10 minutes)"
	@echo "make test-processors  the tests and table1 with the instructions of other processors (an hour)"
	@echo "make test-wheel  build the wheel and the sdist, and use the wheel as a stranger does (10 minutes)"
	@echo "make test-benchmarks  run each benchmark at its smallest size (3 minutes)"
	@echo "make test-all  every test there is, in one piece (half an hour on two cores)"
	@echo "make docs     the documentation, in $(DOCS)/index.html; every reference checked"
	@echo "make check    format, lint, strict types, doctests, direction of imports"
	@echo "make format   mend what the formatter and the linter can mend"
	@echo "make bench    measure speed and memory, into outputs/bench.json"
	@echo "make coverage  print the branches of rocking, oscillators, matching and risk that no test takes"
	@echo "make fuzz     feed each reader damaged files for $(SECONDS) s, guided by coverage (Linux)"
	@echo "make validation  run a plain integrator, OpenSees and MuJoCo beside the package, and make the"
	@echo "              tables of docs/validation.md (hours)"
	@echo "make findings  run the scripts of findings/: where other programs do not do what one would guess (an hour)"
	@echo "make setup    make the virtual environment $(VENV) from requirements.lock"
	@echo "make clean    remove the virtual environment, caches and outputs"

setup: $(MADE)

$(MADE): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "make: $(PYTHON) is too old. Must be Python 3.11 or newer: make PYTHON=python3.12"; exit 1; }
	@echo "making $(VENV) from requirements.lock (once; a minute or two, some seconds with uv)"
	@{ [ -n "$(UV)" ] && $(WITH_UV); } || { [ -z "$(UV)" ] || echo "uv could not; pip tries"; $(WITH_PIP); }
	@touch $@

$(EXTRAS): $(MADE) requirements-extras.lock
	@echo "adding to $(VENV) from requirements-extras.lock (once; a minute)"
	@$(PIP) install --no-compile --require-hashes -r requirements-extras.lock
	@touch $@

table1: $(MADE)
	@$(BIN)/rockframe table1 --output "$(OUTPUT)" \
		$(if $(RECORDS),--records $(RECORDS)) $(if $(STRUCTURE),--structure $(STRUCTURE))

$(WORKFLOW)/.made: workflows/requirements.lock
	@echo "making $(WORKFLOW), with Snakemake (once; a minute)"
	@$(PYTHON) -m venv --clear $(WORKFLOW)
	@$(WORKFLOW)/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes --no-compile -r $<
	@touch $@

study: STUDY_OUTPUT = $(if $(filter file,$(origin OUTPUT)),outputs/study-$(basename $(notdir $(STUDY))),$(OUTPUT))
study: $(MADE) $(WORKFLOW)/.made
	@$(BIN)/rockframe run $(STUDY) --output $(STUDY_OUTPUT) --plan
	@$(SNAKEMAKE) --directory $(STUDY_OUTPUT) --workflow-profile $(PROFILE)
	@$(BIN)/rockframe verify $(STUDY_OUTPUT)

explore: $(MADE)
	@$(BIN)/rockframe explore $(if $(RECORDS),--records $(RECORDS)) $(if $(STRUCTURE),--structure $(STRUCTURE))

paper: $(MADE)
	@$(BIN)/rockframe paper --output $(PAPER) $(if $(RECORDS),--records $(RECORDS))

$(OUTPUT)/manifest.json:
	@$(MAKE) --no-print-directory table1

report: $(MADE) $(OUTPUT)/manifest.json
	@$(BIN)/rockframe report $(OUTPUT)

test: $(MADE)
	@$(PYTEST) loadfile --no-loadscope-reorder tests \
		$(addprefix --ignore=,$(BROWSER) $(DASK) tests/test_import_direction.py)

test-examples: $(MADE)
	@$(PYTEST) worksteal tests/examples/examples.py $(if $(PAGES),-k "$(PAGES)")

docs: $(EXTRAS)
	@rm -rf $(DOCS)
	@$(BIN)/python -m sphinx -q -W --keep-going -b html -d outputs/.doctrees docs $(DOCS)
	@$(BIN)/python docs/check.py $(DOCS)

test-browser: $(EXTRAS)
	@$(PYTEST) loadfile $(BROWSER)

test-dask: $(EXTRAS)
	@$(BIN)/python -m pytest -q $(DASK)

test-workflow: $(MADE) $(WORKFLOW)/.made
	@$(BIN)/python -m pytest -q -m workflow tests/workflow

test-faults: $(MADE)
	@$(BIN)/python -m pytest -q -m faults tests

test-processors: $(MADE)
	@$(BIN)/python -m tests.recorded.processors

test-wheel: $(MADE)
	@$(BIN)/python -m pytest -q tests/examples/wheel.py

test-benchmarks: $(EXTRAS)
	@$(PYTEST) worksteal tests/smallest_benchmarks.py

test-all: DRAWS = --hypothesis-profile=others
test-all: check test test-examples test-browser test-dask test-faults test-workflow test-benchmarks

# Parts of `make check`, which `make --jobs 2 check` does side by side.
check: lint types rules

lint: $(MADE)
	@$(BIN)/ruff format --check --quiet .
	@$(BIN)/ruff check --quiet .

types: $(MADE)
	@$(BIN)/mypy

rules: $(MADE)
	@$(PYTEST) worksteal pipeline tests/test_import_direction.py tests/suite.py

format: $(MADE)
	@$(BIN)/ruff format --quiet .
	@$(BIN)/ruff check --quiet --fix .

bench: $(EXTRAS)
	@$(BIN)/python -m tests.benchmarks.bench --output outputs/bench.json

coverage: $(EXTRAS)
	@$(BIN)/python -m tests.benchmarks.coverage --output outputs/coverage

validation: $(MADE)
	@nice $(BIN)/python -m tests.validation.independent
	@nice $(BIN)/python -m tests.validation.run
	@$(BIN)/python -m tests.validation.compare
	@nice $(BIN)/python -m tests.validation.bents
	@nice $(BIN)/python -m tests.validation.mujoco
	@$(BIN)/python -m tests.validation.round_columns

# A script asserts what it found: AssertionError in its output means that the behaviour has changed.
findings:
	@mkdir -p outputs/findings; failed=0; \
	for script in findings/*.sh; do \
		name=$$(basename $$script .sh); log=outputs/findings/$$name.txt; start=$$(date +%s); state=ok; \
		bash $$script > $$log 2>&1 || { failed=1; state="not run"; }; \
		if grep -q '^AssertionError' $$log; then state=changed; fi; \
		printf '%-36s %-8s %5d s\n' $$name "$$state" $$(($$(date +%s) - start)); \
	done; exit $$failed

fuzz: $(EXTRAS)
	@$(BIN)/python tests/fuzz/run.py --seconds $(SECONDS)

clean:
	rm -rf $(VENV) $(WORKFLOW) .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find docs pipeline tests records -name __pycache__ -type d -prune -exec rm -rf {} +
	find outputs -mindepth 1 ! -name .gitkeep -delete
