"""Where the time of a run went: told by stage, and counted once."""

from itertools import islice

from tracker.clip import clock as clock_module


def test_time_spent_is_told_by_stage_and_nested_time_counts_once(monkeypatch):
    now = [0.0]

    def spend(seconds, items):
        for item in items:
            now[0] += seconds
            yield item

    monkeypatch.setattr(clock_module.time, "perf_counter", lambda: now[0])
    clock = clock_module.Clock()
    inner = clock.timed("read", spend(1.0, range(4)))
    assert list(islice(inner, 1)) == [0]
    assert list(clock.timed("track", spend(10.0, inner))) == [1, 2, 3]
    assert clock.per_frame(4) == {"read": 1.0, "track": 7.5}
