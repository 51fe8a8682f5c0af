# Two commands matter: `make run` and `make test`. Everything they need, they install into .venv.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SERVICE := $(VENV)/.service
STAMP := $(VENV)/.installed

.PHONY: help run test warm lint messages screenshots lock bench campaign system sbom audit clean

help:            ## list the commands
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

$(SERVICE): requirements.lock pyproject.toml
	@PYTHON=$(PYTHON) scripts/install requirements.lock
	@touch $@

$(STAMP): requirements-dev.lock pyproject.toml
	@PYTHON=$(PYTHON) scripts/install requirements-dev.lock
	@touch $@ $(SERVICE)

run: $(SERVICE)  ## set up, serve on 127.0.0.1:8000, design the paper's rod as a first run
	@exec $(BIN)/crankwright serve --demo

system:
	@bash scripts/system-packages

# Packages of the system are downloaded while kernels are compiled. Each worker of pytest takes its share of the tests
# in order, so that those of the service, which often wait, run beside those of the solvers; one worker more than there
# are processors keeps these busy. Bytecode is kept: the tests start Python some two hundred times.
test warm: export PYTHONDONTWRITEBYTECODE :=
test:            ## set up and pass every test
	@$(MAKE) --no-print-directory --jobs=2 warm system
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses $$(($$(getconf _NPROCESSORS_ONLN) + 1)) --maxprocesses 4 --dist worksteal

warm: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/crankwright warm-up

lint: $(STAMP)   ## style only
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

bench: $(STAMP)  ## measure against the peers, write docs/benchmarks.md and docs/accuracy.md
	$(BIN)/python -m bench
	$(BIN)/python -m bench.work_precision

campaign: $(STAMP)  ## hold every promise against thousands of random scenes (hours; interrupted, it goes on where it stopped), write docs/campaign.md; hunt for hard cases, write docs/hard-cases.md
	CRANKWRIGHT_CAMPAIGN=1 $(BIN)/python -m pytest -s tests/app/test_stops.py tests/reliability
	$(BIN)/python -m tests.reliability.attacks 100000 .campaign/attacks
	$(BIN)/python -m tests.reliability.document 50000 .campaign/document
	CRANKWRIGHT_CAMPAIGN=1 $(BIN)/python -m pytest -s tests/app/store tests/app/edge tests/app/access \
		tests/app/test_fault_handling.py tests/app/test_fairness.py tests/app/test_limits.py tests/app/test_time_limits.py
	$(BIN)/python -m tests.reliability.floods 60
	$(BIN)/python -m tests.reliability.kills 1000 .campaign/kills
	$(BIN)/python -m bench.campaign
	$(BIN)/python -m tests.hard_cases.hunt all 3600
	$(BIN)/python -m tests.hard_cases.page

sbom: $(STAMP)   ## what the service is made of, with hashes and licences: sbom.json, licences.txt
	$(BIN)/python -m scripts.sbom > sbom.json
	$(BIN)/python -m scripts.sbom --licences > licences.txt

audit: $(STAMP)  ## known faults of what is locked, or that they could not be looked up (needs pip-audit)
	$(BIN)/python -m scripts.audit

LOCKING := uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --quiet --no-header

messages: $(STAMP)  ## gather what the pages say, bring the catalogues of its translations up to date, print what lacks one
	$(BIN)/python -m scripts.messages

screenshots: $(STAMP) system  ## pictures of the running service, into docs/screenshots
	$(BIN)/python -m scripts.screenshots

lock:            ## resolve the dependencies anew, for the service and for its development (needs uv)
	$(LOCKING) --all-extras pyproject.toml -o requirements-dev.lock
	$(LOCKING) --constraint requirements-dev.lock pyproject.toml -o requirements.lock
	echo uv | $(LOCKING) - -o requirements-uv.lock

clean:           ## remove what make made
	rm -rf $(VENV) build dist .campaign *.egg-info
