# Every target first makes what it needs; `make` alone lists them.
SHELL := /bin/bash
PYTHON ?= python3
.NOTPARALLEL:

run := source env.bash && exec
packages := $(notdir $(wildcard src/*))
# Folders count too: theirs is the time that changes when a file is removed. Tests run where they are.
sources := $(shell find src config -name test -prune -o -print)

help:
	@sed -nE 's/^([a-z-]+):.*## /  make \1\t/p' Makefile | expand -t 24

build: install/.built ## set up what is missing, then build what has changed

demo: build ## run two synthetic cameras to a panorama (RIG=folder: the pictures of a rig)
	@$(run) python tools/demo.py $(if $(RIG),--rig '$(RIG)') $(ARGS)

view: build ## the same, live in a browser
	@$(run) python tools/demo.py --view $(if $(RIG),--rig '$(RIG)') $(ARGS)

test: build ## run every test: those of each package, then those across packages
	@$(run) bash tools/run_tests.bash

test-faults: build ## only the tests of cables pulled, cameras gone and files broken (LONG=1: longer)
	@$(run) python -m pytest test/test_faults.py $(ARGS)

bench: build ## measure rates and delays (also bench-overlap, bench-calibration, bench-quality)
	@$(run) python benchmarks/bench.py $(ARGS)

bench-%: build
	@$(run) python benchmarks/$*.py $(ARGS)

lint: .venv/.done ## check style and format
	@source .venv/local_setup.bash && ruff check . && ruff format --check .

clean: ## remove everything that the targets above made
	rm -rf .venv build install log

# Nodes of these runs meet none that run on this machine already.
demo test test-faults bench bench-%: export ROS_DOMAIN_ID := $(shell echo $$((RANDOM % 101 + 1)))

.venv/.done: force
	@command -v $(PYTHON) > /dev/null || { echo 'Python is missing: sudo apt install python3' >&2; exit 1; }
	@$(PYTHON) tools/setup_environment.py

changed = $(sort $(filter $(packages),$(subst /, ,$?)) $(if $(filter config%,$?),panorama_stitch))
install/.built: .venv/.done $(sources)
	@$(if $(filter .venv/.done src,$?),rm -rf build install,rm -rf $(changed:%=build/%) $(changed:%=install/%))
	@source .venv/local_setup.bash && env -u PYTHONDONTWRITEBYTECODE colcon build \
	    --base-paths src $(if $(filter .venv/.done src,$?),,--packages-select $(changed))
	@touch $@

force:
.PHONY: help build demo view test test-faults bench lint clean force
