# `make demo` and `make test` need Python 3.11 or newer and nothing else; they make their own environment in $(VENV).

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
OUT ?= out
CODE := mlnlite domains tests benchmarks
TREE := build/tree# the package as it is installed: domains/ and grammars/ inside

.PHONY: demo test lint format benchmark clean help
.DEFAULT_GOAL := help

help:  ## what there is to make
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*##/\t/' | expand -t 12

demo: $(VENV)/.installed  ## train, hand an unseen object over, say why, draw it
	$(BIN)/mlnlite handover demo --out $(OUT)

test: $(VENV)/.installed-dev  ## run all tests
	$(BIN)/python -m pytest -q -n auto $(ARGS)

lint: $(VENV)/.installed-dev  ## format check, lint, types, import contract
	$(BIN)/ruff format --check $(CODE)
	$(BIN)/ruff check $(CODE)
	@rm -rf $(TREE) && mkdir -p $(TREE) && cp -Rp mlnlite $(TREE) && cp -Rp domains grammars $(TREE)/mlnlite
	cd $(TREE) && $(abspath $(BIN))/mypy --config-file $(CURDIR)/pyproject.toml --cache-dir $(CURDIR)/.mypy_cache -p mlnlite
	cd $(TREE) && PYTHONPATH=. $(abspath $(BIN))/lint-imports --config $(CURDIR)/pyproject.toml --no-cache

format: $(VENV)/.installed-dev  ## put the code into shape
	$(BIN)/ruff format $(CODE)
	$(BIN)/ruff check --fix $(CODE)

benchmark: $(VENV)/.installed-dev  ## time the commands
	$(BIN)/python -m pytest -q benchmarks --benchmark-only $(ARGS)

clean:  ## remove what was made, the environment included
	rm -rf $(VENV) $(OUT) build dist *.egg-info

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "mlnlite needs Python 3.11 or newer; name it with PYTHON=..."; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[handover]'
	@touch $@

$(VENV)/.installed-dev: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev,handover]'
	@touch $@ $(VENV)/.installed
