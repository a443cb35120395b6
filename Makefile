# SPDX-License-Identifier: Apache-2.0
# Everything happens in .venv, made on first use; needs Python 3.10 to 3.13, git and make.

# PYTHON=/path/to/python3 chooses; otherwise the first of these that really works.
CANDIDATES := $(or $(PYTHON),python3.12 python3.13 python3.11 python3.10 python3)
VENV := .venv
PIP := $(VENV)/bin/python -m pip --disable-pip-version-check install --quiet
# The tests wait a third of the time, so two cores can serve three workers. Each gets tests that
# follow each other, which share fixtures, and takes over half of another's rest when it is done.
WORKERS ?= 3
DISTRIBUTED := -n $(WORKERS) --dist worksteal

# .venv brings its own ROS 2: nothing of a sourced workspace may reach into it.
unexport AMENT_PREFIX_PATH LD_LIBRARY_PATH PYTHONHOME PYTHONPATH RMW_IMPLEMENTATION
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE

.PHONY: help demo test coverage fuzz mutation lint chromium docs colcon venv clean

help:
	@echo "make demo    run case study 1 and record it under runs/"
	@echo "make test    lint, then all tests with branch coverage"
	@echo "make coverage  all tests with branch coverage of the whole package, its processes included"
	@echo "make fuzz    changed files, options, bags and messages; CASES=1000 of each"
	@echo "make mutation  a mutation test of five rooms, hours; go on with it by calling it again"
	@echo "make lint    ruff and mypy"
	@echo "make chromium  install what the tests of the report page need, where that may be done"
	@echo "make docs    build the documentation under build/docs, warnings as errors"
	@echo "make colcon  build with colcon under build/colcon and check what it installed"
	@echo "make venv    only set up .venv (PYTHON=/path/to/python3 chooses the interpreter)"
	@echo "make clean   remove what the other targets made, recordings under runs/ excepted"

demo: $(VENV)/.runtime
	$(VENV)/bin/mfba run case1 --seed 1 --planner paper

# Without a Chromium the tests of the page fail and say so; all others run.
test: lint
	@tools/chromium.sh || true
	$(VENV)/bin/python -m pytest $(DISTRIBUTED) --cov --cov-fail-under=95

# Processes are measured too, which costs about a third more time.
coverage: $(VENV)/.dev
	$(VENV)/bin/python -m pytest $(DISTRIBUTED) --cov --cov-config=tools/coverage.toml \
	  --cov-fail-under=95

CASES ?= 1000
fuzz: $(VENV)/.dev
	$(VENV)/bin/python bench/fuzz.py scenario map import parameters bag messages --cases $(CASES)

mutation: $(VENV)/.dev
	mkdir -p runs
	$(VENV)/bin/python bench/mutation.py --out runs/mutation.jsonl

lint: $(VENV)/.dev
	$(VENV)/bin/ruff check
	$(VENV)/bin/mypy

chromium:
	@tools/chromium.sh

docs: $(VENV)/.dev
	$(VENV)/bin/python -m sphinx --builder html --nitpicky --fail-on-warning --keep-going \
	  --quiet docs build/docs
	@echo "wrote build/docs/index.html"

colcon: $(VENV)/.dev
	tools/colcon_check.sh $(VENV)

venv: $(VENV)/.dev

clean:
	rm -rf $(VENV) build install log *.egg-info .coverage .mypy_cache .pytest_cache .ruff_cache \
	  .hypothesis

# pip is the last thing a venv gets: without it the venv is not whole, so begin anew.
$(VENV)/bin/pip:
	@python=$$(tools/find_python.sh $(CANDIDATES)) && echo "setting up $(VENV) with $$python" && \
	  "$$python" -m venv --clear $(VENV)

$(VENV)/.runtime: setup.py requirements-ros.txt | $(VENV)/bin/pip
	$(PIP) --upgrade setuptools wheel --constraint requirements-colcon.txt
	$(PIP) --no-build-isolation -r requirements-ros.txt -e .
	@touch $@

$(VENV)/.dev: $(VENV)/.runtime requirements-colcon.txt
	$(PIP) --no-build-isolation -r requirements-ros.txt -r requirements-colcon.txt \
	  -e '.[docs,lint,test]'
	@touch $@
