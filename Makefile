# `make run`: the whole job on simulated hardware. `make test`: every check. Both set up what they need.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
WEEKLY := $(VENV)/.installed-weekly
INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --constraint constraints.txt
# Hundreds of processes import the same modules; without bytecode on disk each of them compiles all for four seconds.
unexport PYTHONDONTWRITEBYTECODE
# Workers with two threads each for a small matrix wait for each other ten times as long as they compute.
unit slow coverage: export OPENBLAS_NUM_THREADS = 1

.PHONY: run test setup weekly lint types contracts collect unit slow fuzz docs coverage minimal thresholds blind figures benchmarks clean

run: $(STAMP)
	$(BIN)/rtctl demo --out out/demo

# Checks that need one core go two at a time; the tests have both cores to themselves.
test: $(STAMP)
	DOCS_WHOLE=false $(MAKE) --jobs=2 --output-sync=target types lint contracts docs collect
	$(MAKE) unit

setup: $(STAMP)

weekly: $(WEEKLY)

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "$(PYTHON) is older than 3.11; try: make PYTHON=python3.11"; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable '.[dev]'
	@touch $@

$(WEEKLY): $(STAMP)
	$(INSTALL) --editable '.[weekly]'
	@touch $@

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy

contracts: $(STAMP)
	$(BIN)/lint-imports

# Every test file is compiled once, while the types are checked on the other core, and not in each worker.
collect: $(STAMP)
	@mkdir -p out
	$(BIN)/python -m pytest --collect-only -qqq -n 0 > out/collected.txt || { cat out/collected.txt; exit 1; }

unit: $(STAMP)
	$(BIN)/python -m pytest

# Further cases of kinds that the suite has already: minutes of diagnoses, also of the Silverbox. Weekly in the workflow.
slow: $(WEEKLY)
	$(BIN)/python -m pytest -m slow

# Random inputs for every reader, TOML file and codec, in processes with limits (about ten minutes).
SEED  ?= 1
COUNT ?= 2000
fuzz: $(STAMP)
	$(BIN)/python tests/fuzz/fuzz.py --seed $(SEED) --count $(COUNT)

# The documentation as a site in out/site; a broken link or an undocumented argument is an error. With DOCS_WHOLE=false
# it has no search index and plain signatures, in two thirds of the time.
docs: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict --site-dir out/site

# The table of thresholds in docs/thresholds.md, from the docstrings of rtctl/diagnosis/thresholds.
thresholds: $(STAMP)
	$(BIN)/python benchmarks/thresholds_table.py

# The suite with line coverage and its floor (compiled kernels are excluded); slower than `make unit`.
coverage: $(STAMP)
	$(BIN)/python -m pytest --cov --cov-report=term

# A base install without any extra, in an environment of its own.
minimal:
	rm -rf $(VENV)-minimal
	$(PYTHON) -m venv $(VENV)-minimal
	$(VENV)-minimal/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --constraint constraints.txt .
	cd $(VENV)-minimal && bin/python ../tests/minimal_install.py

# Hundreds of blind cases on all cores (over an hour on two; goes on where it was stopped): out/blind/blind.md.
OSCILLATORS ?= 4480-4679
VO2         ?= 52290-52359
AMBIGUOUS   ?= 91095-91154
blind: $(WEEKLY)
	$(BIN)/python tests/blind/campaign.py --oscillator $(OSCILLATORS) --vo2 $(VO2) --ambiguous $(AMBIGUOUS) --out out/blind

# The tables and pictures of the documentation, made anew (about three minutes).
figures: $(STAMP)
	$(BIN)/python benchmarks/compare_estimators.py --results docs/results.md
	$(BIN)/python benchmarks/pictures.py

# Every ratio three times, by turns, beside the last committed table: writes docs/speed.json and the table of
# docs/speed.md, and fails where a ratio got worse by a tenth. Under ten minutes on two quiet cores.
benchmarks: $(STAMP)
	$(BIN)/python benchmarks/ratios.py

clean:
	rm -rf $(VENV) $(VENV)-minimal out .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
