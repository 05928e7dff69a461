# Every target sets itself up: it needs python3 (3.11 or newer) and make, nothing else.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
UV ?= $(BIN)/uv

.PHONY: fuzz kill demo model live test test-fast lint format types contracts check bench lock lowest clean

# make demo REAL=path [LAYOUT=name|file.toml] [CAMERA=preset [FAR=metres]]: skeletons on a folder of recorded depth too.
# The recipe's shell takes the words from its environment, so that a path may hold spaces.
export REAL LAYOUT CAMERA FAR
demo: $(VENV)/.installed
	$(BIN)/undergrowth demo --out out/demo $(if $(REAL),--real "$$REAL") $(if $(LAYOUT),--layout "$$LAYOUT") \
		$(if $(CAMERA),--camera "$$CAMERA") $(if $(FAR),--far "$$FAR")

# make model [RECORDED="corpora of recorded frames to score it on too"]: the default forest and its card, in out/model.
# Stopped and started again, it continues where it was.
MODEL := out/model
CPUS := $(shell nproc 2>/dev/null || echo 2)
model: $(VENV)/.installed
	mkdir -p $(MODEL)
	seed=2026; for camera in kinect_v2 kinect_v1_qvga realsense_d435; do \
		$(BIN)/undergrowth generate $(MODEL)/$$camera --config examples/model.toml --scene.camera $$camera \
			--seed $$seed --workers $(CPUS) || exit 1; seed=$$((seed + 1)); \
	done
	[ -e $(MODEL)/forest.safetensors ] || $(BIN)/undergrowth train oarf $(MODEL)/kinect_v2 $(MODEL)/kinect_v1_qvga \
		$(MODEL)/realsense_d435 --max-samples 12000000 --n-occluder-pixels 500 --n-voting-pixels 1500 \
		--growth.max-depth 25 --growth.min-samples-leaf 40 --threads $(CPUS) --out $(MODEL)/forest.safetensors
	$(BIN)/undergrowth card $(MODEL)/forest.safetensors $(MODEL)/kinect_v2 $(MODEL)/kinect_v1_qvga \
		$(MODEL)/realsense_d435 $(RECORDED) --threads $(CPUS)

# make live [WALKS=forest] [SKELETON=forest] [ORIENTATION=net.onnx]: a generated clip through finder, tracker, planner
# and the modules whose models are given; what they tell is in out/live/people.mcap, and a page shows it until Ctrl-C.
# VIEW=0 ends without the page.
LIVE := out/live
live: $(VENV)/.installed-dev
	$(BIN)/undergrowth generate $(LIVE)/clips --config examples/clips.toml --frames 180 --workers $(CPUS)
	$(BIN)/undergrowth live $(LIVE)/clips --sensor kinect_v2 --record $(LIVE)/people.mcap \
		$(if $(WALKS),--walks "$(WALKS)") $(if $(SKELETON),--skeleton "$(SKELETON)") \
		$(if $(ORIENTATION),--orientation "$(ORIENTATION)")
	$(if $(filter 0,$(VIEW)),,$(BIN)/undergrowth view $(LIVE)/people.mcap)

test: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -n auto --dist worksteal

test-fast: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -n auto --dist worksteal -m "not slow"

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .

format: $(VENV)/.installed-dev
	$(BIN)/ruff format --check .

types: $(VENV)/.installed-dev
	$(BIN)/mypy

contracts: $(VENV)/.installed-dev
	$(BIN)/lint-imports

check: lint format types contracts test

bench: $(VENV)/.installed-dev
	for file in benchmarks/bench_*.py; do echo "== $$file"; $(BIN)/python $$file || exit 1; done

# make fuzz [N=3000]: damages samples of every format and reads them; make kill [N=100]: kills commands and goes on.
# Minutes each, and not a part of CI.
fuzz: $(VENV)/.installed-dev
	$(BIN)/python -m tools.fuzz $(if $(N),-n $(N))

kill: $(VENV)/.installed-dev
	$(BIN)/python -m tools.kill $(if $(N),-n $(N))

# Debian splits ensurepip off python3 into python3-venv; where it is missing and we may, we add it.
$(VENV)/bin/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "undergrowth needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>&1). Try: make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || { [ "$$(id -u)" = 0 ] && apt-get update -q && apt-get install -qy --no-install-recommends python3-venv; } || \
		{ echo "python3 has no ensurepip; as root: apt-get install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: requirements.lock pyproject.toml | $(VENV)/bin/pip
	$(BIN)/pip install -q --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install -q --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

$(VENV)/.installed-dev: requirements-dev.lock pyproject.toml | $(VENV)/bin/pip
	$(BIN)/pip install -q --disable-pip-version-check --require-hashes -r requirements-dev.lock
	$(BIN)/pip install -q --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@ $(VENV)/.installed

# The locks hold versions and hashes for every platform, and no index.
lock: $(VENV)/.installed-dev
	$(UV) pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header -q \
		--group build -o requirements.lock pyproject.toml
	$(UV) pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header -q \
		--group build --group dev --extra gl --extra online --extra viewer -o requirements-dev.lock pyproject.toml

# The lowest versions that pyproject.toml allows, in an environment of their own: are they still enough?
LOWEST := $(VENV)-lowest
LOWEST_TESTS ?= tests/test_import_time.py tests/pipelines/commands/test_import_meshes.py \
	tests/pipelines/importing tests/pipelines/export
lowest: $(VENV)/.installed-dev
	$(UV) venv -q --clear --python $(BIN)/python $(LOWEST)
	$(UV) pip compile -q --resolution lowest-direct --python $(LOWEST) --no-header \
		--group build --extra gl -o $(LOWEST)/requirements.txt pyproject.toml
	$(UV) pip install -q --python $(LOWEST) -r $(LOWEST)/requirements.txt pytest pycocotools webdataset
	$(UV) pip install -q --python $(LOWEST) --no-deps --no-build-isolation -e .
	NUMBA_CACHE_DIR=$(LOWEST)/numba $(LOWEST)/bin/python -m pytest $(LOWEST_TESTS)

clean:
	rm -rf $(VENV) $(LOWEST) out .numba_cache .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
