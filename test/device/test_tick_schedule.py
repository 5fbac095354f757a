"""When ticks are due and how they are stamped; all times in milliseconds, in nanoseconds."""

from __future__ import annotations

import pytest

from hma_gripper_sim.device.tick_schedule import MAX_SIMULATED_LAG_NS, Timeline

MS = 1_000_000
START = 5_000 * MS


def started(factor=1.0, period=10 * MS):
    timeline = Timeline(period, factor)
    timeline.start(START)
    return timeline


def run(timeline, ticks, now, *, moved=True, takes=0):
    """Make ticks when they are due, each taking some time; return the clock's time after them."""
    for _ in range(ticks):
        now += max(0, timeline.until_due(now)) + takes
        timeline.advance(now, moved=moved)
    return now


@pytest.mark.parametrize("factor", [1.0, 4.0, 0.5])
def test_ticks_are_due_one_period_apart_divided_by_the_factor(factor):
    timeline = started(factor)
    now = run(timeline, 101, START)
    assert now == START + round(100 * 10 * MS / factor)
    assert timeline.overruns == 0


@pytest.mark.parametrize("factor", [4.0, 0.5, 0.0])
def test_stamps_advance_in_simulated_time_at_any_factor(factor):
    timeline = started(factor)
    run(timeline, 101, START)
    assert timeline.stamp == START + 100 * 10 * MS


def test_at_a_factor_of_one_stamps_are_the_clock_when_due():
    timeline = started()
    run(timeline, 1, START, takes=2 * MS)
    assert timeline.stamp == START
    run(timeline, 100, START + 2 * MS, takes=2 * MS)
    assert timeline.stamp == START + 100 * 10 * MS


def test_as_fast_as_possible_every_tick_is_due_at_once():
    timeline = started(0.0)
    now = run(timeline, 1000, START, takes=1 * MS)
    assert now == START + 1000 * MS
    assert timeline.until_due(now) <= 0
    assert timeline.overruns == 0


def test_a_small_lag_is_made_up():
    timeline = started()
    now = run(timeline, 1, START) + 95 * MS
    ticks = 0
    while timeline.until_due(now) <= 0:
        timeline.advance(now, moved=True)
        ticks += 1
    assert ticks == 9
    assert timeline.stamp == START + 90 * MS
    assert timeline.overruns == 0


def test_a_large_lag_is_given_up_and_counted():
    timeline = started()
    now = run(timeline, 1, START) + 500 * MS
    timeline.advance(now, moved=True)
    assert timeline.overruns == 1
    assert timeline.stamp == now  # as the clock, ahead of the simulated time
    assert timeline.until_due(now) == 10 * MS


def test_a_large_lag_leaves_no_jump_in_the_stamps_at_other_factors():
    timeline = started(2.0)
    run(timeline, 1, START)
    timeline.advance(START + 500 * MS, moved=True)
    assert timeline.overruns == 1
    assert timeline.stamp == START + 10 * MS


@pytest.mark.parametrize("step", [125, 1_000, 9_000])
def test_on_a_simulated_clock_all_ticks_that_have_come_due_are_made(step):
    timeline = started()
    timeline.max_lag = MAX_SIMULATED_LAG_NS
    ticks = 0
    for now in range(START, START + 20 * step * MS, step * MS):
        while timeline.until_due(now) <= 0:
            timeline.advance(now, moved=True)
            ticks += 1
            assert timeline.accounted(now) <= now
    assert ticks == 19 * step // 10 + 1
    assert timeline.stamp == START + 10 * (ticks - 1) * MS
    assert timeline.overruns == 0


def test_a_simulated_clock_that_jumps_far_starts_the_timeline_anew():
    timeline = started()
    timeline.max_lag = MAX_SIMULATED_LAG_NS
    now = run(timeline, 1, START) + 3_600_000 * MS
    timeline.advance(now, moved=True)
    assert timeline.overruns == 1
    assert timeline.stamp == now
    assert timeline.until_due(now) == 10 * MS


def test_while_ticks_are_made_up_the_present_is_that_of_the_state():
    timeline = started()
    timeline.max_lag = MAX_SIMULATED_LAG_NS
    run(timeline, 1, START)
    now = START + 2_000 * MS
    timeline.advance(now, moved=True)
    assert timeline.present(now) == timeline.stamp == START + 10 * MS


@pytest.mark.parametrize("factor", [1.0, 4.0, 0.0])
def test_while_time_stands_still_so_do_the_stamps_at_the_nominal_rate(factor):
    timeline = started(factor)
    now = run(timeline, 10, START)
    stamp = timeline.stamp
    timeline.advance(now, moved=False)
    after = run(timeline, 100, now, moved=False)
    assert after - now == pytest.approx(100 * 10 * MS, abs=20 * MS)
    assert timeline.stamp == stamp


def test_after_a_pause_stamps_follow_the_clock_again_at_a_factor_of_one_only():
    stamps = {}
    for factor in (1.0, 4.0):
        timeline = started(factor)
        now = run(timeline, 10, START)
        now = run(timeline, 100, now, moved=False)
        stamps[factor] = timeline.stamp
        run(timeline, 1, now)
        stamps[factor] = timeline.stamp - stamps[factor]
    assert stamps[1.0] == 101 * 10 * MS
    assert stamps[4.0] == 10 * MS


def test_stamps_do_not_run_back_when_the_factor_becomes_one():
    timeline = started(10.0)
    now = run(timeline, 1000, START)
    ahead = timeline.stamp
    assert ahead > now
    timeline.set_rate(10 * MS, 1.0)
    run(timeline, 3, now)
    assert timeline.stamp == ahead + 3 * 10 * MS


def test_a_clock_that_is_set_back_does_not_stop_the_ticks():
    timeline = started()
    now = run(timeline, 10, START) - 3_000 * MS
    assert timeline.until_due(now) <= 0
    run(timeline, 11, now)
    assert timeline.stamp == now + 10 * 10 * MS
    assert timeline.until_due(now + 100 * MS) <= 10 * MS


def test_a_change_of_rate_holds_from_the_next_tick_on():
    timeline = started()
    now = run(timeline, 10, START)
    timeline.set_rate(2 * MS, 1.0)
    now = run(timeline, 1, now)
    assert run(timeline, 10, now) - now == 10 * 2 * MS
