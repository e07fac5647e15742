# Every target works on a fresh clone: it makes the virtual environment .venv and installs there
# what it needs, once. Nothing outside this folder is touched.
#
#   make demo   find a hidden effect in a simulated log, add it, write an HTML report
#   make test   run the tests, but for those that are marked slow
#   make slow   run those: more robots, kinds and formulas, each with a whole diagnosis
#   make lint   ruff, codespell, mypy and the documentation build with warnings as errors
#   make docs   build the documentation into docs/_build/html
#   make wheel  build a wheel into dist/ and check that it holds the whole package
#   make compatibility
#               build an archive of the source, install it into an empty environment with the
#               oldest version of every dependency that pyproject.toml allows, and run the core tests
#   make clean  remove what these targets made
#
# Choose another build of torch with, for example, `make demo TORCH=torch`.

PYTHON ?= python3
TORCH ?= torch==2.13.0
VENV ?= .venv
PYTEST_ARGS ?=
# what make compatibility installs into, and runs (-m "" tests for everything, which takes long):
# every package that other packages are called by, once. An older version fails at the first call of
# what it lacks, and not by the size of a robot or the accuracy of an answer.
OLDEST ?= .venv-oldest
CORE_TESTS ?= $(addprefix tests/,robots dynamics identification effects evidence metrics \
    model_selection preprocessing neural_network/test_lstm.py neural_network/test_skorch_member.py \
    committee fleet)

BIN := $(VENV)/bin
# --no-compile: Python compiles what is imported, which is a small part of these packages
PIP_INSTALL := -m pip install --quiet --disable-pip-version-check --no-compile
PIP := $(BIN)/python $(PIP_INSTALL)

# One thread per process: the tests and the docs build use the cores through processes.
export OMP_NUM_THREADS ?= 1
export MKL_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export MPLBACKEND ?= Agg
# Many tests start a new Python, which would compile all that it imports again.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test slow lint check format docs wheel compatibility clean

demo: $(VENV)/.demo
	$(BIN)/python -m skidyn demo

# worksteal: tests of a file stay together, so that what they share is made once
test: $(VENV)/.test
	$(BIN)/python -m pytest -n 2 --dist worksteal $(PYTEST_ARGS)

slow: $(VENV)/.test
	$(BIN)/python -m pytest -n 2 --dist worksteal -m slow $(PYTEST_ARGS)

# at the same time, after all is installed: mypy works on one core, and docs on two only in part
lint: $(VENV)/.lint $(VENV)/.docs
	@$(MAKE) --no-print-directory -j2 check docs

check: $(VENV)/.lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell
	$(BIN)/mypy

format: $(VENV)/.lint
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/.docs
	$(BIN)/python -m sphinx -W --keep-going -q -j 2 -b html docs docs/_build/html

wheel: $(VENV)/.torch
	rm -rf build dist
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .
	$(BIN)/python .ci/check_wheel.py dist/skidyn-*.whl

# pytest by its own name: "python -m pytest" would test the folder, and not what is installed
compatibility: $(OLDEST)/.installed
	$(OLDEST)/bin/python -c "import skidyn; skidyn.show_versions()"
	$(OLDEST)/bin/pytest -n 2 --dist worksteal -p no:cacheprovider -W default::DeprecationWarning $(CORE_TESTS)

clean:
	rm -rf $(VENV) $(OLDEST) build dist docs/_build docs/gallery docs/api

# torch first and alone, so that the chosen build is the one that stays
$(VENV)/.torch:
	$(PYTHON) -m venv $(VENV)
	@echo "Installing $(TORCH) into $(VENV) ..."
	@$(PIP) "$(TORCH)"
	@touch $@

# one stamp per extra: .venv/.test is newer than pyproject.toml when skidyn[test] is installed
$(VENV)/.%: pyproject.toml setup.cfg | $(VENV)/.torch
	@echo "Installing skidyn[$*] into $(VENV) ..."
	@$(PIP) --editable ".[$*]"
	@touch $@

# the wheel, which is built from the archive of the source: pip would keep a wheel of the archive, and
# install that again after the source has changed
$(OLDEST)/.installed: pyproject.toml setup.cfg .ci/oldest.py $(shell git ls-files skidyn)
	rm -rf $(OLDEST)
	$(PYTHON) -m venv $(OLDEST)
	@echo "Installing $(TORCH) and the oldest dependencies into $(OLDEST) ..."
	@$(OLDEST)/bin/python $(PIP_INSTALL) "$(TORCH)" build
	$(OLDEST)/bin/python -m build --outdir $(OLDEST)/dist .
	$(OLDEST)/bin/python .ci/check_wheel.py $(OLDEST)/dist/skidyn-*.whl
	$(OLDEST)/bin/python .ci/oldest.py test > $(OLDEST)/constraints.txt
	@$(OLDEST)/bin/python $(PIP_INSTALL) \
	    -c $(OLDEST)/constraints.txt pytest pytest-xdist hypothesis polars \
	    "skidyn[all] @ file://$$(ls $(abspath $(OLDEST))/dist/skidyn-*.whl)"
	@touch $@
