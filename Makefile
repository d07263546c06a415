# Everything happens in .venv, made here from pyproject.toml; only Python 3.11 or newer and make are needed.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
SOURCES := simplexmesh tests demos docs/conf.py
WORKERS ?= 4
export PYTHONDONTWRITEBYTECODE :=  # compiling all tests anew takes each process of the suite twenty seconds

.PHONY: help setup demo test suite nightly lint types kernels collected docs benchmark clean

help:
	@echo "make demo       reconstruct organs of the frog, then one of them from a noisy scan, into demo_output/"
	@echo "make test       lint, types and the whole test suite"
	@echo "make kernels    compile all kernels, which otherwise happens at first use"
	@echo "make suite      the test suite alone, by one process per core but at most WORKERS=4"
	@echo "make nightly    more seeds, shapes and files, millions of random operators, and faults put in to see tests fail"
	@echo "make docs       the documentation, with the gallery, into docs/_build/html"
	@echo "make benchmark  nanoseconds per vertex, and ratios against peers"
	@echo "make clean      remove what was made"

$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "simplexmesh needs Python 3.11 or newer; name one with make PYTHON=..."; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev,docs]'
	@touch $@

setup: $(READY)

demo: $(READY)
	$(BIN)/simplexmesh demo --output demo_output

lint: $(READY)
	$(BIN)/ruff check $(SOURCES)
	$(BIN)/ruff format --check $(SOURCES)

types: $(READY)
	$(BIN)/mypy

kernels: $(READY)
	$(BIN)/simplexmesh warm-up

collected: $(READY)
	@$(BIN)/python -m pytest --collect-only --quiet > /dev/null 2>&1 || true  # compiles the tests; the suite tells errors

test: $(READY)
	@$(MAKE) --no-print-directory --jobs=2 kernels lint types collected  # or each process of the suite compiles them
	@$(MAKE) --no-print-directory suite

suite: $(READY)
	$(BIN)/python -m pytest --durations=10 --numprocesses=auto --maxprocesses=$(WORKERS) --dist=loadfile

nightly: $(READY)
	$(BIN)/python -m pytest -m nightly tests
	HYPOTHESIS_PROFILE=thorough $(BIN)/python -m pytest tests/mesh/operators tests/mesh/test_contours.py
	$(BIN)/python tests/mutants.py --count 30

docs: $(READY)
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "documentation: docs/_build/html/index.html"

benchmark: $(READY)
	@for file in tests/benchmarks/bench_*.py; do echo "== $$file"; $(BIN)/python $$file || exit 1; done

clean:
	rm -rf $(VENV) docs/_build docs/gallery docs/api demo_output build dist *.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
