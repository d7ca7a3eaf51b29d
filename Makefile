# Everything a person or CI needs. `make help` lists it.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed

export DVC_NO_ANALYTICS := 1
export MLFLOW_DISABLE_TELEMETRY := true
export DO_NOT_TRACK := 1

.DEFAULT_GOAL := help
.PHONY: help setup demo test bench ui clean

help:  ## list the commands
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: $(STAMP)  ## create .venv and install everything in the locked versions

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "error: Python 3.11 or newer is needed: make PYTHON=/path/to/python3.11 ..."; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

demo: setup  ## plans -> ... -> report on generated mazes, then the cost table and where everything is
	$(BIN)/hinterland experiment=demo

test: setup  ## every check and every test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m pytest -q -n 2

bench: setup  ## time kernels and whole trials beside public packages, and against the committed baseline: 15 minutes
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[bench]'
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -n 0 --benchmark-enable --benchmark-only \
		--benchmark-columns=min,median,rounds --benchmark-json=benchmarks/.raw.json benchmarks
	$(BIN)/python -m benchmarks.compare

ui: setup  ## open the MLflow dashboard on http://127.0.0.1:5000
	MLFLOW_SERVER_ENABLE_JOB_EXECUTION=false $(BIN)/mlflow server --host 127.0.0.1 --port 5000 --workers 1 \
		--backend-store-uri "$${MLFLOW_TRACKING_URI:-sqlite:///$(CURDIR)/mlflow.db}" --artifacts-destination "$(CURDIR)/mlruns"

clean:  ## delete outputs and the tracking store; the environment stays
	rm -rf artifacts mlruns mlflow.db outputs multirun .dvc/tmp .dvc/cache
