"""YAML from outside, within bounds.

A text of a few lines can be nested deeper than a parser can follow, and its aliases can stand for
more than a memory holds.
"""

from __future__ import annotations

from typing import Any

import yaml

from hma_gripper_sim.errors import InputError, first_line

LONGEST = 2**21
"""Characters of a text."""

DEEPEST = 50
"""Levels of nesting."""

MOST = 2**22
"""Characters and nodes with every alias written out."""


def load_yaml(text: str) -> Any:
    """Return the content of a YAML text.

    Raises
    ------
    InputError
        It is not valid, or beyond the bounds.
    """
    if len(text) > LONGEST:
        raise InputError(f"has {len(text)} characters: at most {LONGEST} are read as YAML")
    loader = None
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _measure(node, {})
        return loader.construct_document(node)
    except InputError:
        raise
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line = f" at line {mark.line + 1}" if mark is not None else ""
        raise InputError(f"not valid YAML{line}: {error.problem or 'unreadable'}") from None
    except Exception as error:  # such as a date that does not exist
        raise InputError(f"not valid YAML: {first_line(error)}") from None
    finally:
        if loader is not None:
            loader.dispose()


class _Loader(yaml.SafeLoader):
    """Composes no deeper than `DEEPEST`."""

    _depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        self._depth += 1
        if self._depth > DEEPEST:
            raise InputError(f"not valid YAML: nested more than {DEEPEST} levels deep")
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def _measure(node: yaml.Node, known: dict[int, int]) -> int:
    """Return the size of a node with its aliases written out."""
    size = known.get(id(node))
    if size is not None:
        if not size:
            raise InputError("not valid YAML: an alias refers to what it is a part of")
        return size
    known[id(node)] = 0
    size = 1
    if isinstance(node, yaml.ScalarNode):
        size += len(node.value)
    elif isinstance(node, yaml.MappingNode):
        size += sum(_measure(part, known) for pair in node.value for part in pair)
    elif isinstance(node, yaml.SequenceNode):
        size += sum(_measure(part, known) for part in node.value)
    if size > MOST:
        raise InputError(f"not valid YAML: its aliases stand for more than {MOST} characters")
    known[id(node)] = size
    return size
