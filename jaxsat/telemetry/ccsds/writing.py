"""The text of a CCSDS message, KEYWORD = VALUE, from its keywords and its lines of data."""

from collections.abc import Mapping, Sequence

from jaxsat.telemetry.ccsds.ndm import LONGEST_LINE


def message_text(
    header: Mapping[str, str],
    segments: Sequence[tuple[Mapping[str, str], Sequence[str]]],
    *,
    aem: bool,
    comments: Sequence[str] = (),
) -> str:
    """Text of a message: keywords of the header, then metadata and lines of data of each segment.

    `comments` open the metadata of each. Raises ValueError for a value that is not one line of ASCII.
    """
    lines = [_pair(key, value) for key, value in header.items()]
    for meta, data in segments:
        width = max(map(len, meta))
        lines += ["", "META_START", *(_ascii(f"COMMENT {comment}") for comment in comments)]
        lines += [*(_pair(f"{key:{width}}", value) for key, value in meta.items()), "META_STOP", ""]
        lines += ["DATA_START", *data, "DATA_STOP"] if aem else data
    return "\n".join(lines) + "\n"


def _pair(key: str, value: str) -> str:
    if not value.strip():
        raise ValueError(f"{key.strip()} has no value")
    return _ascii(f"{key} = {value}")


def _ascii(line: str) -> str:
    if not (line.isascii() and line.isprintable() and len(line) <= LONGEST_LINE):
        raise ValueError(f"expected one line of at most {LONGEST_LINE} printable ASCII characters, got {line[:60]!r}")
    return line
