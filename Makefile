# Everything a fresh machine needs besides Python 3.11 (or newer) and make is installed into .venv.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
MOCAP ?= $(FIGTRACK_DATA)/mocap/trials.csv
RATES := 24 25 30 50 60

# Matrices are small: threads of one multiplication wait for each other longer than they work.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1

# Where containers set it, every process would compile the libraries' thousands of modules anew.
unexport PYTHONDONTWRITEBYTECODE

# uv takes a tenth of pip's time. Where it cannot be had, or reach what only pip is told of, pip installs all; of nine thousand
# modules most are never imported, and Python compiles those that are.
PIP := $(BIN)/pip install --quiet --disable-pip-version-check --no-compile
UV := $(BIN)/uv pip install --quiet --python $(BIN)/python
define install
	$(PIP) "uv>=0.5,<1" && $(UV) --constraint constraints.txt --editable $(1) || $(PIP) --constraint constraints.txt --editable $(1)
	touch $@
endef

.PHONY: demo test check models rivals evaluate robustness rendered gait measure motion gallery trial mutants soak bench clean

demo: $(VENV)/installed
	$(BIN)/figtrack demo --overwrite

# A film followed without a mark leaves all compiled for those who run after it side by side.
COMPILE := $(BIN)/pytest -q tests/tracker/cli/test_find.py -k a_film_alone > /dev/null

test: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy & $(COMPILE); $(BIN)/pytest -n auto && wait $$!

# Whole commands, on spoiled inputs too, in processes and on clusters; what the documentation promises: its commands are run,
# with $FIGTRACK_DATA its claims about real clips; and what the tools under tests/benchmarks are tested by.
check: $(VENV)/installed-dev
	$(BIN)/pytest -n auto -m "(claims or handbook or whole) and not speed"

# The models that ship: only captures whose terms allow it (CMU, Seoul National University).
LEARN := $(BIN)/figtrack learn --trials $(MOCAP) --overwrite --settings dynamics/models

models: $(VENV)/installed
	for fps in $(RATES); do \
	  $(LEARN)/learn.toml --states 1 --noise 0 --fps $$fps --out dynamics/models/walk-run@$$fps.npz && \
	  $(LEARN)/pooled.toml --states 1 --noise 0 --fps $$fps --out dynamics/models/walk-run-1@$$fps.npz && \
	  $(LEARN)/gait.toml --fps $$fps --out dynamics/models/gait@$$fps.npz && \
	  $(LEARN)/gait-started.toml --fps $$fps --out dynamics/models/gait-started@$$fps.npz && \
	  $(LEARN)/learn.toml --figure walker-arms --states 1 --noise 0 --fps $$fps \
	    --out dynamics/models/walker-arms-walk-run@$$fps.npz && \
	  $(LEARN)/learn.toml --figure walker-arms --fps $$fps \
	    --out dynamics/models/walker-arms-gait@$$fps.npz || exit 1; \
	done
	$(LEARN)/learn.toml --inference stride --out dynamics/models/stride@30.npz
	$(BIN)/python -m tests.benchmarks.gait.cycles $(MOCAP) tracker/outline/cycles.npz --licence CMU --licence "Seoul National"
	$(BIN)/python -m tests.benchmarks.gait.learn $(MOCAP) tracker/gait/moments.npz --licence CMU --licence "Seoul National"
	$(BIN)/python -m tests.benchmarks.gait.norms $(MOCAP) tracker/gait/norms.npz --licence CMU --licence "Seoul National"

# The rival that needs opencv-contrib has it in an environment of its own, where it cannot harm ours.
rivals: .venv-rivals/installed

# The tables of docs/results.md, from the clips in $FIGTRACK_DATA.
evaluate: $(VENV)/installed-dev rivals
	$(BIN)/python -m tests.benchmarks.evaluation $(FIGTRACK_DATA) docs/results.md

# The tables of docs/robustness.md, from the same clips, the hard ones and films painted as below.
robustness: $(VENV)/installed-dev
	$(BIN)/python -m tests.benchmarks.evaluation.robustness $(FIGTRACK_DATA) docs/robustness.md

# The tables of docs/rendered.md, from films that are painted with the motion of the open captures.
rendered: $(VENV)/installed-dev
	$(BIN)/python -m tests.benchmarks.rendered $(MOCAP) docs/rendered.md

# The tables of docs/gait.md, from such films and the open clips; what was followed is kept for the next time.
gait: $(VENV)/installed-dev
	$(BIN)/python -m tests.benchmarks.gait $(FIGTRACK_DATA) docs/gait.md --tracks gait-tracks

# The tables of docs/measure.md, from the same clips.
measure: $(VENV)/installed-dev
	$(BIN)/python -m tests.benchmarks.evaluation.points $(FIGTRACK_DATA)/video docs/measure.md

# The tables of docs/motion.md, from the captures and splices in $FIGTRACK_DATA.
motion: $(VENV)/installed-dev
	$(BIN)/python -m tests.benchmarks.motion $(FIGTRACK_DATA) docs/motion.md

# The pictures of docs/gallery.md, from rendered walks and the models that ship; needs Chromium.
gallery: $(VENV)/installed-dev
	$(BIN)/python -m tests.benchmarks.gallery docs/gallery

# A new user's first minutes in a clone of what is committed, in a real browser: how long they take.
trial: $(VENV)/installed-dev
	$(BIN)/python -m tests.benchmarks.trial

# Formulas broken one at a time, and whether the tests notice: tests/benchmarks/mutations.toml.
mutants: $(VENV)/installed-dev
	$(BIN)/python -m tests.benchmarks.mutations

# Random commands on random films, some of them killed, for an hour: whether every one ends as it is meant to.
soak: $(VENV)/installed-dev
	$(BIN)/python -m tests.benchmarks.soak

# The tables of docs/speed.md: filters, learning, tracking and the command beside others.
bench: $(VENV)/installed-bench
	$(BIN)/pytest -m speed
	$(BIN)/python -m tests.benchmarks.speed $(FIGTRACK_DATA)/video/desert_walk_rl.mp4 docs/speed.md

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: $(VENV)/bin/python pyproject.toml constraints.txt
	$(call install,.)

$(VENV)/installed-dev: $(VENV)/bin/python pyproject.toml constraints.txt
	$(call install,".[dev]")

$(VENV)/installed-bench: $(VENV)/bin/python pyproject.toml constraints.txt
	$(call install,".[bench]")

.venv-rivals/installed:
	$(PYTHON) -m venv .venv-rivals
	.venv-rivals/bin/pip install --quiet --disable-pip-version-check "opencv-contrib-python-headless>=4.9,<5" && \
	  touch $@ || rm -rf .venv-rivals  # plain OpenCV's MIL then stands in

clean:
	rm -rf $(VENV) .venv-rivals dist figtrack-demo
