# make setup | demo | test | ... on this machine; with STACK=debian the same in a Debian 13 root.
# PYTHON=/path/to/python chooses the interpreter, TESTS=tests/unit a part of the suite, WITHOUT=tests/demos the rest,
# JOBS=1 the number of processes for tests on one rank (one a core, at most 8: each may take a gigabyte).

VENV ?= .venv
STACK ?=
TESTS ?= tests
WITHOUT ?=
JOBS ?= $(shell n=$$(env -u OMP_NUM_THREADS nproc); echo $$((n < 8 ? n : 8)))
CASES ?= 10000
OUT ?= out/demo
VALIDATE ?=
ALL ?= out/demos
DOCS ?= build/docs

# What docker/find-python.sh reads; a system stack (KIND=system) or PyPI's (KIND=wheel), if set.
export PYTHON KIND
export OMP_NUM_THREADS ?= 1
export MPLBACKEND ?= Agg

python = $(VENV)/bin/python
# The stack brings its own mpirun (wheel) or has the system's; the latter also wants docker/entry.sh.
mpirun = $(or $(wildcard $(VENV)/bin/mpirun),mpirun)
run = $(shell grep -sqx system $(VENV)/lobefem-setup && echo docker/entry.sh)
sources = $(wildcard lobefem tests demos docker docs benchmarks)

.PHONY: help setup sphinx demo demos docs validation links test test-quick test-serial test-ranks harden bench bench-peers bench-scaling package image lint types check clean distclean

help:
	@echo "make setup      a working $(VENV)/bin/lobefem"
	@echo "make demo       the paper's stack beside its words and a pumpkin's verdict, report.html in $(OUT)"
	@echo "make demos      all demos on coarse meshes in $(ALL), about five minutes"
	@echo "make docs       the documentation in $(DOCS), warnings as errors; VALIDATE=1 computes its numbers anew"
	@echo "make validation compute them and keep them in docs/_computed; make links: outer links"
	@echo "make test       the test suite, serial and on two MPI ranks"
	@echo "make test-quick its quick tests, serial only, in a minute and a half"
	@echo "make harden     ten thousand broken inputs and fifty kills, CASES=10000 of them; some hours"
	@echo "make bench      the common problem by lobefem and the other programs, in out/bench; about an hour,"
	@echo "                BENCH=--short: lobefem and Surface Evolver on fine meshes, a few minutes"
	@echo "make bench-peers  get the other programs, into .peers; BENCH='--runs 3 --meshes 24x32' chooses"
	@echo "make bench-scaling  ten thousand to a million unknowns on one rank and two, in out/scaling"
	@echo "make package    wheel and sdist in build/dist, checked in fresh environments; make image: the container"
	@echo "make lint       ruff and import-linter"
	@echo "make types      mypy"
	@echo "make check      lint and types"
	@echo "make clean      remove caches and outputs; make distclean: the environments too"
	@echo "Add STACK=debian for the reference stack in a Debian 13 root (built on first use)."

ifeq ($(STACK),debian)

setup demo demos docs validation links test test-quick test-serial test-ranks harden bench bench-scaling lint types check:
	docker/debian-root.sh make --no-print-directory $@ STACK= KIND=system \
		VENV=.venv-debian VALIDATE="$(VALIDATE)" CASES="$(CASES)" TESTS="$(TESTS)" WITHOUT="$(WITHOUT)" JOBS="$(JOBS)" OUT="$(OUT)" ALL="$(ALL)" DOCS="$(DOCS)" BENCH="$(BENCH)"

# the other programs are neither stack's
bench-peers:
	$(MAKE) --no-print-directory bench-peers STACK=

else ifeq ($(STACK),)

setup:
	@docker/setup.sh $(VENV)

demo: setup
	$(run) $(python) demos/stability.py --out $(OUT)
	$(run) $(VENV)/bin/lobefem critical meshes/pumpkin.toml --divisions 24x4 --up-to "400 Pa" --overwrite \
		--out $(OUT)/pumpkin
	$(run) $(VENV)/bin/lobefem report $(OUT)

# Coarse enough for a few minutes in all; without --divisions most take the paper's 24 x 32, long ones less.
demos: setup
	$(run) $(python) demos/stability.py --divisions 12x16 --out $(ALL)/stability
	$(run) $(python) demos/eigenvalues.py --divisions 12x16 --out $(ALL)/eigenvalues
	$(run) $(python) demos/mesh_study.py --out $(ALL)/mesh_study
	$(run) $(python) demos/kink.py --divisions 8x16 --out $(ALL)/kink
	$(run) $(python) demos/form_finding.py --divisions 16x24 --out $(ALL)/form_finding
	$(run) $(python) demos/load_path.py --divisions 12x16 --out $(ALL)/load_path
	$(run) $(python) demos/tip_displacement.py --divisions 8x12 --out $(ALL)/tip_displacement
	$(run) $(python) demos/contact.py --out $(ALL)/contact
	$(run) $(python) demos/release.py --divisions 8x12 --out $(ALL)/release
	$(run) $(python) demos/pumpkin.py --divisions 24x4 --out $(ALL)/pumpkin
	$(run) $(python) demos/clefts.py --divisions 10x4 --out $(ALL)/clefts
	$(run) $(python) demos/superpressure.py --divisions 16x4 --out $(ALL)/superpressure
	$(run) $(python) demos/ground_models.py --divisions 16x4 --out $(ALL)/ground_models
	$(run) $(python) demos/table2.py --divisions 6x8 --out $(ALL)/table2

# Sphinx is fetched when it is first wanted; the system's versions of what is there already stay.
sphinx: setup
	@test -e $(VENV)/lobefem-docs || { \
		echo "setup: Sphinx for $(VENV)" && \
		$(python) docker/missing.py $(VENV)/constraints-docs.txt docs >$(VENV)/missing-docs.txt && \
		$(python) -m pip --disable-pip-version-check --quiet install \
			-c $(VENV)/constraints-docs.txt -r $(VENV)/missing-docs.txt && \
		touch $(VENV)/lobefem-docs; }

# VALIDATE=1 computes the validation anew, some minutes; else what is kept in docs/_computed is shown with its age.
docs: sphinx
	$(run) $(python) docs/generate.py $(if $(VALIDATE),,--kept)
	$(run) $(python) -m sphinx -E -a -W --keep-going -q docs $(DOCS)
	@echo "the documentation is in $(DOCS)/index.html"

validation: setup
	$(run) $(python) docs/generate.py --keep

links: docs
	$(run) $(python) -m sphinx -q -b linkcheck docs $(DOCS)/links

test: setup
	$(MAKE) --no-print-directory test-serial
	$(MAKE) --no-print-directory test-ranks

without = $(addprefix --ignore=,$(WITHOUT))
# Processes side by side, each with whole files, whose tests share fixtures.
workers = $(if $(filter-out 1,$(JOBS)),-n $(JOBS) --dist loadfile)
test-serial: setup
	$(run) $(python) -m pytest -q $(workers) $(without) $(TESTS)

test-quick: setup
	$(run) $(python) -m pytest -q $(workers) -m "not slow" $(without) $(TESTS)

# In parts: MPICH has 2048 communicators, and not all of those of a mesh come back before its process ends.
unit = $(shell find tests/unit -name "test_[$(1)]*.py" | sort)
parts = $(if $(filter tests,$(TESTS)),"tests --ignore=tests/unit" "$(call unit,a-h)" "$(call unit,!a-h)","$(TESTS)")
test-ranks: setup
	@set -e; for part in $(parts); do \
		echo "pytest on two ranks: from $${part%% *} on"; \
		$(run) $(mpirun) -n 2 $(python) -m pytest -q -p no:cacheprovider --color=no $(without) $$part </dev/null; \
	done

harden: setup
	LOBEFEM_EXAMPLES=$(CASES) $(run) $(python) -m pytest -q tests/hardening
	LOBEFEM_EXAMPLES=$$(($(CASES) / 10)) $(run) $(mpirun) -n 2 $(python) -m pytest -q -p no:cacheprovider \
		--color=no tests/hardening </dev/null

bench: setup
	$(run) $(python) -m benchmarks.compare $(BENCH)

bench-scaling: setup
	$(run) $(python) -m benchmarks.scaling $(BENCH)

package: setup
	docker/package.sh $(python)

image:
	docker build --platform linux/amd64 --build-arg VERSION=$$(sed -n 's/^__version__ = "\(.*\)"/\1/p' lobefem/version.py) \
		-f docker/Dockerfile -t lobefem .

bench-peers: setup
	benchmarks/install_peers.sh $(python)

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
	rm -rf .venv .venv-debian .peers *.egg-info
	docker/debian-root.sh --remove
	rm -f .debian.lock
