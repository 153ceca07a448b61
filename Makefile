# Every target sets up what it needs; on a fresh machine only Python 3.12 and git have to be there.
# `make PYTHON=/path/to/python3.12 …` chooses the interpreter, `make help` lists the targets.

PYTHON ?= $(shell command -v python3.12 || command -v python3 || echo python3.12)
VENV := .venv
UV := $(VENV)/bin/uv
RUN := $(VENV)/bin
READY := $(VENV)/.ready
DEMO := outputs/demo
JOBS ?= 1

# No GPU and no display are needed: pictures come from EGL. LeRobot asks no hub for anything.
export MUJOCO_GL ?= egl
export HF_HUB_OFFLINE ?= 1
export TOKENIZERS_PARALLELISM := false

.DEFAULT_GOAL := help
.PHONY: help setup demo demo-fr5 table-manipulation test fuzz lint type docs wheel clean

help: ## list the targets
	@grep -E '^[a-z0-9-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-18s %s\n", $$1, $$2}'

setup: $(READY) ## install everything into .venv

$(READY): pyproject.toml uv.lock
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
	@UV_PROJECT_ENVIRONMENT=$(VENV) $(UV) sync --frozen --inexact
	@touch $@

demo: $(READY) ## record 24 demonstrations, train briefly, evaluate; leaves a video and a table (< 15 min)
	@PATH="$(CURDIR)/$(RUN):$$PATH" bash examples/demo.sh $(DEMO)

demo-fr5: $(READY) ## the trained grasping policy plays a few test scenes; leaves a video and a table (< 3 min)
	@PATH="$(CURDIR)/$(RUN):$$PATH" bash examples/demo_fr5.sh outputs/demo_fr5

table-manipulation: $(READY) ## the FR5 grasping table: data, trainings, evaluations, report (hours; JOBS=2; run again to continue)
	@PATH="$(CURDIR)/$(RUN):$$PATH" snakemake -s workflows/fr5_grasp/Snakefile --cores $(JOBS)

test: $(READY) ## run the test suite
	@OMP_NUM_THREADS=1 $(RUN)/pytest -n 2 --dist=worksteal

fuzz: $(READY) ## random commands to machine and soil, checked after every step (about an hour)
	@OMP_NUM_THREADS=1 $(RUN)/pytest tests/fuzz --hypothesis-profile=fuzz

lint: $(READY) ## check style
	@$(RUN)/ruff check . && $(RUN)/ruff format --check .

type: $(READY) ## check types
	@$(RUN)/mypy

docs: $(READY) ## build the documentation into site/, every page and link checked
	@$(RUN)/mkdocs build --strict

wheel: $(READY) ## build the wheel
	@$(RUN)/python -m build --wheel --no-isolation

clean: ## remove what the targets above made
	rm -rf $(VENV) outputs build dist site
