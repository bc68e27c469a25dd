# make book   build the book into book/_build/html        make lint    ruff, notebooks too
#             (executes what changed)                     make clean   remove what these made
# make test   run all tests
#
# With no active environment (venv or conda) a target first makes .venv from requirements-lock.txt.
# A second run installs nothing and needs no network. Without make: README.md, "No `make`?".

PYTHON3 ?= python3

ifeq ($(VIRTUAL_ENV)$(CONDA_PREFIX),)
python := .venv/bin/python
environment := .venv/installed
else
python := python
environment := active-environment
endif

.PHONY: book test lint clean active-environment

book: $(environment)
	$(python) book/build.py

test: $(environment)
	$(python) -m pytest --numprocesses 2

lint: $(environment)
	$(python) -m ruff check .
	$(python) -m ruff format --check .
	$(python) -m nbstripout --verify $(wildcard notebooks/*.ipynb)

clean:
	rm -rf book/_build book/vendor book/node_modules web/node_modules src/motionlab/viewer/live/static
	rm -rf .venv .pytest_cache .ruff_cache .hypothesis

.venv/requirements: requirements-lock.txt
	$(PYTHON3) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "motionlab needs Python 3.11 or newer; name one: make PYTHON3=python3.12 ...")'
	$(PYTHON3) -m venv .venv
	$(python) -m pip install --requirement requirements-lock.txt
	touch $@

# The editable installation also bundles the player from web/ (hatch_build.py).
.venv/installed: .venv/requirements pyproject.toml hatch_build.py $(wildcard web/*.js* web/src/* web/src/*/*)
	$(python) -m pip install --no-deps --no-build-isolation --editable .
	touch $@

active-environment:
	@$(python) -c 'import importlib.metadata as m; [m.version(p) for p in ("motionlab", "jupyter-book", "pytest")]' 2>/dev/null || { \
	  echo 'The active environment lacks motionlab. Either leave it (deactivate), so that make uses .venv, or run in it:'; \
	  echo '  pip install -r requirements-lock.txt && pip install --no-deps --no-build-isolation -e .'; exit 1; }
