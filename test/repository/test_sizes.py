"""What a person can hold in the head: sizes of modules, functions and argument lists."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("hma_gripper_sim", "hma_gripper_benchmarks")
MODULE, FUNCTION, ARGUMENTS = 400, 60, 8  # lines, lines without the docstring, of a kernel

SWEEP = "one sweep or step over a chain, whose every line works on the same running sums"
CASES = "one case after the other of one distinction"
BUFFERS = "a kernel must not allocate: who calls it passes the buffers it fills"
LISTED = "a list of scenes or fields, one after the other"
ONE_STORY = "one subject whose parts make no sense apart"

EXCEPTIONS = {
    "hma_gripper_benchmarks/asked_error.py": ONE_STORY,
    "hma_gripper_benchmarks/hard_cases.py": LISTED,
    "hma_gripper_benchmarks/hard_cases.py:_motions": LISTED,
    "hma_gripper_benchmarks/population.py": LISTED,
    "hma_gripper_sim/bags/ros1_bag.py:batches": CASES,
    "hma_gripper_sim/calibration/fitting.py": ONE_STORY,
    "hma_gripper_sim/comparison/tables.py:as_json": LISTED,
    "hma_gripper_sim/kernels/accelerations.py:solve_accelerations()": BUFFERS,
    "hma_gripper_sim/kernels/chain.py:place": SWEEP,
    "hma_gripper_sim/kernels/drive_profile.py:_tick_that_took()": BUFFERS,
    "hma_gripper_sim/kernels/drive_profile.py:settle_commands()": BUFFERS,
    "hma_gripper_sim/kernels/proximity.py:segment_distance": CASES,
    "hma_gripper_sim/kernels/radau.py": ONE_STORY,
    "hma_gripper_sim/kernels/radau.py:radau_step": SWEEP,
    "hma_gripper_sim/kernels/radau_integrator.py": ONE_STORY,
    "hma_gripper_sim/kernels/radau_integrator.py:integrate_radau": SWEEP,
    "hma_gripper_sim/kernels/stage.py:solve_stage()": BUFFERS,
    "hma_gripper_sim/kernels/static_equilibrium.py:solve_dead_load()": BUFFERS,
    "hma_gripper_sim/kernels/velocity_pieces.py:fit_pieces()": BUFFERS,
    "hma_gripper_sim/motion/velocity_function.py": ONE_STORY,
    "hma_gripper_sim/simulation/simulation.py": ONE_STORY,
}
"""With the reason; ``()`` stands for the arguments of a kernel."""


def too_large() -> Iterator[str]:
    """Modules, functions and kernels beyond the bounds."""
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            name, text = path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
            if len(text.splitlines()) > MODULE:
                yield name
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.FunctionDef):
                    yield from (f"{name}:{large}" for large in of_function(node))


def of_function(node: ast.FunctionDef) -> Iterator[str]:
    """What of a function is beyond the bounds."""
    lines = (node.end_lineno or 0) - node.lineno + 1
    if ast.get_docstring(node) is not None:
        lines -= (node.body[0].end_lineno or 0) - node.body[0].lineno + 1
    if lines > FUNCTION:
        yield node.name
    decorators = {item.id for item in node.decorator_list if isinstance(item, ast.Name)}
    if "kernel" in decorators and len(node.args.args) > ARGUMENTS:
        yield f"{node.name}()"


def test_what_is_larger_than_a_head_is_named_with_a_reason() -> None:
    found = set(too_large())
    assert found - set(EXCEPTIONS) == set(), "split it, or name it with a reason"
    assert set(EXCEPTIONS) - found == set(), "no exception any more: take it off the list"
