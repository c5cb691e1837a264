"""Pictures and page of a turn, as bytes by their file names."""

import numpy as np

from fitting.session import PreparedSession
from jaxsat.cli.turn.space import Surroundings, Turned, turn_page
from jaxsat.plotting import draw_turn, png_bytes

QUARTERS = (0, 90, 180, 270)
"""Angles shown in space beside the chosen one [deg]."""


def draw(
    prepared: PreparedSession,
    turned: Turned,
    rms_mA: np.ndarray,
    *,
    t_s: float,
    about: str,
    chosen_deg: float,
    chosen_q: np.ndarray,
    title: str,
    message: str,
) -> dict[str, bytes]:
    """Returns turn.png, space.png and turn.html; `rms_mA` [degrees] is what is left at each whole degree."""
    figure = draw_turn(
        turned.angles_deg[:-1],
        rms_mA,
        turned.modelled_mA[:-1],
        turned.measured_mA,
        chosen_deg=chosen_deg,
        title=title,
        subtitle=prepared.subtitle,
    )
    around = Surroundings.of(prepared, t_s)
    shown = np.concatenate([chosen_q[None], turned.q[list(QUARTERS)]])
    space = around.picture(
        shown, [chosen_deg, *map(float, QUARTERS)], title=f"{title}, in space", subtitle=prepared.subtitle
    )
    pictures = {"turn.png": png_bytes(figure), "space.png": png_bytes(space)}
    text = turn_page(
        turned,
        around,
        about=about,
        chosen_deg=chosen_deg % 360.0,
        epoch_utc=prepared.session.epoch.iso(3),
        title=title,
        subtitle=prepared.subtitle,
        message=message,
        pictures=pictures,
    )
    return {**pictures, "turn.html": text.encode()}
