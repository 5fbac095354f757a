"""YAML files from outside: what cannot be read is one named error."""

from __future__ import annotations

from pathlib import Path

import pytest

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.yaml_reading import read_yaml, refuse_unknown


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
