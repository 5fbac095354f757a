"""YAML files from outside: what cannot be read is one named error."""

from __future__ import annotations

from pathlib import Path

import pytest

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.yaml_reading import load_yaml, read_yaml, refuse_unknown


def test_unknown_field_is_named() -> None:
    """A misspelt field is an error, not ignored, whatever type its key has."""
    refuse_unknown({"radius": 1.0}, ("radius",))
    with pytest.raises(InputError, match="known: radius") as refusal:
        refuse_unknown({"radius": 1.0, 7: 2.0}, ("radius",))  # type: ignore[dict-item]
    assert refusal.value.field == "7"


def test_read_yaml(tmp_path: Path) -> None:
    """A mapping comes back as it is."""
    path = tmp_path / "good.yaml"
    path.write_text("a: 1\nb: {c: 28 mm}\n", encoding="utf-8")
    assert read_yaml(path) == {"a": 1, "b": {"c": "28 mm"}}
    assert read_yaml(str(path)) == read_yaml(path)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"a: [1, 2\n", "not valid YAML at line 2"),
        (b"a: b: c\n", "not valid YAML at line 1"),
        (b"- 1\n- 2\n", "expected a mapping"),
        (b"just text\n", "expected a mapping"),
        (b"", "expected a mapping"),
        (b"\xff\xfe\x00\x01", "not UTF-8 text"),
        (b"a: \x00\n", "not valid YAML"),
        (b"a: !!python/object/apply:os.getcwd []\n", "not valid YAML"),
        (b"a: *nowhere\n", "not valid YAML"),
        (b"a: 2013-99-99\n", "not valid YAML"),
        (b"? [1, 2]\n: 3\n? {a: 1}\n: 4\n", "not valid YAML"),
    ],
)
def test_unreadable_yaml(tmp_path: Path, content: bytes, reason: str) -> None:
    """Whatever the file holds: one InputError that names it."""
    path = tmp_path / "bad.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError) as refusal:
        read_yaml(path)
    assert str(refusal.value).startswith(f"{path}: ")
    assert reason in refusal.value.reason
    assert "\n" not in str(refusal.value)


def test_missing_file_and_directory(tmp_path: Path) -> None:
    """A path that is no readable file is named with the system's reason."""
    missing = tmp_path / "missing.yaml"
    with pytest.raises(InputError, match="cannot be read: No such file or directory") as refusal:
        read_yaml(missing)
    assert refusal.value.source == str(missing)
    with pytest.raises(InputError, match="cannot be read"):
        read_yaml(tmp_path)


LAUGHS = "a0: &a0 [lol, lol]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 10)
)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        pytest.param("[" * 60 + "1" + "]" * 60, "nested more than 50 levels", id="lists"),
        pytest.param("[" * 3000, "nested more than 50 levels|exceeded maximum nesting", id="open"),
        pytest.param(
            "".join(f"{' ' * i}a:\n" for i in range(100)), "nested more than 50 levels", id="maps"
        ),
        pytest.param(LAUGHS, "its aliases stand for more than", id="laughs"),
        pytest.param("a: &a [*a]", "an alias refers to what it is a part of", id="circle"),
        pytest.param("a: " + "x" * 2**21, "at most 2097152 are read", id="long"),
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
