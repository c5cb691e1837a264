"""Damage to a file as disks, editors, programs and ill will do it: to bits, lines, numbers, words."""

import random
import re

_NUMBER = re.compile(rb"[+-]?[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?")
_NUMBERS = (
    *(b"nan", b"inf", b"-inf", b"NaN", b"Infinity", b"1e308", b"-1e308", b"1e999", b"5e-324", b"0", b"-0.0", b"-1"),
    *(b"1e30", b"1e12", b"2147483648", b"9223372036854775808", b"9" * 30, b"9" * 5000, b"1_0", b"0x10", b"1.", b".5"),
    *(
        "\u0661\u0662".encode(),
        b"",
        b" ",
        b"null",
        b"true",
        b"[]",
        b"{}",
        b'"x"',
        b"1e",
        b"--1",
        b"1,5",
        b"2220",
        b"366",
    ),
)
_TEXTS = (
    *(
        b"\0",
        b"\x0b",
        b"\x0c",
        b"\x1b[31m",
        b"\r",
        b"\n",
        b"\n\n",
        b"\t",
        b" ",
        b"\xff",
        b"\xef\xbb\xbf",
        b"\xed\xa0\x80",
    ),
    *(
        b"\\ud800",
        b"\\u0000",
        b'"',
        b"'",
        b"[",
        b"]",
        b"{",
        b"}",
        b"<",
        b">",
        b"=",
        b",",
        b";",
        b":",
        b"#",
        b"COMMENT ",
    ),
    *(
        "\u2028".encode(),
        "\u202e".encode(),
        b"[" * 2000,
        b"a." * 500,
        b"x" * 70_000,
        b"<!DOCTYPE a>",
        b"&a;",
        b"../../x",
    ),
)


def mutated(data: bytes, rng: random.Random) -> bytes:
    """Returns the file with one to three damages."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        data = rng.choice(_WAYS)(data, rng)
    return data


def _place(data: bytes, rng: random.Random) -> int:
    return rng.randrange(len(data) + 1)


def _bit(data: bytes, rng: random.Random) -> bytes:
    if not data:
        return data
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def _byte(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]


def _digit(data: bytes, rng: random.Random) -> bytes:
    """What a checksum of digits may not see."""
    found = list(re.finditer(rb"[0-9]", data))
    if not found:
        return data
    at = rng.choice(found).start()
    return data[:at] + rng.choice((b" ", b"0", b"9", b"-", b".", b"A")) + data[at + 1 :]


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: _place(data, rng)]


def _without(data: bytes, rng: random.Random) -> bytes:
    begin = _place(data, rng)
    return data[:begin] + data[begin + rng.choice((1, 1, 2, 8, 80)) :]


def _again(data: bytes, rng: random.Random) -> bytes:
    begin, at = _place(data, rng), _place(data, rng)
    return data[:at] + data[begin : begin + rng.choice((1, 8, 80, 800))] + data[at:]


def _number(data: bytes, rng: random.Random) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return data
    one = rng.choice(found)
    return data[: one.start()] + rng.choice(_NUMBERS) + data[one.end() :]


def _text(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + rng.choice(_TEXTS) + data[at:]


def _line(data: bytes, rng: random.Random) -> bytes:
    """One line left out, twice, or in the place of another."""
    lines = data.split(b"\n")
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    how = rng.randrange(3)
    if how == 0:
        del lines[one]
    elif how == 1:
        lines.insert(other, lines[one])
    else:
        lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _word(data: bytes, rng: random.Random) -> bytes:
    """A key or a word in the place of another one of the file, or with two letters exchanged."""
    found = list(re.finditer(rb"[A-Za-z_]{3,}", data))
    if not found:
        return data
    one = rng.choice(found)
    word = rng.choice(found)[0]
    if rng.random() < 0.5:
        k = rng.randrange(len(one[0]) - 1)
        word = one[0][:k] + one[0][k + 1 : k + 2] + one[0][k : k + 1] + one[0][k + 2 :]
    return data[: one.start()] + word + data[one.end() :]


_WAYS = (_bit, _byte, _digit, _digit, _cut, _without, _again, _number, _number, _number, _text, _text, _line, _word)
