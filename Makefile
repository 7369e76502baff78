# make demo    two homes, a few episodes, a video: about three minutes on two cores
# make test    all tests
# make fuzz    damaged files to everything that reads files: three minutes
# make release an sdist and a wheel in dist, tried in an empty environment: about five minutes
# make check   formatting, lint, types, the direction of imports
# make clean   remove the environment and everything that was made
# Each makes .venv when it is missing. PYTHON picks the interpreter (3.11 or newer).

PYTHON ?= python3
BIN := .venv/bin
OUT ?= runs/demo

.PHONY: demo test fuzz release check format clean install install-dev
.DELETE_ON_ERROR:

demo: install
	$(BIN)/vinl eval --floorplans $(PLANS) --loco loco --nav nav --episodes 2 --seeds 1 --obstacles paper \
	  --out $(OUT) --video --fresh

PLANS ?= $(shell $(BIN)/python -c "import vinl; print(*vinl.shipped_floorplans()[:2])" 2>/dev/null)

test: install-dev
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

fuzz: install-dev
	$(BIN)/python tests/fuzz/fuzz.py

# The wheel is built from the sdist, so that both are tried.
release: install-dev
	rm -rf dist
	$(BIN)/python -m build --outdir dist .
	VINL_DIST=dist $(BIN)/python -m pytest tests/packaging -p no:cacheprovider

check: install-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	$(BIN)/pyright

format: install-dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

install: .venv/.light
install-dev: .venv/.full

.venv/bin/python:
	$(PYTHON) -c "import sys; assert sys.version_info >= (3, 11), 'vinl needs Python 3.11 or newer: make PYTHON=python3.12'"
	$(PYTHON) -m venv .venv

# torch first and by itself: where a CPU-only build is offered, pip takes that small one.
.venv/.torch: | .venv/bin/python
	$(BIN)/pip install --quiet "torch==2.13.*"
	touch $@

.venv/.light: pyproject.toml | .venv/.torch
	$(BIN)/pip install --quiet -e .
	touch $@

.venv/.full: pyproject.toml | .venv/.torch
	$(BIN)/pip install --quiet -e ".[train,export,dev]"
	touch $@ .venv/.light

clean:
	rm -rf .venv build dist runs out .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
