# Every target first makes what it needs. `make` alone lists the targets.

SHELL := /bin/bash
PYTHON ?= python3
.NOTPARALLEL:

colcon_build = source .venv/local_setup.bash && env -u PYTHONDONTWRITEBYTECODE colcon build
run = source env.bash &&

packages := $(notdir $(wildcard src/*))
# Folders count too: one changes when a file in it is removed.
sources := colcon.meta $(shell find src config -name test -prune -o -print)
changed = $(sort $(filter $(packages),$(subst /, ,$?)) $(if $(filter config%,$?),panorama_stitch))

help:
	@sed -nE 's/^([a-z-]+):.*## (.*)/make \1\t\2/p' Makefile | expand -t 24

build: install/.built ## set up what is missing and build the packages

.venv/.done: force
	@$(PYTHON) tools/setup_environment.py

install/.built: .venv/.done $(sources)
	@$(colcon_build) $(if $(filter-out src/% config% ,$?),,--packages-select $(changed))
	@touch $@

test: build ## run every test
	$(run) colcon test --executor sequential --event-handlers console_direct+ --return-code-on-test-failure

clean: ## remove everything that the other targets made
	rm -rf .venv build install log

force:
.PHONY: help build test clean force
