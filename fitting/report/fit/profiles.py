"""Profiles of a fit as a row of a table, as pictures, and read back from fit.json."""

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from fitting.profile.profile import Interval, Profile
from jaxsat.plotting import png_bytes
from jaxsat.plotting.profile import draw_profile
from jaxsat.significant import unit_text, value_and_sigma

PROFILE_COLUMNS = ("parameter", "value", "1σ", "68 %", "95 %", "unit", "note")
PROFILE_NOTE = "Intervals in which the cost rises by less than 1/2 and 1.92, all other parameters at their best."


def profile_pictures(names: Iterable[str]) -> dict[str, str]:
    """Names of the pictures' files by parameter: any name may stand in a satellite file, not all in a folder."""
    found: dict[str, str] = {}
    for name in names:
        stem = f"profile-{re.sub(r'[^A-Za-z0-9_.+-]', '_', name)}"
        while f"{stem}.png" in found.values():
            stem += "_"
        found[name] = f"{stem}.png"
    return found


def profile_row(profile: Profile) -> tuple[str, ...]:
    """Returns (name, value, sigma, 68 %, 95 %, unit, note) of a profile as text."""
    p = profile
    value, sigma = value_and_sigma(p.best, p.sigma)
    # All numbers to the digit that a quarter of the profile's width, about two sigmas, makes worth while.
    width = float(p.values[-1] - p.values[0]) / 4.0

    def span(interval: Interval) -> str:
        low, high = ("open" if end is None else value_and_sigma(end, width)[0] for end in interval)
        return f"{low} ... {high}"

    texts = (span(p.interval_68), span(p.interval_95))
    return (p.name, value, f"± {sigma}" if sigma else "", *texts, unit_text(p.unit), p.note)


def draw_profiles(profiles: Sequence[Profile], subtitle: str) -> dict[str, bytes]:
    """Returns the pictures of profiles as PNG by file name."""
    files = profile_pictures(p.name for p in profiles)
    return {
        files[p.name]: png_bytes(
            draw_profile(
                p.values,
                p.rise,
                best=p.best,
                sigma=p.sigma,
                interval_68=p.interval_68,
                interval_95=p.interval_95,
                name=p.name,
                unit=unit_text(p.unit),
                rise_data=p.rise_data,
                settled=p.settled,
                subtitle=subtitle,
            )
        )
        for p in profiles
    }


def stored_profile(content: dict[str, Any]) -> Profile:
    """A profile of fit.json; raises KeyError or TypeError where it is not as written."""
    arrays = {name: np.array(content[name]) for name in ("values", "rise", "rise_data", "settled")}
    intervals = {name: tuple(content[name]) for name in ("interval_68", "interval_95")}
    return Profile(**{**content, **arrays, **intervals})
