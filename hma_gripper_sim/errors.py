"""The exceptions this package raises for what a user can put right."""

from __future__ import annotations

LONGEST = 2000
"""Characters of an error's reason: what is beyond helps nobody."""


class InputError(ValueError):
    """A value from outside that cannot be used.

    Its text is ``source: field: reason``: the file (or call), the field in it, and what is
    wrong, with the remedy where there is one.

    Parameters
    ----------
    reason
        What is wrong, in one line.
    field
        Dotted name of the offending field, such as ``contour.width``.
    source
        Where the value came from: a path, a topic, a class name.
    """

    def __init__(self, reason: str, *, field: str | None = None, source: str | None = None) -> None:
        self.reason = _shortened(printable(reason))
        self.field = None if field is None else _shortened(printable(field))
        self.source = None if source is None else printable(source)
        parts = (self.source, self.field, self.reason)
        super().__init__(": ".join(part for part in parts if part))

    def within(self, *, source: str | None = None, field_prefix: str | None = None) -> InputError:
        """Return the same error, seen from the enclosing file or section."""
        field = ".".join(part for part in (field_prefix, self.field) if part) or None
        return InputError(self.reason, field=field, source=source or self.source)


def printable(text: str) -> str:
    """Return a text in one line without control codes: their escapes stand in for them.

    Names of topics, joints and files are anybody's; a terminal obeys what is in them.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"


def first_line(error: BaseException) -> str:
    """Return what a foreign error says, in one line; its name if it says nothing."""
    return str(error).partition("\n")[0] or type(error).__name__
