# AccelScope: `make demo` and `make test` do all the set-up on a Debian machine that has
# Python 3.11 or 3.13, git and make. Nothing is left outside the checkout but caches.
SHELL := /bin/sh
.DEFAULT_GOAL := help

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/installed

export PIP_DISABLE_PIP_VERSION_CHECK := 1

# One line to say what comes next, visible between the output of the tools.
say = @printf '\n==> %s\n' "$(1)"

.PHONY: help
help: ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' $(MAKEFILE_LIST) | column -t -s '|'

.PHONY: venv
venv: $(INSTALLED) ## Make .venv with everything the other targets need

$(INSTALLED): pyproject.toml
	$(call say,Setting up $(VENV))
	@.ci/venv.sh $(VENV) "3.13 3.11" --editable ".[dev,blender]"
	@touch $@
