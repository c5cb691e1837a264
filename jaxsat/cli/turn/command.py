"""`jaxsat turn`: a satellite turned by hand about the field or about the Sun line, against one sample's currents."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from jaxsat.bundled import BUNDLED
from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import ConfigFile, check_direction
from jaxsat.cli.shared.talk import USUAL, Talking
from jaxsat.errors import InputError

SCHEMA = "jaxsat.turn/1"
FILES = ("turn.csv", "turn.png", "space.png", "turn.html", "turn.json")


def _finite(_: Any, value: float | None) -> None:
    if value is not None and not math.isfinite(value):
        raise ValueError("Expected a finite number.")


def turn(
    file: Annotated[Path | None, Parameter(help="RAW_SUN file. [default: a bundled synthetic one]")] = None,
    /,
    *,
    about: Annotated[
        Literal["field", "sun"], Parameter(help="Axis of the turn: the magnetic field (OrB) or the Sun line (OrS).")
    ] = "field",
    at: Annotated[
        float | None,
        Parameter(
            help="The sample nearest to this time, s since the epoch, no further than the usual spacing. [default: the "
            "first lit]",
            validator=_finite,
        ),
    ] = None,
    angle_deg: Annotated[
        float | None,
        Parameter(help="Angle of the turn from the initial position. [default: the one that fits]", validator=_finite),
    ] = None,
    axis_body: Annotated[
        tuple[float, float, float] | None,
        Parameter(
            help="X Y Z: direction in body axes that lies along the axis. [default: for the field that of the "
            "satellite's magnet; the currents tell that of the Sun]",
            negative=(),
            validator=check_direction,
        ),
    ] = None,
    config: ConfigFile = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("turn"),
    plots: Annotated[bool, Parameter(help="Draw the picture.")] = True,
    talk: Talking = USUAL,
) -> int:
    """Turn the satellite about the field or the Sun line and compare currents.

    The turn is counted from the published initial position: body y parallel to
    the inertial plane OXY, or OYZ where the axis is near Z; where no turn puts
    it there, as near as it comes, and body z in place of y where y is nearly
    along the axis. Writes turn.csv
    (every degree), turn.json (direction cosines, factors, currents and field in
    body axes at the angle), turn.png (residuals and currents at each angle),
    space.png: Earth, orbit, Sun, field and the satellite as it is turned, and
    turn.html: the same to be turned with the mouse, under a slider of the angle.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat turn a.RAW_SUN --about sun --at 448 --angle-deg 30
    """
    from jaxsat.cli.settings.given import read_settings

    settings = read_settings(config)
    if file is None:
        talk.note(f"no file given: taking the bundled synthetic session {BUNDLED.name}")

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    import jax
    import jax.numpy as jnp
    import numpy as np

    from fitting.local.methods import local_samples
    from fitting.local.sun_body import sun_on_sides
    from fitting.local.turn import turned_sample
    from fitting.session import prepare_session
    from jaxsat.cli.local.files import CONVENTION
    from jaxsat.files.json_files import plain, write_json
    from jaxsat.files.staging import staged_directory
    from jaxsat.math import quaternion
    from jaxsat.panel_names import PANEL_NAMES
    from jaxsat.telemetry import read_session

    with staged_directory(out, FILES) as stage:
        session = read_session(file or BUNDLED, settings.numbers, cleaning=settings.cleaning)
        prepared = prepare_session(session, settings.given)
        noise, arc = settings.fit.noise_mA, settings.fit.arc_s
        samples = local_samples(prepared, settings.numbers, noise_mA=noise, arc_s=arc)
        light_seen = np.max(samples.currents, axis=1) >= 2e-3
        k = int(np.argmax(light_seen)) if at is None else int(np.argmin(np.abs(samples.t - at)))
        spacing = float(np.median(np.diff(samples.t))) if len(samples.t) > 1 else 0.0
        if at is not None and abs(samples.t[k] - at) > spacing:
            reason = f"no sample within {spacing:g} s of t = {at:g} s; they run from {samples.t[0]:g} to "
            raise InputError(f"{reason}{samples.t[-1]:g} s", file=prepared.session.path, field="at")
        t, measured = float(samples.t[k]), jnp.asarray(samples.currents[k])
        light = jax.tree.map(lambda leaf: leaf[k], samples.light)
        field = jnp.asarray(samples.b_field_eci[k])
        if axis_body is not None:
            own = jnp.asarray(axis_body)
        elif about == "field":
            own = jnp.asarray(samples.axis_body)
        else:
            if not light_seen[k]:
                reason = f"no panel shows 2 mA at t = {t:g} s: the currents do not tell the Sun; give --axis-body"
                raise InputError(reason, file=prepared.session.path, field="at")
            shown = measured / samples.panels.gains
            own = sun_on_sides(shown, shown[0::2] >= shown[1::2])
        axis = field if about == "field" else light.sun_eci
        program = jax.jit(turned_sample)

        def scanned(angles):
            fixed = (axis, own, measured, field, samples.panels, samples.earth, light)
            return jax.tree.map(np.asarray, program(jnp.radians(angles), *fixed))

        degrees = jnp.arange(360.0)
        scan = scanned(degrees)
        chosen = float(np.argmin(scan.fit.rms)) if angle_deg is None else angle_deg
        # One program for both: its shape is that of the scan.
        here = jax.tree.map(lambda leaf: leaf[0], scanned(jnp.full(360, chosen)))
        cosines = np.asarray(quaternion.to_dcm(jnp.asarray(here.fit.quaternion)))
        _write_csv(stage / "turn.csv", np.asarray(degrees), scan)
        title = f"Turned about the {'field' if about == 'field' else 'Sun line'} at t = {t:g} s"
        rms = f"{1e3 * float(here.fit.rms):.3g} mA"
        if plots:
            from jaxsat.cli.turn.pictures import draw
            from jaxsat.cli.turn.space import Turned

            # Once round, so that the slider ends where it begins.
            around = np.append(np.arange(360), 0)
            modelled = 1e3 * (scan.direct + scan.albedo)
            turned = Turned(
                np.arange(361.0),
                np.asarray(scan.fit.quaternion)[around],
                1e3 * scan.direct[around],
                modelled[around],
                1e3 * samples.currents[k],
                noise,
            )
            files = draw(
                prepared,
                turned,
                1e3 * scan.fit.rms,
                t_s=t,
                about="field" if about == "field" else "Sun line",
                chosen_deg=chosen,
                chosen_q=np.asarray(here.fit.quaternion),
                title=title,
                message=f"Residual RMS {rms} with the best factors of direct and returned light.",
            )
            for name, content in files.items():
                (stage / name).write_bytes(content)
        document = {
            "schema": SCHEMA,
            "telemetry": prepared.telemetry,
            "epoch_utc": prepared.session.epoch.iso(3),
            "t_s": t,
            "about": about,
            "axis_eci": np.asarray(axis / jnp.linalg.norm(axis)),
            "axis_body": np.asarray(own / jnp.linalg.norm(own)),
            "angle_deg": chosen,
            "convention": CONVENTION,
            "direction_cosines": cosines,
            "quaternion_inertial_from_body": here.fit.quaternion,
            "direct": here.fit.direct,
            "albedo": here.fit.albedo,
            "rms_mA": 1e3 * here.fit.rms,
            "field_body_uT": 1e6 * here.field_body,
            "panels": list(PANEL_NAMES),
            "measured_mA": 1e3 * samples.currents[k],
            "direct_mA": 1e3 * here.direct,
            "albedo_mA": 1e3 * here.albedo,
        }
        write_json(stage / "turn.json", plain(document)[0])
    talk.result(
        f"{prepared.label}: {title[0].lower()}{title[1:]} by {chosen:.4g} deg: residual RMS {rms}",
        f"\nresults in {out}",
        document=out / "turn.json",
    )
    return 0


def _write_csv(path: Path, degrees, scan) -> None:
    """One row an angle: residual, factors, field in body axes, direction cosines."""
    import jax.numpy as jnp
    import numpy as np

    from jaxsat.math import quaternion

    names = ["angle_deg", "rms_mA", "direct", "albedo", *(f"field_{c}_uT" for c in "xyz")]
    names += [f"a{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)]
    cosines = np.asarray(quaternion.to_dcm(jnp.asarray(scan.fit.quaternion))).reshape(len(degrees), 9)
    columns = [degrees, 1e3 * scan.fit.rms, scan.fit.direct, scan.fit.albedo, 1e6 * scan.field_body, cosines]
    np.savetxt(path, np.column_stack(columns), fmt="%.10g", delimiter=",", header=",".join(names), comments="")
