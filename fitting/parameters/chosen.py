"""Which leaves are free: names and prefixes as a user writes them, and aliases of the satellite file."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches

from jaxsat.errors import InputError
from jaxsat.satellites.model import Leaf


def chosen_leaves(
    leaves: Sequence[Leaf], free: Sequence[str] | None, aliases: Mapping[str, Sequence[str]] | None = None
) -> tuple[str, ...]:
    """Names of the free leaves; raises `InputError` naming the first item that is none, with a suggestion.

    An alias may be written in capitals or not.
    """
    if free is None:
        return tuple(leaf.name for leaf in leaves if leaf.sigma is not None)
    names = [leaf.name for leaf in leaves]
    prefixes = {".".join(name.split(".")[:k]) for name in names for k in range(1, name.count(".") + 2)}
    # What says the same in another way is asked for by its own name.
    below = [leaf.name for leaf in leaves if not leaf.restates]
    chosen: set[str] = set()
    for item in (part.strip() for part in free):
        for each in [item] if item in prefixes else spelt_out(item, aliases or {}):
            found = [name for name in names if name == each or (name in below and name.startswith(f"{each}."))]
            if not found and each != "state":
                close = get_close_matches(each, sorted(prefixes), n=1)
                heads = ", ".join(dict.fromkeys(["state", *(name.split(".")[0] for name in below)]))
                hint = f"did you mean {close[0]}?" if close else f"expected any of {heads}, or what is below them"
                raise InputError(f"unknown free parameter {each!r}; {hint}", field="free")
            chosen.update(found)
    return tuple(name for name in names if name in chosen)


def spelt_out(item: str, aliases: Mapping[str, Sequence[str]]) -> Sequence[str]:
    """What an alias stands for, in capitals or not, also where it begins a longer name, as gains in gains.+x."""
    meant = {name.casefold(): names for name, names in aliases.items()}
    if item.casefold() in meant:
        return meant[item.casefold()]
    head, dot, tail = item.partition(".")
    return [f"{each}.{tail}" for each in meant[head.casefold()]] if dot and head.casefold() in meant else [item]
