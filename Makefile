# make demo: from nothing to a video and a report.   make test: from nothing to passed tests.
# make docs: the documentation as a site, build/site/index.html.
VENV := .venv
BIN := $(VENV)/bin
SUITABLE := import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11; do \
	$$p -c '$(SUITABLE)' 2>/dev/null && echo $$p && break; done)

.PHONY: install demo test check docs bench clean

# What a first run would wait for is compiled here: a tenth of a second of the first scene, to where
# the duck touches the mud.
AHEAD := demo --duration 0.1 --out $(VENV)/.compiled

# One installation at a time in a checkout; the lock goes with the process that holds it.
ALONE := import fcntl, subprocess, sys; lock = open(".install.lock", "w"); \
	fcntl.flock(lock, fcntl.LOCK_EX); sys.exit(subprocess.call(sys.argv[1:]))

install:
	@test -n "$(PYTHON)" || { echo "Python 3.11, 3.12 or 3.13 is needed: none found."; exit 1; }
	@$(PYTHON) -c '$(ALONE)' $(MAKE) --no-print-directory $(VENV)/.installed

$(VENV)/.installed: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[test,check]"
	@echo "compiling what the first run needs"
	@$(BIN)/corporeal $(AHEAD) >$(VENV)/compiled.log 2>&1 || { cat $(VENV)/compiled.log; exit 1; }
	@rm -rf $(VENV)/.compiled
	@touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[docs]"
	@touch $@

demo: install
	$(BIN)/corporeal demo

# On every core, and CI runs the slow validation too.
test: install
	$(BIN)/python -m pytest -n auto --dist worksteal $(if $(CI),,-m "not slow")

check: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

# Material announces MkDocs 2 as a warning; the extra `docs` asks for MkDocs 1.
docs: install
	@$(PYTHON) -c '$(ALONE)' $(MAKE) --no-print-directory $(VENV)/.installed-docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "build/site/index.html"

bench: install
	$(BIN)/python benchmarks/engine.py

clean:
	rm -rf $(VENV) runs build dist
