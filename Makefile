# AccelScope: `make demo` and `make test` do all the set-up on a Debian machine that has
# Python 3.11 or 3.13, git and make. Nothing is left outside the checkout but caches.
#
# Variables: PYTHON, the interpreter for .venv (otherwise 3.13 if there is one that runs, else
# 3.11); PYTEST, options for pytest, such as PYTEST="-k grid -x"; BENCH, options for the benchmark,
# such as BENCH=--quick; ACCELSCOPE_WITHOUT_WINDOW=1 on a machine that can have no window, which
# fails otherwise where $CI is set.
.DEFAULT_GOAL := help
# What a target needs is made in the order in which it is named.
.NOTPARALLEL:

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/installed

export PIP_DISABLE_PIP_VERSION_CHECK := 1

# One line to say what comes next, easy to find between the output of the tools.
say = @printf '\n==> %s\n' "$(1)"

.PHONY: help
help: ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## /\1|/p' $(MAKEFILE_LIST) | \
		while IFS='|' read -r target text; do printf 'make %-18s %s\n' "$$target" "$$text"; done

.PHONY: venv
venv: $(INSTALLED) ## Make .venv with everything the other targets need

$(INSTALLED): pyproject.toml
	$(call say,Setting up $(VENV))
	@.ci/venv.sh $(VENV) "3.13 3.11" --editable ".[dev,blender]"
	@touch $@

.PHONY: system-libraries
system-libraries:
	@.ci/system_libraries.sh

.PHONY: demo
demo: venv system-libraries ## Evaluate the sample scenes with all structures into build/demo
	$(call say,Evaluating the sample scenes)
	@$(BIN)/python -m accelscope.addon.command.demo --output build/demo

.PHONY: test
test: lint types pytest ## Check format, lint and types, and run the tests (some fifty minutes)

# What these choose of the tests: `make test` leaves out those that try every combination.
CHOSEN := and not exhaustive
.PHONY: test-all
test-all: CHOSEN :=
test-all: lint types pytest test-bounds ## The same with the exhaustive tests, before an issue is called done

# Numba looks at every index then; what is compiled so is kept apart (core/kernels.py).
.PHONY: test-bounds
test-bounds: export NUMBA_BOUNDSCHECK := 1
test-bounds: venv system-libraries ## Run every kernel with its indices checked
	$(call say,Tests with indices checked)
	@$(BIN)/pytest -n 2 --dist worksteal -m "not window and not exhaustive" tests/core
	@$(BIN)/pytest -n 2 --dist worksteal tests/core/test_hostile_scenes.py -k pictures

.PHONY: lint
lint: venv
	$(call say,Format)
	@$(BIN)/ruff format --check .
	$(call say,Lint)
	@$(BIN)/ruff check .

# mypy has to meet the packages as accelscope.*, whatever the checkout is called. Links to the
# packages, not to the checkout, so that it does not find build/types in there once more. TYPED are
# the folders of tests whose calls are looked at; scripts for Blender's window import by name.
TYPED := addon bench cli core repro sample_scenes
.PHONY: types
types: venv
	$(call say,Types)
	@rm -rf build/types && mkdir -p build/types/accelscope
	@for part in *.py addon core operators panels sample_scenes; do \
		ln -s "../../../$$part" "build/types/accelscope/$$part"; done
	@$(BIN)/mypy
	@$(BIN)/mypy --explicit-package-bases tests/*.py $(TYPED:%=tests/%)

# What watches the clock of a window has the machine to itself; the rest runs in two processes.
# pytest's exit code 5: none of the tests chosen by PYTEST is among these. Without PYTEST some are.
.PHONY: pytest
pytest: NONE := $(if $(PYTEST),5,0)
pytest: venv system-libraries
	$(call say,Tests)
	@$(BIN)/pytest -m "window $(CHOSEN)" $(PYTEST); code=$$?; \
		[ $$code -eq 0 ] || [ $$code -eq $(NONE) ]
	@$(BIN)/pytest -n 2 --dist worksteal -m "not window $(CHOSEN)" $(PYTEST); code=$$?; \
		[ $$code -eq 0 ] || [ $$code -eq $(NONE) ]

.PHONY: test-window
test-window: venv system-libraries ## Click through the extension in a real Blender window (Xvfb)
	$(call say,Tests in a Blender window)
	@$(BIN)/pytest -m window $(PYTEST)

.PHONY: test-blender-all
test-blender-all: system-libraries ## Run the Blender tests against Blender 4.5, 5.0, 5.1 and 5.2
	@.ci/test_blender_all.sh

.PHONY: bench
bench: venv system-libraries ## Measure speed, and cost of trees, beside others
	@.ci/system_libraries.sh open3d || echo "The benchmark goes on without open3d."
	$(call say,Benchmark)
	@$(BIN)/python tests/bench/bench.py $(BENCH)

.PHONY: extension
extension: venv system-libraries ## Build the zips for Blender into build/extension
	$(call say,Building the extension)
	@$(BIN)/python .ci/build_extension.py

.PHONY: lessons
lessons: venv ## Write LESSONS.md: every slide, its lessons, and what their tests assert
	@$(BIN)/python .ci/write_lessons.py

.PHONY: format
format: venv ## Format the sources and repair what ruff can repair
	@$(BIN)/ruff check --fix --quiet . || true
	@$(BIN)/ruff format .

.PHONY: clean
clean: ## Remove everything that make has made in the checkout, .venv too
	rm -rf build dist *.egg-info .venv .venv-* .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
