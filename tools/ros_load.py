"""Load and soak test of the node: what one subscriber in another process gets, and what it costs.

Starts sim_node on a ROS domain of its own, moves the gripper on and off the box all the time, and
records every message of joint_states.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import struct
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click
import numpy as np

from hma_gripper_sim.device.topics import CMD_VELOCITY, JOINT_STATES
from hma_gripper_sim.ros.node_process import NodeProcess, private_ros_domain

VELOCITY = 0.01  # m/s
HALF_CYCLE = 1.2  # s; 12 mm down, onto the object, and up again
COMMAND_PERIOD = 0.05  # s
LARGEST_RATE_ERROR = 1e-3
STALL = 0.1  # s; the lag that the node gives up
TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
PAGE = os.sysconf("SC_PAGE_SIZE")


class Listener:
    """Takes the stamps of all joint states, and when each arrived."""

    def __init__(self, capacity: int) -> None:
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import QoSProfile
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64

        rclpy.init(args=[])
        self._float = Float64
        self._node = rclpy.create_node("load")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._command = self._node.create_publisher(Float64, CMD_VELOCITY.name, 1)
        deep = QoSProfile(depth=1000)
        # Raw: the header is all that is looked at, so the listener is never the bottleneck.
        self._node.create_subscription(
            JointState, JOINT_STATES.name, self._on_state, deep, raw=True
        )
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_report, 10)
        self._times = np.zeros((capacity, 2), dtype=np.int64)
        self.count = 0
        self.overruns = 0

    @property
    def times(self) -> np.ndarray:
        """Stamp and arrival of each message so far [ns], shape (count, 2)."""
        return self._times[: self.count]

    def spin_until(self, end: float) -> None:
        """Listen and command until a time on the monotonic clock."""
        next_command = time.monotonic()
        while (now := time.monotonic()) < end:
            if now >= next_command:
                down = int(now / HALF_CYCLE) % 2 == 0
                self._command.publish(self._float(data=VELOCITY if down else -VELOCITY))
                next_command = now + COMMAND_PERIOD
            self._executor.spin_once(timeout_sec=0.01)

    def forget(self) -> None:
        """Drop what has been received."""
        self.count = 0

    def close(self) -> None:
        import rclpy

        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown()

    def _on_state(self, data: bytes) -> None:
        arrival = time.time_ns()
        if self.count < len(self._times):
            seconds, nanoseconds = struct.unpack_from("<iI", data, 4)
            self._times[self.count] = seconds * 1_000_000_000 + nanoseconds, arrival
            self.count += 1

    def _on_report(self, message: Any) -> None:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            self.overruns = int(values.get("overruns", self.overruns))


def cpu_seconds(pid: int) -> float:
    """CPU time that a process has used, of all its threads [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_SECOND


def resident(pid: int) -> int:
    """Memory that a process holds [bytes]."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE


def flood(rate: float, duration: float, sent: Any) -> None:
    """Send the node commands at a rate [Hz] for a while [s], in a process of its own."""
    import rclpy
    from rclpy.serialization import serialize_message
    from std_msgs.msg import Float64

    rclpy.init(args=[])
    node = rclpy.create_node("flood")
    publisher = node.create_publisher(Float64, CMD_VELOCITY.name, 1)
    messages = [serialize_message(Float64(data=v)) for v in (VELOCITY, -VELOCITY, float("nan"))]
    begin = time.monotonic()
    while (elapsed := time.monotonic() - begin) < duration:
        for _ in range(int(elapsed * rate) - sent.value):
            publisher.publish(messages[sent.value % len(messages)])
            sent.value += 1
        time.sleep(1e-3)
    node.destroy_node()
    rclpy.try_shutdown()


def idle(duration: float, stalls: Any, longest: Any) -> None:
    """Count how often a process that only sleeps is held up for as long as an overrun [s]."""
    end = last = time.monotonic()
    end += duration
    while last < end:
        time.sleep(1e-3)
        now = time.monotonic()
        longest.value = max(longest.value, now - last)
        stalls.value += now - last > STALL
        last = now


def measure(
    rate: float, duration: float, factor: float, flood_rate: float, folder: Path
) -> dict[str, float]:
    """Run the node for a while and return the figures."""
    parameters = folder / "parameters.yaml"
    parameters.write_text(
        f"/**: {{ros__parameters: {{publish_rate: {rate}, real_time_factor: {factor}, "
        f"publish_clock: {str(factor == 0.0).lower()}}}}}\n"
    )
    # As fast as possible there may be a hundred times as many messages as in real time.
    listener = Listener(int((100 if factor == 0.0 else 1.5) * rate * (duration + 10)))
    try:
        with NodeProcess(parameters, folder / "sim_node.log") as node:
            while listener.count < 100:
                node.check()
                listener.spin_until(time.monotonic() + 0.5)
            listener.spin_until(time.monotonic() + 2.0)
            listener.forget()
            overruns, cpu, begin = listener.overruns, cpu_seconds(node.pid), time.monotonic()
            processes = multiprocessing.get_context("spawn")
            sent = processes.Value("q", 0)
            stalls, longest = processes.Value("q", 0), processes.Value("d", 0.0)
            beside = [processes.Process(target=idle, args=(duration, stalls, longest))]
            if flood_rate:
                beside.append(processes.Process(target=flood, args=(flood_rate, duration, sent)))
            for process in beside:
                process.start()
            memory = []
            while (now := time.monotonic()) < begin + duration:
                memory.append((now - begin, resident(node.pid)))
                listener.spin_until(min(begin + duration, now + 1.0))
            elapsed = time.monotonic() - begin
            share = (cpu_seconds(node.pid) - cpu) / elapsed
            figures = evaluate(listener.times, rate, factor)
            listener.spin_until(time.monotonic() + 1.2)  # the last report
            figures |= {
                "overruns": listener.overruns - overruns,
                "CPU of the node [% of a core]": 100 * share,
                "memory of the node [MB]": memory[-1][1] / 1e6,
                "memory slope [kB/min]": memory_slope(memory),
            }
            for process in beside:
                process.join()
            figures["stalls of an idle process"] = stalls.value
            figures["longest stall of an idle process [ms]"] = 1e3 * longest.value
            if flood_rate:
                figures["commands sent [Hz]"] = sent.value / duration
            node.stop()
        return figures
    finally:
        listener.close()


def evaluate(times: np.ndarray, rate: float, factor: float) -> dict[str, float]:
    """Figures of a record of stamps and arrivals [ns]."""
    stamps, arrivals = times.T
    period = round(1e9 / rate)
    steps = np.diff(stamps)
    figures: dict[str, float] = {
        "messages": len(stamps),
        "lost": int((np.maximum(steps // period, 1) - 1).sum()),  # in overruns, or on the way
        "stamps off the grid": int((steps % period != 0).sum()),
        "stamps not increasing": int((steps <= 0).sum()),
    }
    span = 1e-9 * (arrivals[-1] - arrivals[0])
    figures["real-time factor"] = 1e-9 * (stamps[-1] - stamps[0]) / span
    figures["mean rate [Hz]"] = (len(stamps) - 1) / span
    if factor == 1.0:
        latency = 1e-6 * (arrivals - stamps)
        jitter = 1e-6 * np.abs(np.diff(arrivals) - period)
        for name, values in (("latency", latency), ("jitter", jitter)):
            for percent in (50, 99):
                figures[f"{name} p{percent} [ms]"] = float(np.percentile(values, percent))
            figures[f"{name} max [ms]"] = float(values.max())
        figures["drift of the rate [ppm]"] = 1e6 * (figures["real-time factor"] - 1.0)
    return figures


def memory_slope(memory: list[tuple[float, int]]) -> float:
    """Growth of the second half of a run [kB/min]; the first fills buffers."""
    later = np.array(memory[len(memory) // 2 :])
    if len(later) < 3:
        return 0.0
    return float(np.polyfit(later[:, 0], later[:, 1], 1)[0] * 60 / 1e3)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--rate", default=1000.0, show_default=True, help="publish_rate [Hz].")
@click.option("--duration", default=60.0, show_default=True, help="Length of the record [s].")
@click.option("--flood", "flood_rate", default=0.0, help="Commands sent on top [Hz].")
@click.option(
    "--factor", default=1.0, show_default=True, help="real_time_factor; 0: as fast as possible."
)
def main(rate: float, duration: float, factor: float, flood_rate: float) -> None:
    r"""Record the node's joint states and print what arrived and what it cost, as JSON.

    \b
    Exit code: 0  every stamp on the grid; at a factor of 1 also nothing lost, no overrun, and the
                  mean rate within 0.1 %
               1  otherwise

    \b
    Examples:
      python tools/ros_load.py                                  1 kHz for a minute
      python tools/ros_load.py --rate 500 --duration 1800       soak for half an hour
      python tools/ros_load.py --rate 100 --factor 0            as fast as possible
      python tools/ros_load.py --rate 500 --flood 20000         20,000 commands a second
    """
    with private_ros_domain(), TemporaryDirectory() as folder:
        figures = measure(rate, duration, factor, flood_rate, Path(folder))
    print(json.dumps({name: round(value, 4) for name, value in figures.items()}, indent=2))
    faults = [figures[name] for name in ("stamps off the grid", "stamps not increasing")]
    if factor == 1.0:
        faults += [figures["lost"], figures["overruns"]]
        faults.append(abs(figures["mean rate [Hz]"] / rate - 1.0) > LARGEST_RATE_ERROR)
    sys.exit(any(faults))


if __name__ == "__main__":
    main()
