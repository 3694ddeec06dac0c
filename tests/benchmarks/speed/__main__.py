"""Print how fast filters and EM rounds are beside other packages, and whether that is within the limits.

python -m tests.benchmarks.speed           two tables; status 1 if a limit is missed
python -m tests.benchmarks.speed --json    the same numbers for a program
"""

import json
import os
import sys
from dataclasses import asdict

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ[name] = "1"  # before numpy is imported, or it is too late

from tests.benchmarks.speed.measure import FILTER_LIMITS, ROUND_LIMITS, STATES, em_rounds, filters  # noqa: E402


def main() -> int:
    by_states = [filters(K) for K in STATES]
    rounds = em_rounds()
    if "--json" in sys.argv:
        tables = {
            "filters": {K: _plain(table) for K, table in zip(STATES, by_states, strict=True)},
            "rounds": _plain(rounds),
        }
        print(json.dumps(tables))
        return 0

    kept = True
    print("A filter's frame, times as fast as filterpy's IMM (and microseconds)")
    print(f"{'switching states':22}" + "".join(f"{K:>16}" for K in STATES))
    for name in by_states[0]:
        cells = []
        for k, table in enumerate(by_states):
            fast = 1.0 / table[name].ratio
            late = name in FILTER_LIMITS and fast < FILTER_LIMITS[name][k]
            kept &= not late
            cells.append(f"{fast:8.1f}{'!' if late else ' '}({table[name].microseconds:5.0f})")
        limits = "   at least " + ", ".join(map(str, FILTER_LIMITS[name])) if name in FILTER_LIMITS else ""
        print(f"{name:22}" + "".join(f"{cell:>16}" for cell in cells) + limits)

    print("\nAn EM round, times a one-state Kalman filter and smoother (and microseconds a frame)")
    for name, timing in rounds.items():
        late = name in ROUND_LIMITS and timing.ratio > ROUND_LIMITS[name]
        kept &= not late
        limit = f"   at most {ROUND_LIMITS[name]}" if name in ROUND_LIMITS else ""
        print(f"{name:22}{timing.ratio:8.1f}{'!' if late else ' '}({timing.microseconds:5.0f}){limit}")
    return 0 if kept else 1


def _plain(table):
    return {name: asdict(timing) for name, timing in table.items()}


if __name__ == "__main__":
    sys.exit(main())
