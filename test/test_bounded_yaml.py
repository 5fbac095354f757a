"""YAML that no memory holds."""

from __future__ import annotations

from pathlib import Path

import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.bounded_yaml import load_yaml
from hma_gripper_sim.units import read_yaml

LAUGHS = "a0: &a0 [lol, lol]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 10)
)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[" * 3000, "nested more than 50 levels deep"),
        ("".join(f"{' ' * i}a:\n" for i in range(100)), "nested more than 50 levels deep"),
        (LAUGHS, "its aliases stand for more than"),
        ("a: &a [*a]", "an alias refers to what it is a part of"),
        ("a: " + "x" * 2**21, "at most 2097152 are read"),
        ("a: !!bool maybe", "not valid YAML"),
        ('a: !!int ""', "not valid YAML"),
        ("a: 2026-02-31", "not valid YAML: day is out of range"),
        ("a: [1\nb: 2", "not valid YAML at line 2"),
        ("a: \0", "not valid YAML"),
    ],
)
def test_text_beyond_the_bounds_is_refused(text: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=reason):
        load_yaml(text)
    path = tmp_path / "a.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        read_yaml(path)
    assert (caught.value.source, "\n" in str(caught.value)) == (str(path), False)


def test_aliases_and_merge_keys_are_read() -> None:
    text = "a: &a {x: 1}\nb: {<<: *a, y: 2}\nc: [*a, *a]\n"
    assert load_yaml(text) == {"a": {"x": 1}, "b": {"x": 1, "y": 2}, "c": [{"x": 1}, {"x": 1}]}
    assert load_yaml("") is None
