"""Whose samples are taken, and what becomes of them."""

from __future__ import annotations

from array import array
from typing import Any

import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.bags.message_batches import Connection, Findings
from hma_gripper_sim.recordings.assembly import assemble
from hma_gripper_sim.recordings.gathering import Samples
from hma_gripper_sim.recordings.signal_map import SignalMap

START, SECOND = 1_700_000_000 * 10**9, 10**9  # ns


def signal(name: str = "actuator_force", **entry: Any) -> Any:
    fields = {"topic": "/force", "field": "data", **entry}
    return SignalMap.from_mapping({name: fields}).signals[0]


def said(values: list[float], seconds: list[float] | None = None, **samples: Any) -> Samples:
    times = seconds if seconds is not None else [0.1 * i for i in range(len(values))]
    stamps = array("q", [START + round(second * SECOND) for second in times])
    logged = [np.array(samples.pop("logged", range(len(values))), dtype=np.int64)]
    return Samples(stamps, array("d", values), logged, is_stamped=True, **samples)


def connection(publisher: str = "1", file: str = "a.mcap", publishers: int = 1) -> Connection:
    return Connection(file, "/force", "std_msgs/msg/Float64", publisher, publishers)


def findings() -> Findings:
    return Findings(topics={"/force", "/other"})


def test_unit_scale_tare_and_offset_apply_in_this_order() -> None:
    """A load cell in grams-force that counts upwards, with 3 gf on it while it is at rest."""
    entry = signal(unit="gram_force", scale=-1, tare="0.2 s", offset="-0.0444 N")
    part = (connection(), said([2.0, 4.0, 3.0, 13.0]))
    stamps, value = assemble(entry, [part], findings())
    expected = -9.80665e-3 * np.array([-1.0, 1.0, 0.0, 10.0]) - 0.0444
    np.testing.assert_allclose(value, expected, rtol=1e-12)
    assert (stamps[0], stamps[-1]) == (START, START + 3 * SECOND // 10)


def test_delay_is_taken_from_the_stamps() -> None:
    """Of a wrench whose clock is half a second ahead."""
    entry = signal(delay="500 ms", time="header")
    stamps, value = assemble(entry, [(connection(), said([1.0, 2.0]))], findings())
    assert stamps.tolist() == [START - SECOND // 2, START - SECOND // 2 + SECOND // 10]
    assert value.tolist() == [1.0, 2.0]
    with pytest.raises(InputError, match=r"actuator_force.delay: must be at most 3600 s"):
        signal(delay="2 h")


def test_encoder_that_wavers_between_two_counts_is_no_two_publishers() -> None:
    """At rest, by 20 µm; a joint that is told as 5 mm and 0 by turns is."""
    wavering = [2e-5 * (i % 2) for i in range(100)]
    entry = signal("travel", joint="slide")
    assert assemble(entry, [(connection(), said(wavering))], findings()) is not None
    with pytest.raises(InputError, match="its value jumps to and fro 98 times in 100 samples"):
        assemble(entry, [(connection(), said([250.0 * v for v in wavering]))], findings())


def test_two_publishers_are_refused_unless_the_map_says_which() -> None:
    def parts() -> Any:
        return [
            (connection("/arm"), said([1.0, 2.0])),
            (connection("/gripper"), said([10.0, 20.0], [0.05, 0.15])),
            (connection("/silent"), said([])),
        ]

    with pytest.raises(InputError, match=r"2 publishers \('/arm', '/gripper'\); 'publisher: NAME'"):
        assemble(signal(), parts(), findings())
    assert assemble(signal(publisher="/arm"), parts(), findings())[1].tolist() == [1.0, 2.0]
    stamps, value = assemble(signal(publisher="any"), parts(), findings())
    assert value.tolist() == [1.0, 10.0, 2.0, 20.0]
    assert (np.diff(stamps) == SECOND // 20).all()
    with pytest.raises(InputError, match=r"no publisher '/x' \(there are: /arm, /gripper\)"):
        assemble(signal(publisher="/x"), parts(), findings())


def test_files_of_a_split_log_follow_one_another() -> None:
    parts = [
        (connection("1", "log_0.mcap"), said([1.0, 2.0])),
        (connection("5", "log_1.mcap"), said([3.0], [0.2], logged=[2])),
    ]
    assert assemble(signal(), parts, findings())[1].tolist() == [1.0, 2.0, 3.0]


def test_publishers_that_the_recorder_merged_are_refused_unless_told_apart() -> None:
    """rosbag2 puts all publishers of a topic together; joints and frames tell them apart."""
    part = (connection(publishers=2), said([1.0]))
    with pytest.raises(InputError, match="2 publishers, which the recorder did not tell apart"):
        assemble(signal(), [part], findings())
    assert assemble(signal(publisher="any"), [part], findings()) is not None
    part = (connection(publishers=2), said([1.0]))
    assert assemble(signal(joint="wrist"), [part], findings()) is not None


def test_samples_that_are_not_finite_are_left_out_and_counted() -> None:
    found = findings()
    part = (connection(), said([1.0, np.nan, np.inf, 4.0]))
    stamps, value = assemble(signal(), [part], found)
    assert value.tolist() == [1.0, 4.0]
    assert ((stamps - START) * 1e-9).tolist() == pytest.approx([0.0, 0.3])
    assert found.notes == [
        "/force: actuator_force: 2 of 4 samples left out because they are not finite, "
        "the first (nan) at stamp 1700000000.100000 s"
    ]
    with pytest.raises(InputError, match="none of its 2 samples is finite"):
        assemble(signal(), [(connection(), said([np.nan, -np.inf]))], findings())


def test_samples_that_overflow_are_not_finite() -> None:
    with pytest.raises(InputError, match="finite"):
        assemble(signal(scale=1e300), [(connection(), said([1e300]))], findings())


def test_logged_times_are_sorted_but_stamps_of_headers_are_not() -> None:
    def part(*logged: int) -> Any:
        return connection(), said([1.0, 3.0, 2.0], [0.0, 0.2, 0.1], logged=logged)

    found = findings()
    assert assemble(signal(), [part(0, 2, 1)], found)[1].tolist() == [1.0, 2.0, 3.0]
    assert found.notes == [
        "/force: its messages lie in another order in the log than they were logged: taken as "
        "logged"
    ]
    found = findings()
    assert assemble(signal(), [part(0, 1, 2)], found)[1].tolist() == [1.0, 3.0]
    assert "1 of 3 samples left out because their time runs back" in found.notes[0]


def test_optional_signal_may_be_absent() -> None:
    found = findings()
    assert assemble(signal(optional=True), [], found) is None
    assert found.notes == ["/force: actuator_force is absent: no messages on this topic"]
    with pytest.raises(InputError, match="actuator_force: no messages on this topic") as caught:
        assemble(signal(), [], findings())
    assert caught.value.field == "/force"


def test_missing_topic_is_named_with_those_there_are() -> None:
    reason = r"no such topic in this log \(there are: /force, /other\)"
    with pytest.raises(InputError, match=reason):
        assemble(signal(topic="/farce"), [], findings())


def test_reason_why_messages_cannot_be_read_is_given() -> None:
    part = (connection(), InputError("unknown type 'a/msg/B': the log does not define it"))
    with pytest.raises(InputError, match="actuator_force: unknown type 'a/msg/B'"):
        assemble(signal(), [part], findings())
