# Every target sets up what it needs; on a fresh machine only Python 3.12 and git have to be there.
# `make PYTHON=/path/to/python3.12 …` chooses the interpreter, `make help` lists the targets.

PYTHON ?= $(shell command -v python3.12 || command -v python3 || echo python3.12)
VENV := .venv
UV := $(VENV)/bin/uv
RUN := $(VENV)/bin
# What only reads the code needs no compiled simulator, so continuous integration checks style while that compiles.
INSTALLED := $(VENV)/.installed
READY := $(VENV)/.ready
LOWEST := $(VENV)/lowest
NEWEST := $(VENV)/newest
JUDGES := $(VENV)/judges
DEMO := outputs/demo
CONSOLE ?= --env.task=Clear-v0 --policy=checkpoints/excavator_mask_act
JOBS ?= 1
# The newest Python that pyproject.toml names; pyenv gives a version only when asked for it.
PYTHON_NEWEST ?= $(shell PYENV_VERSION=3.13 python3.13 -c 'import sys; print(sys.executable)' 2>/dev/null || echo python3.13)
# What differs between versions of what we depend on: simulators, pictures, the interfaces of LeRobot and Gymnasium.
LOWEST_TESTS ?= tests/contract tests/envs/machines tests/envs/tasks tests/envs/configs tests/page
PYTEST := -m pytest -n 2 --dist=worksteal
TOOLS := build hatchling hypothesis pytest pytest-xdist snakemake

# No GPU and no display are needed: pictures come from EGL. LeRobot asks no hub for anything.
export MUJOCO_GL ?= egl
export HF_HUB_OFFLINE ?= 1
export TOKENIZERS_PARALLELISM := false

.DEFAULT_GOAL := help
.PHONY: help setup demo console tutorial demo-fr5 table-manipulation table-excavator test test-all test-cluster test-lowest test-long fuzz validate judge-data lint type docs wheel clean

help: ## list the targets
	@grep -E '^[a-z0-9-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-18s %s\n", $$1, $$2}'

setup: $(READY) ## install everything into .venv

$(INSTALLED): pyproject.toml uv.lock
	@command -v $(PYTHON) >/dev/null 2>&1 && $(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] < (3, 12))' || { \
	  echo "make: '$(PYTHON)' is not Python 3.12 or later."; \
	  echo "  Debian 13: sudo apt-get install python3 python3-venv"; \
	  echo "  Ubuntu 24.04: sudo apt-get install python3.12 python3.12-venv"; \
	  echo "  macOS: brew install python@3.12      anywhere: pyenv install 3.12 or https://www.python.org/downloads/"; \
	  echo "  Then run make again, or name it: make PYTHON=/path/to/python3.12 …"; exit 1; }
	@test -x $(UV) || $(PYTHON) -m venv $(VENV) || { \
	  echo "make: '$(PYTHON) -m venv' failed; Debian 13: sudo apt-get install python3-venv,"; \
	  echo "  Ubuntu 24.04: sudo apt-get install python3.12-venv; then run make again."; exit 1; }
	@echo "Installing into $(VENV): LeRobot, PyTorch and MuJoCo, several GB the first time. Each package is named as it loads."
	@test -x $(UV) || $(VENV)/bin/python -m pip install --quiet "uv>=0.5"
	@UV_PROJECT_ENVIRONMENT=$(VENV) $(UV) sync --frozen --inexact --compile-bytecode
	@$(RUN)/python -m compileall -q lerobot_excav lerobot_env_excav
	@touch $@

$(READY): $(INSTALLED)
	@$(RUN)/lerobot-excav warmup
	@touch $@

demo: $(READY) ## the trained policy clears a pile where it is pointed at; leaves a video, a map and a table (5 min)
	@PATH="$(CURDIR)/$(RUN):$$PATH" bash examples/demo.sh $(DEMO)

console: $(READY) ## a page in the browser: point, drive, let the policy dig there; make CONSOLE="--out=outputs/by_hand" console records
	@PATH="$(CURDIR)/$(RUN):$$PATH" lerobot-excav console $(CONSOLE)

tutorial: $(READY) ## record paired demonstrations, train on them, evaluate: docs/tutorial
	@PATH="$(CURDIR)/$(RUN):$$PATH" bash examples/tutorial.sh outputs/tutorial

demo-fr5: $(READY) ## the trained grasping policy plays a few test scenes; leaves a video and a table (< 3 min)
	@PATH="$(CURDIR)/$(RUN):$$PATH" bash examples/demo_fr5.sh outputs/demo_fr5

table-manipulation: $(READY) ## the FR5 grasping table: data, trainings, evaluations, report (hours; JOBS=2; run again to continue)
	@PATH="$(CURDIR)/$(RUN):$$PATH" snakemake -s workflows/fr5_grasp/Snakefile --cores $(JOBS)

table-excavator: $(READY) ## the excavator's table: data, trainings, evaluations, audit, report (more than a day; JOBS=2; run again to continue)
	@PATH="$(CURDIR)/$(RUN):$$PATH" snakemake -s workflows/excavator/Snakefile --cores $(JOBS)

test: $(READY) ## run the test suite, but for what is marked slow (ten minutes)
	@OMP_NUM_THREADS=1 LP_NUM_THREADS=1 $(RUN)/python $(PYTEST) -m "not slow"

test-all: $(READY) ## run the whole suite (half an hour)
	@OMP_NUM_THREADS=1 LP_NUM_THREADS=1 $(RUN)/python $(PYTEST)

test-cluster: $(READY) ## start a SLURM of two nodes here, kill one at work, compare results (15 minutes; installs slurm-wlm and munge as root)
	@command -v slurmd >/dev/null && command -v munged >/dev/null || { \
	  test "$$(id -u)" = 0 && command -v apt-get >/dev/null && apt-get update -qq && \
	  apt-get install -y -qq --no-install-recommends slurm-wlm munge; } || { \
	  echo "make: slurmd or munged is not here; Debian, Ubuntu: sudo apt-get install --no-install-recommends slurm-wlm munge"; exit 1; }
	@OMP_NUM_THREADS=1 LP_NUM_THREADS=1 $(RUN)/python -m pytest tests/cluster/test_*.py

test-lowest: $(LOWEST)/.ready ## test the simulators with the lowest versions that pyproject.toml allows (LOWEST_TESTS=tests for all)
	@OMP_NUM_THREADS=1 LP_NUM_THREADS=1 $(LOWEST)/bin/python $(PYTEST) $(LOWEST_TESTS)

test-long: $(LOWEST)/.ready $(NEWEST)/.ready ## everything before an issue is called done: both ends of all versions, kills, fuzz (hours)
	@OMP_NUM_THREADS=1 $(RUN)/python $(PYTEST) tests
	@OMP_NUM_THREADS=1 $(LOWEST)/bin/python $(PYTEST) tests
	@OMP_NUM_THREADS=1 $(NEWEST)/bin/python $(PYTEST) tests
	@OMP_NUM_THREADS=1 $(RUN)/python -m pytest tests/long/test_*.py
	@OMP_NUM_THREADS=1 $(RUN)/python -m pytest tests/fuzz --hypothesis-profile=fuzz

$(LOWEST)/.ready: pyproject.toml $(READY)
	@$(UV) venv --quiet --clear --python $(RUN)/python $(LOWEST)
	@$(UV) pip install --quiet --python $(LOWEST)/bin/python --resolution=lowest-direct --editable '.[gpu]'
	@$(UV) pip install --quiet --python $(LOWEST)/bin/python $(TOOLS)
	@touch $@

$(NEWEST)/.ready: pyproject.toml $(READY)
	@command -v $(PYTHON_NEWEST) >/dev/null || { \
	  echo "make: Python 3.13 is not here; install it, or name it: make PYTHON_NEWEST=/path/to/python3.13 test-long"; exit 1; }
	@$(UV) venv --quiet --clear --python $(PYTHON_NEWEST) $(NEWEST)
	@$(UV) pip install --quiet --python $(NEWEST)/bin/python --editable '.[gpu]' $(TOOLS)
	@touch $@

fuzz: $(READY) ## random commands to machine and soil, and random changes of every file and setting (hours)
	@OMP_NUM_THREADS=1 $(RUN)/pytest tests/fuzz --hypothesis-profile=fuzz

validate: $(READY) ## hold the soil to published experiments and to what nobody tuned; prints every gate (some 10 minutes)
	@$(RUN)/python -m validation.soil

judge-data: $(JUDGES)/.ready ## let lerobot-doctor and robovet judge datasets of both machines, by script, gamepad and page (ten minutes)
	@OMP_NUM_THREADS=1 $(RUN)/python -m validation.judges --programs=$(JUDGES)/bin

# Their dependencies differ from LeRobot's, so they have an environment of their own.
$(JUDGES)/.ready: $(READY)
	@$(UV) venv --quiet --clear --python $(RUN)/python $(JUDGES)
	@$(UV) pip install --quiet --python $(JUDGES)/bin/python lerobot-doctor==0.2.0 robovet==0.2.2
	@touch $@

lint: $(INSTALLED) ## check style
	@$(RUN)/ruff check . && $(RUN)/ruff format --check .

type: $(INSTALLED) ## check types
	@$(RUN)/mypy

docs: $(INSTALLED) ## build the documentation into site/, every page and link checked
	@$(RUN)/mkdocs build --strict

wheel: $(INSTALLED) ## build the wheel
	@$(RUN)/python -m build --wheel --no-isolation

clean: ## remove what the targets above made
	rm -rf $(VENV) outputs build dist site
