# `make demo` and `make test` do all setup themselves. They need Python >= 3.11, Node >= 20 and make.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
NPM    := npm --prefix web
E2E    := tests/e2e

.DEFAULT_GOAL := help
.PHONY: help setup demo dev check check-python check-types check-page test test-release mutate shots bench generate docs build docker release wheelhouse sbom lock chromium clean

help:            ## list the targets
	@grep -hE '^[a-z-]+: .*##' $(MAKEFILE_LIST) | sed -E 's/:.*## ?/\t/' | expand -t 12

# One stamp per lock file: an environment is updated only if its lock changed.
$(VENV)/.runtime: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "hornbill needs Python 3.11 or later; $(PYTHON) is $$($(PYTHON) -V). Try: make PYTHON=python3.12 ..."; exit 1; }
	@test -x $(BIN)/python || { echo "setting up $(VENV) ..."; $(PYTHON) -m venv $(VENV); }
	@echo "installing the runtime packages (requirements.lock) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --no-deps -r requirements.lock
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --editable .
	@touch $@

$(VENV)/.docs: requirements-docs.lock $(VENV)/.runtime
	@echo "installing the documentation packages (requirements-docs.lock) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --no-deps -r requirements-docs.lock
	@touch $@

$(VENV)/.dev: requirements-dev.lock $(VENV)/.runtime
	@echo "installing the development packages (requirements-dev.lock) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --no-deps -r requirements-dev.lock
	@touch $@

web/node_modules/.stamp: web/package-lock.json
	@command -v npm >/dev/null || { echo "Building the page needs Node 20 or later. Install it, then run make again."; exit 1; }
	@echo "installing the packages of the page (web/package-lock.json) ..."
	@$(NPM) ci --silent --no-audit --no-fund
	@touch $@

web/dist/index.html: web/node_modules/.stamp web/index.html web/package.json web/vite.config.ts $(shell find web/src web/public -type f 2>/dev/null)
	@echo "building the page ..."
	@$(NPM) run --silent build

docs/dist/index.html: $(VENV)/.docs web/src/style/tokens.css $(wildcard *.md) $(shell find docs -type f -not -path 'docs/dist/*')
	@echo "building the documentation ..."
	@rm -rf docs/dist
	@$(BIN)/python -m sphinx -q -W -E -j auto -c docs/site -d build/doctrees . docs/dist || { rm -rf docs/dist; exit 1; }

setup:                                        ## install everything for development
	@$(MAKE) -s --no-print-directory -j2 $(VENV)/.dev web/node_modules/.stamp

demo: $(VENV)/.runtime web/dist/index.html docs/dist/index.html  ## run simulated servos and the page: hornbill demo
	@$(BIN)/hornbill demo $(ARGS)

dev: setup                                    ## run the demo and rebuild the page on every change
	@$(BIN)/hornbill demo $(ARGS) & trap 'kill %1' EXIT; $(NPM) run dev

check: setup                                  ## check format, lint, types and layers
	@$(MAKE) --no-print-directory -j2 check-types check-python check-page

check-python:
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports

check-types:
	web/node_modules/.bin/pyright

check-page:
	$(NPM) run --silent check

test: setup web/dist/index.html chromium      ## run the test suite
	@$(BIN)/python tests/run.py $(TEST_ARGS)

test-release: setup web/dist/index.html docs  ## test the wheel in fresh environments, the image and other browsers
	@$(BIN)/python tests/run.py release $(TEST_ARGS)

mutate: setup                                 ## check that tests detect defects in critical code; NAME=guard for one entry
	@$(BIN)/python tests/mutation $(NAME)

# Chromium for browser tests: installed, or Debian's package (as root), or Playwright's download.
chromium: $(VENV)/.dev
	@$(BIN)/python $(E2E)/chromium.py

shots: setup web/dist/index.html chromium     ## take the pictures of README and docs from the page
	@$(BIN)/python tests/e2e/shots.py
	@$(BIN)/python tests/e2e/moving_picture.py

bench: setup                                  ## measure performance; prints JSON lines
	@$(BIN)/python tests/bench/__main__.py $(BENCH) $(if $(COMPARE),--compare $(COMPARE))

generate: setup                               ## write the files generated from tables and API
	@$(BIN)/python -m tools.generate
	@$(BIN)/python tests/fidelity.py
	@$(BIN)/python -m tools.notices
	@$(NPM) run --silent generate

docs: docs/dist/index.html                    ## build the documentation in docs/dist

build: $(VENV)/.dev web/dist/index.html docs       ## build sdist, wheel and the wheel of the client in dist/
	@rm -rf dist
	@$(BIN)/python -m build --no-isolation
	@$(BIN)/python -m build --no-isolation --wheel --outdir dist client

wheelhouse: build                             ## collect all wheels for an installation without a network
	@rm -rf build/wheelhouse
	@$(BIN)/python -m pip wheel --quiet --require-hashes --no-deps -r requirements.lock --wheel-dir build/wheelhouse
	@cp dist/hornbill-*.whl build/wheelhouse/
	@echo "build/wheelhouse: $$(ls build/wheelhouse | wc -l) wheels for this system and Python version"

sbom: $(VENV)/.runtime                        ## write the bill of materials (CycloneDX) to build/sbom.cdx.json
	@mkdir -p build
	@$(BIN)/python -m tools.sbom > build/sbom.cdx.json

docker:                                       ## build the image `hornbill` with Docker or Podman
	@engine=$$(command -v docker || command -v podman) || { echo "neither docker nor podman is installed" >&2; exit 1; }; \
	$$engine build --build-arg VERSION=$$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml) \
		--build-arg REVISION=$$(git rev-parse HEAD 2>/dev/null) -t hornbill .

release: build                                ## check and build a release; prints the remaining commands
	@$(BIN)/python -m tools.release

# Development first: one tool needs an older Typer, and the tested version must be the one that runs.
lock: $(VENV)/.dev                            ## update the lock files
	@$(BIN)/python -m pip install --quiet uv
	@$(BIN)/uv pip compile -q --universal --generate-hashes --python-version 3.11 --extra fast --extra tune --group dev --no-header pyproject.toml -o requirements-dev.lock
	@$(BIN)/uv pip compile -q --universal --generate-hashes --python-version 3.11 --extra fast --extra tune --no-header -c requirements-dev.lock pyproject.toml -o requirements.lock
	@$(BIN)/uv pip compile -q --universal --generate-hashes --python-version 3.11 --group pyproject.toml:docs --no-header -c requirements-dev.lock -o requirements-docs.lock

clean:                                        ## remove everything built and installed
	rm -rf $(VENV) web/node_modules web/dist docs/dist dist build
