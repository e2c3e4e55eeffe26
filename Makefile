# Targets that need the package set everything up themselves, once: see $(BASIC) and $(READY).

VENV   := .venv
BIN    := $(VENV)/bin
BASIC  := $(VENV)/.installed
READY  := $(VENV)/.ready
RUNS   := $(VENV)/.compiled-for-runs
ALL    := $(VENV)/.compiled
SYSTEM := $(VENV)/.system-libraries

# What the tables of README and docs are made of: scripts, and their arguments after plus signs.
BENCHMARKS := integrator+a+b+b2+c+d integrator+a+b+c+--tight random_systems \
  many_contacts shooting calculix decks fit_coverage large_deflections wheel \
  compilation continuation harmonic nlvib ensemble first_tasks nonsmooth bodies solids contact_kernels laws sweep output \
  eigen eigen+--solids+cube eigen+--solids+150000+plate reduction+1 reduction+--solid

# For test-variant: processor that kernels are compiled for (none: this one), kernels of OpenBLAS,
# "plain" for a C library and NumPy without vector instructions, and the tests to run (none: all).
CPU   :=
BLAS  := Nehalem
LIBS  := plain
TESTS :=
# Tests of what hangs on rounding most, which test-slow repeats as such a variant.
ROUNDED := $(addprefix tests/bifurcation/test_,sharpening.py codim2_forms.py \
  codim2_orbit_forms.py codim2_switching.py fields_without_values.py)

# Tests start many processes, and pytest rewrites their files: what Python keeps of this saves time.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
# Targets share $(VENV), and compiling takes two cores of itself: none run at the same time.
.NOTPARALLEL:
.PHONY: help setup demo test test-fast test-slow test-variant check bench docs validation clean

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1|\2/p' $(MAKEFILE_LIST) | \
	  while IFS='|' read -r name what; do printf '  %-16s %s\n' "$$name" "$$what"; done

setup: $(READY) $(ALL) $(SYSTEM) ## install everything into .venv

demo: $(BASIC) $(RUNS) $(SYSTEM) ## three studies from geometry to movie, into demo-output/
	@$(BIN)/fecontact demo demo-output

test-fast: $(READY) $(ALL) $(SYSTEM) ## run the tests that take seconds
	@$(BIN)/python -m pytest -q -n auto -m 'not slow and not long'

test: $(READY) $(ALL) $(SYSTEM) ## run all tests but the slow ones
	@$(BIN)/python -m pytest -q -n auto

test-slow: $(READY) $(ALL) $(SYSTEM) ## run documents and examples, and what takes long
	@$(BIN)/python -m pytest -q -n auto -m slow
	@$(MAKE) --no-print-directory test-variant TESTS="$(ROUNDED)"

test-variant: $(READY) $(ALL) $(SYSTEM) ## all tests as on another processor: CPU=haswell BLAS=Haswell
	@if [ -n "$(CPU)" ]; then \
	  export NUMBA_CPU_NAME=$(CPU) NUMBA_CPU_FEATURES= NUMBA_CACHE_DIR=$(CURDIR)/build/kernels-$(CPU); \
	fi; \
	if [ "$(LIBS)" = plain ]; then \
	  export GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable; \
	  export NPY_DISABLE_CPU_FEATURES="$$($(BIN)/python -c \
	    'from numpy._core._multiarray_umath import __cpu_dispatch__ as names; print(*names)')"; \
	fi; \
	OPENBLAS_CORETYPE=$(BLAS) $(BIN)/python -m pytest -q -n auto $(TESTS)

check: $(READY) ## ruff and mypy
	@$(BIN)/ruff check .
	@$(BIN)/mypy

bench: $(READY) $(ALL) $(SYSTEM) ## run the benchmarks
	@for run in $(BENCHMARKS); do \
	  name=$${run%%+*}; echo "benchmarks/$$name.py$$(echo "$${run#$$name}" | tr + ' ')"; \
	  $(BIN)/python benchmarks/$$name.py $$(echo "$${run#$$name}" | tr + ' ') || exit 1; \
	done

docs: $(READY) $(ALL) $(SYSTEM) ## build the site into build/site/html
	@$(BIN)/python -m sphinx -W --keep-going -q docs build/site/html

validation: $(READY) $(ALL) $(SYSTEM) ## compute docs/validation.md and its pictures again
	@$(BIN)/python docs/validation/build.py

clean: ## remove .venv, demo-output and caches
	rm -rf $(VENV) demo-output dist build .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@for name in python3.13 python3.12 python3.11 python3; do \
	  if command -v $$name >/dev/null 2>&1 && \
	     $$name -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	    python=$$name; break; \
	  fi; \
	done; \
	if [ -z "$$python" ]; then \
	  echo "fecontact needs Python 3.11 or newer, and there is none on the PATH." >&2; exit 1; \
	fi; \
	if ! $$python -c 'import ensurepip, venv' 2>/dev/null; then \
	  version=$$($$python -c 'import sys; print("%d.%d" % sys.version_info[:2])'); \
	  echo "$$python cannot make virtual environments; please run" >&2; \
	  echo "    apt-get install -y python$$version-venv    (or python3-venv, as root)" >&2; \
	  exit 1; \
	fi; \
	echo "Making $(VENV) with $$($$python --version)"; \
	$$python -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

# What runs need; tools of development take as long again.
$(BASIC): pyproject.toml | $(BIN)/python
	@echo "Installing fecontact and what it needs"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[all]'
	@touch $@

$(READY): pyproject.toml | $(BIN)/python
	@echo "Installing fecontact, what it needs, and the tools of its developers"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@ $(BASIC)

$(RUNS): | $(BASIC)
	@echo "Compiling its kernels for runs, on two cores"
	@$(BIN)/fecontact compile
	@touch $@

$(ALL): | $(READY)
	@echo "Compiling all its kernels, on two cores"
	@$(BIN)/fecontact compile --all
	@touch $@ $(RUNS)

$(SYSTEM): .ci/system-libraries fecontact/core/system_libraries.py | $(BIN)/python
	@$(BIN)/python .ci/system-libraries
	@touch $@
