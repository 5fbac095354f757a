# `make demo` and `make test` set up everything they need in .venv; see `make help`.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

# .venv brings its own ROS 2 wheels. A ROS 2 that is sourced in this shell must neither shadow them
# nor be shadowed, and a process that already loaded such wheels passes on a path to its own.
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE PYTHONHOME
ifdef AMENT_PREFIX_PATH
$(info ROS 2 is sourced in this shell: $(VENV) has its own and ignores it. For your workspace use colcon, see README.md.)
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH
unexport RMW_IMPLEMENTATION ROS_DISTRO ROS_PYTHON_VERSION ROS_VERSION
endif

# Tests of a file stay together: they share what they started. Much of their time is waiting for nodes.
PYTEST := $(BIN)/python -m pytest -n auto --maxprocesses 4 --dist loadfile

# What test/replay/test_golden_logs.py compares with: one log for each scene in that folder.
GOLDEN := test/data/golden

.PHONY: help demo test lint types unit ros-test bench docs golden clean

help:
	@echo 'make demo    set up $(VENV) and compare the simulated gripper with the real one: report/'
	@echo 'make test    set up $(VENV) and run all checks: lint, types and every test'
	@echo '  lint       ruff, and import-linter: what may import what'
	@echo '  types      mypy'
	@echo '  unit       the tests but for the running node and whole scenes'
	@echo '  ros-test   the tests of the node, and of what else imports ROS'
	@echo 'make bench   measure speed against error, beside other simulators: report/benchmark/'
	@echo 'make docs    write docs/ros_interface.md and config/sros2/policy.xml anew, from the node,'
	@echo '             and the API reference in build/docs'
	@echo 'make golden  simulate the scenes in $(GOLDEN) anew: what later versions are compared with'
	@echo 'make clean   remove $(VENV), build products and caches'
	@echo 'Another Python (3.10 to 3.13): make demo PYTHON=python3.12'

demo: $(VENV)/.installed
	$(BIN)/hma_gripper demo

test: lint types
	$(PYTEST)

lint: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-logo

types: $(VENV)/.installed-test
	$(BIN)/mypy

unit: $(VENV)/.installed-test
	$(PYTEST) --ignore=test/node --ignore=test/scenes

ros-test: $(VENV)/.installed-test
	$(PYTEST) test/node test/ros

docs: $(VENV)/.installed-docs
	$(BIN)/python -m hma_gripper_sim.ros.interface_docs
	$(BIN)/sphinx-build --quiet --fresh-env --fail-on-warning docs/api build/docs

bench: $(VENV)/.installed-bench
	$(BIN)/hma_gripper benchmark --out report/benchmark

golden: $(VENV)/.installed
	for scene in $(GOLDEN)/*.yaml; do \
	  rm -rf "$${scene%.yaml}"; \
	  $(BIN)/hma_gripper replay "$$scene" --rate 2.5 --output "$${scene%.yaml}" || exit 1; \
	done

# Editable, so that both are set up anew only when a file changes that says what to install.
$(VENV)/.installed: EXTRAS := ros
$(VENV)/.installed-test: EXTRAS := ros,test
$(VENV)/.installed-bench: EXTRAS := bench
$(VENV)/.installed-docs: EXTRAS := ros,docs
$(VENV)/.installed $(VENV)/.installed-test $(VENV)/.installed-bench $(VENV)/.installed-docs: setup.py setup.cfg pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' || { \
	  echo 'Python 3.10 to 3.13 is needed ($(PYTHON) is not): make $(MAKECMDGOALS) PYTHON=...' >&2; \
	  exit 1; }
	$(PYTHON) -m venv $(VENV)
	@echo 'Installing into $(VENV): one to three minutes the first time.'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[$(EXTRAS)]'
	@touch $@

clean:
	rm -rf $(VENV) build dist install log *.egg-info .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
