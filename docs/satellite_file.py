"""The reference of satellite files, made from the sections that check them: keys, meanings, values, defaults."""

import ast
import inspect
import textwrap
import types
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel

HEAD = """# Satellite files

Every section and key of the TOML file that `jaxsat fit --satellite`, `jaxsat check` and `jaxsat.read_satellite` take;
`jaxsat init` prints them as a commented template. What the sensors make of their numbers, and the names under which
numbers are freed, stand in [sensors and names](../satellites/sensors.md).

Values marked \\* may be fitted: plain, or `{value = 1.0, sigma = 0.1, free = true, bounds = [0.0, 2.0]}`. `sigma` is
the 1-sigma of what is known beforehand, in the unit of the value, one for all or one each; a fit changes what has one,
unless `free` says otherwise or `--free` names others. Units are those of the key (`dipole_A_m2`, `turn` in rad) or of
the key `unit` beside it, which takes SI prefixes, `G`, `deg`, `deg/s`, `rpm`, `count`, `%`, products, quotients, and a
number in front where it says what one count is (`"12.5 nT"`).

A file is checked as a whole: every wrong key is told at once, with its path and, where one is close, the key that was
meant."""
REPEATED = ("rods", "coils", "wheels", "thrusters")
"""Tables of which there may be several."""


def page() -> str:
    """The reference as Markdown."""
    from jaxsat.satellites.kinds import KINDS
    from jaxsat.satellites.sections.file import SatelliteFile

    parts = [HEAD]
    for name, field in SatelliteFile.model_fields.items():
        model = _model(field.annotation)
        if name == "sensors":
            parts.append("## [sensors.NAME]")
            parts.append(
                f"One table a sensor, with the keys of its `kind`: {', '.join(f'`{kind}`' for kind in KINDS)}, or "
                "`module:Class` of one's own, whose fields are the keys ([from Python](../python.md))."
            )
            for kind, keys in KINDS.items():
                parts += _section(f"sensors.NAME, {kind}", keys, level=3, without=("kind",))
        elif name == "channels":
            parts += _section("channels.NAME", get_args(field.annotation)[1])
        elif model is not None:
            parts += _section(name, model, repeated=name in REPEATED)
    parts += [
        "## [aliases]",
        'Names of one\'s own for what is freed together, as `calibration = ["mag.bias", "mag.scale"]`, and then '
        "`--free calibration`.",
    ]
    return "\n\n".join(parts)


def _section(
    path: str, model: type[BaseModel], *, level: int = 2, repeated: bool = False, without: tuple[str, ...] = ()
) -> Iterator[str]:
    place, _, kind = path.partition(", ")
    title = f'[{place}] kind = "{kind}"' if kind else f"[[{place}]]" if repeated else f"[{place}]"
    yield f"{'#' * level} {title}"
    about = inspect.cleandoc(model.__doc__ or "").partition("\n\n")[0].replace("\n", " ")
    # A kind says so in its docstring, as its heading does here.
    about = about.removeprefix(f'`kind = "{kind}"`').lstrip(":. ")
    if about:
        yield about[0].upper() + about[1:]
    rows = ["| key | value | default | meaning |", "|---|---|---|---|"]
    nested, hints, meanings = [], _hints(model), _meanings(model)
    for name, field in model.model_fields.items():
        if name in without:
            continue
        value = _value(hints[name])
        inner = _inner(hints[name])
        if inner is not None:
            nested.append((f"{place}.{name}", inner))
        meaning = meanings.get(name, "") or ("Its keys stand below." if inner is not None else "")
        cells = (f"`{name}`", value, _default(field), meaning)
        rows.append("| " + " | ".join(_cell(cell) for cell in cells) + " |")
    yield "\n".join(rows)
    for name, inner in nested:
        yield from _section(name, inner, level=max(level, 2) + 1)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _hints(model: type) -> dict[str, Any]:
    return get_type_hints(model, include_extras=True, localns=_places())


def _places() -> dict[str, Any]:
    """Names that annotations have and their modules import only for checkers of types."""
    from jaxsat.satellites.leaves import LeafList
    from jaxsat.sensors.abstract import AbstractSensor

    return {"LeafList": LeafList, "AbstractSensor": AbstractSensor}


def _meanings(model: type) -> dict[str, str]:
    """Docstrings below the fields of a class and of those that it is made of."""
    found: dict[str, str] = {}
    for kind in reversed(model.__mro__):
        if kind is BaseModel or not issubclass(kind, BaseModel):
            continue
        body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
        assert isinstance(body, ast.ClassDef)
        for field, text in zip(body.body, body.body[1:], strict=False):
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                assert isinstance(field.target, ast.Name)
                found[field.target.id] = " ".join(str(text.value.value).split())
    return found


def _bare(hint: Any) -> Any:
    """A type without None."""
    if get_origin(hint) in (Union, types.UnionType):
        (hint,) = (kind for kind in get_args(hint) if kind is not type(None))
    return hint


def _model(hint: Any) -> type[BaseModel] | None:
    hint = _bare(hint)
    if get_origin(hint) is Annotated:
        hint = get_args(hint)[0]
    if get_origin(hint) is tuple:
        hint = get_args(hint)[0]
    return hint if isinstance(hint, type) and issubclass(hint, BaseModel) else None


def _inner(hint: Any) -> type[BaseModel] | None:
    """Of a key whose value is a table, its section; numbers with a prior have none."""
    from jaxsat.satellites.sections.fitted import Fitted

    model = _model(hint)
    return None if model is None or issubclass(model, Fitted) else model


def _value(hint: Any) -> str:
    """What a key takes, in words."""
    from jaxsat import setting_types
    from jaxsat.satellites.kinds import common
    from jaxsat.satellites.kinds.field import Stray
    from jaxsat.satellites.sections import fitted, parts, session

    hint = _bare(hint)
    named = [
        (fitted.Scalar, "number \\*"),
        (fitted.PositiveScalar, "number > 0 \\*"),
        (fitted.Triple, "three numbers \\*"),
        (fitted.PositiveTriple, "number or three, > 0 \\*"),
        (fitted.Tensor, "three moments or 3 x 3 \\*"),
        (fitted.Fitted, "number or one each \\*"),
        (fitted.Direction, '`"+x"` ... `"-z"` or three numbers'),
        (common.Axes, 'directions, `"unknown"`, `"mirrored"`'),
        (common.Normals, "directions"),
        (fitted.UnitText, "unit"),
        (common.FieldUnit, "unit of T"),
        (common.RateUnit, "unit of rad/s"),
        (common.CurrentUnit, "unit of A"),
        (parts.Size, "three numbers > 0"),
        (parts.Share, "number, 0 to 1"),
        (setting_types.Positive, "number > 0"),
        (setting_types.NonNegative, "number ≥ 0"),
        (setting_types.Angle, "number"),
        (setting_types.Vector, "three numbers"),
        (session.Instant, "instant, UTC"),
        (session.Names, "names of columns"),
        (float, "number"),
        (bool, "true or false"),
        (str, "text"),
    ]
    for kind, words in named:
        if hint == kind:
            return words
    if _model(hint) is Stray:
        return "table \\*"
    if get_origin(hint) is Literal:
        return ", ".join(f'`"{choice}"`' for choice in get_args(hint))
    if get_origin(hint) is Annotated:
        hint = get_args(hint)[0]
    if get_origin(hint) is tuple:
        items = get_args(hint)
        if _model(hint) is not None:
            return "tables"
        return f"{_count(items)} texts"
    if _model(hint) is not None:
        return "table"
    return {float: "number", str: "text"}.get(hint, "see meaning")


def _count(items: tuple) -> str:
    return "list of" if Ellipsis in items else {3: "three", 4: "four"}.get(len(items), str(len(items)))


def _default(field: Any) -> str:
    from jaxsat.satellites.sections.fitted import Fitted

    if field.is_required():
        return "needed"
    value = field.get_default(call_default_factory=True)
    if value is None:
        return ""
    return f"`{_text(value.value if isinstance(value, Fitted) else value)}`"


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_text(each) for each in value) + "]"
    return f"{value:g}"
