"""Docstrings as Markdown: `[T] [m]` there are two units and no link."""

import re
from typing import Any

import griffe

# Code in backticks is left as it is.
UNIT_AFTER_BRACKET = re.compile(r"(`[^`]*`)|(\])(\s*)(\[)")


class Units(griffe.Extension):
    """Takes from brackets that follow brackets what Markdown would make of them."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Is called for every object that is read."""
        if obj.docstring:
            obj.docstring.value = UNIT_AFTER_BRACKET.sub(
                lambda found: found[1] or f"{found[2]}{found[3]}\\{found[4]}", obj.docstring.value
            )
