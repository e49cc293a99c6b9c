# Every target sets up .venv by itself, once, and again when the files below change.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
DOCS_READY := $(VENV)/.docs-ready
CORPUS ?= ../shared/corpus
BASELINE ?= build/corpus-baseline.jsonl

.DEFAULT_GOAL := help
.PHONY: help demo test fuzz check generate docs samples screenshots bench bench-link accuracy injection corpus-frames corpus-diff clean

help:  ## list these targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 14

$(READY): pyproject.toml constraints-dev.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints-dev.txt -e '.[dev]'
	@touch $@

$(DOCS_READY): $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints-dev.txt -e '.[docs]'
	@touch $@

demo: $(READY)  ## audit the samples: exit 1 (findings) is what they are for, 2 and 3 are failures
	$(BIN)/mavframecheck check samples || [ $$? -eq 1 ]

test: $(READY)  ## run every test
	$(BIN)/python -m pytest

fuzz: $(READY)  ## the property tests with new examples (`make test` takes the same ones every time)
	$(BIN)/python -m pytest -q -m hypothesis --hypothesis-profile fresh

check: $(READY)  ## lint, format, types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

generate: $(READY)  ## write again what is generated into the package
	$(BIN)/python -m mavframecheck.wire.generate
	$(BIN)/python -m mavframecheck.semantics.acceptance
	$(BIN)/python -m mavframecheck.engine.pack
	$(BIN)/python -m mavframecheck.report.schema
	$(BIN)/python -m tools.plot_fit
	$(BIN)/python -m tools.pages.rules
	$(BIN)/python -m tools.pages.shown

docs: $(DOCS_READY)  ## the documentation site into build/site; a broken link fails
	$(BIN)/python -m tools.pages.site
	$(BIN)/zensical build --strict --clean

samples: $(READY)  ## write samples/ again
	$(BIN)/python -m samples.make

screenshots: $(READY)  ## the pictures of the HTML report in docs/images (needs chromium)
	$(BIN)/python -m tools.screenshots

bench: $(READY)  ## speed and memory against the required figures (about four minutes)
	$(BIN)/python -m benchmarks.bench --corpus $(CORPUS)

bench-link: $(READY)  ## a live link: latency, load, memory over two hours of flight (about three minutes)
	$(BIN)/python -m benchmarks.link --corpus $(CORPUS)

accuracy: $(READY)  ## labelled recordings: found, missed, false alarms; real ones: confirmed or not
	$(BIN)/python -m benchmarks.accuracy --corpus $(CORPUS)
	$(BIN)/python -m benchmarks.adjudicated --corpus $(CORPUS)

injection: $(READY)  ## mistakes written into clean recordings: which are found (ten minutes; ONLY=motion: six)
	$(BIN)/python -m benchmarks.injection --corpus $(CORPUS) $(if $(ONLY),--only $(ONLY))

corpus-frames: $(READY)  ## every frame of every recording against pymavlink (about three minutes)
	MAVFRAMECHECK_FULL_CORPUS=1 $(BIN)/python -m pytest -q -s tests/wire/test_corpus.py

corpus-diff: $(READY)  ## findings added and removed since `make corpus-diff SAVE=--save`
	$(BIN)/python -m benchmarks.corpus_diff --corpus $(CORPUS) --baseline $(BASELINE) $(SAVE)

clean:  ## remove everything that make made
	rm -rf $(VENV) build dist .cache .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
