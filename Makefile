# make setup | demo | test | ... on this machine; with STACK=debian the same in a Debian 13 root.
# PYTHON=/path/to/python chooses the interpreter, TESTS=tests/unit a part of the suite.

VENV ?= .venv
STACK ?=
TESTS ?= tests
OUT ?= out/demo
DOCS ?= build/docs

# What docker/find-python.sh reads; a system stack (KIND=system) or PyPI's (KIND=wheel), if set.
export PYTHON KIND
export OMP_NUM_THREADS ?= 1
export MPLBACKEND ?= Agg

python = $(VENV)/bin/python
# The stack brings its own mpirun (wheel) or has the system's; the latter also wants docker/entry.sh.
mpirun = $(or $(wildcard $(VENV)/bin/mpirun),mpirun)
run = $(shell grep -sqx system $(VENV)/lobefem-setup && echo docker/entry.sh)
sources = $(wildcard lobefem tests demos docker docs)

.PHONY: help setup sphinx demo docs links test lint types check clean distclean

help:
	@echo "make setup      a working $(VENV)/bin/lobefem"
	@echo "make demo       figures and tables of demos/stability.py in $(OUT)"
	@echo "make docs       the documentation in $(DOCS), warnings as errors; make links: its outer links"
	@echo "make test       the test suite, serial and on two MPI ranks"
	@echo "make lint       ruff and import-linter"
	@echo "make types      mypy"
	@echo "make check      lint and types"
	@echo "make clean      remove caches and outputs; make distclean: the environments too"
	@echo "Add STACK=debian for the reference stack in a Debian 13 root (built on first use)."

ifeq ($(STACK),debian)

setup demo docs links test lint types check:
	docker/debian-root.sh make --no-print-directory $@ STACK= KIND=system \
		VENV=.venv-debian TESTS="$(TESTS)" OUT="$(OUT)" DOCS="$(DOCS)"

else ifeq ($(STACK),)

setup:
	@docker/setup.sh $(VENV)

demo: setup
	$(run) $(python) demos/stability.py --out $(OUT)

# Sphinx is fetched when it is first wanted; the system's versions of what is there already stay.
sphinx: setup
	@test -e $(VENV)/lobefem-docs || { \
		echo "setup: Sphinx for $(VENV)" && \
		$(python) docker/missing.py $(VENV)/constraints-docs.txt docs >$(VENV)/missing-docs.txt && \
		$(python) -m pip --disable-pip-version-check --quiet install \
			-c $(VENV)/constraints-docs.txt -r $(VENV)/missing-docs.txt && \
		touch $(VENV)/lobefem-docs; }

docs: sphinx
	$(run) $(python) docs/generate.py
	$(run) $(python) -m sphinx -E -a -W --keep-going -q docs $(DOCS)
	@echo "the documentation is in $(DOCS)/index.html"

links: docs
	$(run) $(python) -m sphinx -q -b linkcheck docs $(DOCS)/links

test: setup
	$(run) $(python) -m pytest -q $(TESTS)
	$(run) $(mpirun) -n 2 $(python) -m pytest -q -p no:cacheprovider --color=no $(TESTS) </dev/null

lint: setup
	$(python) -m ruff check $(sources)
	$(python) -m ruff format --check $(sources)
	$(VENV)/bin/lint-imports --no-cache

types: setup
	$(python) -m mypy

check: lint types

else
$(error STACK=$(STACK) is unknown: say STACK=debian or leave it out)
endif

clean:
	rm -rf out build docs/_generated .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find lobefem tests demos docker docs -name __pycache__ -prune -exec rm -rf {} +

distclean: clean
	rm -rf .venv .venv-debian *.egg-info
	docker/debian-root.sh --remove
	rm -f .debian.lock
