# From a fresh checkout: `make fit` fits a shipped board, `make test` runs every quick check, `make slow` the tests that it leaves out.

PYTHON ?= $(shell python3.11 -c "" 2>/dev/null && echo python3.11 || echo python3)
VENV ?= .venv
BIN = $(VENV)/bin
# Measured recordings, which are no part of the project.
RECORDINGS ?= recordings

# Thousands of small matrices: threads of a linear algebra library would only wait for one another.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1

.PHONY: fit test slow docs lock audit calibration spectra campaigns plans recordings roving sand measured limits coverage two-setups \
	trial trial-again trial-warp-exciter benchmarks peers batch

fit: $(VENV)/installed
	$(BIN)/bayesplate fit finnish-spruce-cantilever --force

# Compiled modules are kept, whatever the shell says: many tests start the package anew.
test slow: export PYTHONDONTWRITEBYTECODE :=

test: $(VENV)/tested-with
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -n 2 --dist loadfile --durations=30 -m "not slow"

slow: $(VENV)/tested-with
	$(BIN)/python -m pytest -n 2 --dist loadfile -m slow

docs: $(VENV)/tested-with
	$(BIN)/python -m sphinx -W --keep-going -n -b html docs docs/_build/html

# The versions that the tests ran with, and what is known of their weaknesses.
lock: $(VENV)/tested-with
	$(BIN)/python .ci/lock.py > requirements.lock.partial
	mv requirements.lock.partial requirements.lock

audit:
	$(PYTHON) .ci/audit.py

calibration: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/run.py --workers 2 --out results/calibration.jsonl --publish docs/validation

spectra: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/run_spectra.py --boards 200 --workers 2 --out results/spectra.jsonl --publish docs/validation

campaigns: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/run_campaigns.py --campaigns 100 --workers 2 --out results/campaigns.jsonl --publish docs/validation

recordings: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/run_recordings.py --recordings 200 --workers 2 --out results/recordings.jsonl --publish docs/validation

roving: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/run_roving.py --boards 50 --workers 2 --out results/roving.jsonl --publish docs/validation

sand: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/run_sand.py --pictures 20 --workers 2 --out results/sand.jsonl --publish docs/validation

measured: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/run_measured.py --folder $(RECORDINGS) --publish docs/validation

limits: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/run_limits.py --publish docs/validation --workers 2

plans: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/run_plans.py --boards 214 --workers 2 --out results/plans.jsonl --publish docs/validation

trial: $(VENV)/tested-with
	$(BIN)/python tests/validation/trial/run.py --workers 2 --out results/trial.jsonl

trial-again: $(VENV)/tested-with
	$(BIN)/python tests/validation/trial/again.py --boards 16 --workers 2 --out results/trial-again.jsonl --publish docs/validation

trial-warp-exciter: $(VENV)/tested-with
	$(BIN)/python tests/validation/trial/warped_or_driven.py --workers 2 --out results/trial-warp-exciter.jsonl --publish docs/validation

coverage: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/coverage.py --boards 40 --workers 2 --out results/coverage.jsonl --publish docs/validation

two-setups: $(VENV)/tested-with
	$(BIN)/python tests/validation/calibration/coverage.py --boards 40 --effect "clamp_rotation, board free too" --workers 2 \
		--out results/coverage.jsonl --publish docs/validation --page two-setups

benchmarks: $(VENV)/installed
	$(BIN)/python tests/validation/benchmarks/run.py --publish docs/validation --repeats 3

batch: $(VENV)/tested-with
	$(BIN)/python tests/validation/benchmarks/batch.py --boards 10 50 200 --workers 1 2 --dask --many 10000 --out results/batch.jsonl --publish docs/validation

peers: $(VENV)/installed
	$(BIN)/python tests/validation/benchmarks/peers/run.py --publish docs/validation --environments build/peers

# The stamps: an environment is made again when pyproject.toml changes. pip knows dependency groups from 25.1 on.
$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(VENV)/tested-with: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --group dev
	touch $@
