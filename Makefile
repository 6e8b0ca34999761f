# Each target sets up what it needs; python3 (3.11 or newer, with venv) and make are enough.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin

.PHONY: setup demo test check bench docs clean

setup: $(VENV)/.dev
demo: $(VENV)/.core
	$(BIN)/steelyard demo
test: $(VENV)/.dev
	$(BIN)/python -m pytest -n auto --maxprocesses 4
check: $(VENV)/.dev
	$(BIN)/ruff check src tests
	$(BIN)/ruff format --check src tests
	$(BIN)/mypy
bench: $(VENV)/.core
	$(BIN)/steelyard bench identify
docs: $(VENV)/.docs
	$(BIN)/mkdocs build --strict
clean:
	rm -rf $(VENV) site

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)
$(VENV)/.core: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[images]'
	@touch $@
$(VENV)/.dev: $(VENV)/.core
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements-dev.txt
	@touch $@
$(VENV)/.docs: $(VENV)/.core
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements-docs.txt
	@touch $@
