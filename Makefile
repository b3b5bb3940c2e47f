# Every target first makes what it needs; `make` alone lists them.
SHELL := bash
PYTHON ?= python3
.NOTPARALLEL:

run := source env.bash && exec
packages := $(notdir $(wildcard src/*))
# Folders count too: theirs is the time that changes when a file is removed. Tests run where they are.
sources := $(shell find src -name test -prune -o -print)

help:
	@sed -nE 's/^([a-z-]+):.*## /  make \1\t/p' Makefile | expand -t 24

build: install/.built ## set up what is missing, then build what has changed

demo: build ## run synthetic cameras to a panorama (RIG=ring4, ring3, tilted ..., or a folder of pictures)
	@$(run) python tools/demo.py $(if $(RIG),--rig '$(RIG)') $(ARGS)

view: build ## the same, live in a browser
	@$(run) python tools/demo.py $(if $(RIG),--rig '$(RIG)') --view $(ARGS)

test: build ## run every test: those of each package, then those across packages
	@$(run) bash tools/run_tests.bash

test-faults: build ## only the tests of cables pulled, cameras gone and files broken (LONG=1: longer)
	@$(run) python -m pytest -s test/test_faults*.py $(ARGS)

bench: build ## measure rates and delays (also bench-overlap, bench-turn, bench-video ...: benchmarks/README.md)
	@$(run) python benchmarks/bench.py $(ARGS)

bench-%: build
	@$(run) python benchmarks/$*.py $(ARGS)

bench bench-%: export PYTHONPATH := $(CURDIR)/tools:$(CURDIR)/test:$(CURDIR)/src/fisheye_undistort/test:$(PYTHONPATH)

docs: build ## write the parameter tables of docs/ anew
	@$(run) python tools/parameter_tables.py

lint: .venv/.done ## check style, format and types
	@source .venv/local_setup.bash && ruff check . && ruff format --check . && mypy

clean: ## remove everything that the targets above made
	rm -rf .venv build install log out

.venv/.done: force
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' 2> /dev/null || \
	    { echo 'Python 3.10 to 3.13 is needed: sudo apt install python3, or make PYTHON=python3.12' >&2; exit 1; }
	@$(PYTHON) tools/setup_environment.py

# What $? lists decides which packages are built again.
changed = $(if $(filter .venv/.done src,$?),$(packages),$(sort \
    $(filter $(packages),$(subst /, ,$?))))
install/.built: .venv/.done $(sources)
	@rm -rf $(changed:%=build/%) $(changed:%=install/%)
	@source .venv/local_setup.bash && env -u PYTHONDONTWRITEBYTECODE \
	    colcon build --base-paths src --packages-select $(changed)
	@touch $@

force:
.PHONY: help build demo view test test-faults bench docs lint clean force
