# `make demo` and `make test` need nothing but Python >= 3.11 and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test report screenshot bench data clean
demo: $(VENV)/installed
	$(BIN)/mdfconv convert --from beckmann --to ggx 0.2 --format table

test: $(VENV)/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -n auto

report: $(VENV)/installed
	$(BIN)/mdfconv report --output reports --force

# The page of the report as a browser shows it.
screenshot:
	chromium --headless --no-sandbox --hide-scrollbars --window-size=1100,915 \
	  --virtual-time-budget=3000 --screenshot=reports/comparison.png reports/comparison.html

# Times of this machine, as reports/speed-error.*
bench: $(VENV)/installed
	$(BIN)/mdfconv bench --format markdown --csv reports/speed-error.csv \
	  --png reports/speed-error.png --force > reports/speed-error.tmp
	mv reports/speed-error.tmp reports/speed-error.md

# The coefficients of the elementary functions, the stored polynomials of the method fast, and the
# 50-digit values of the audit: minutes.
data: $(VENV)/installed-test
	$(BIN)/python -m tests.generate_elementary
	$(BIN)/python -m tests.generate_fast
	$(BIN)/python -m tests.generate_stability

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(VENV)/installed-test: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	touch $@ $(VENV)/installed

clean:
	rm -rf $(VENV) build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
