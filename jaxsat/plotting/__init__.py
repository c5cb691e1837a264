"""Pictures of a fit and of the preparation before it, as PNG, from plain arrays."""

from jaxsat.plotting.currents import draw_currents as draw_currents
from jaxsat.plotting.direct_attitudes import draw_direct_attitudes as draw_direct_attitudes
from jaxsat.plotting.field_angle import draw_field_angle as draw_field_angle
from jaxsat.plotting.local_attitudes import draw_local_attitudes as draw_local_attitudes
from jaxsat.plotting.parameters import draw_parameters as draw_parameters
from jaxsat.plotting.preparation import draw_coordinates as draw_coordinates
from jaxsat.plotting.preparation import draw_magnetometers as draw_magnetometers
from jaxsat.plotting.preparation import draw_orbit_residuals as draw_orbit_residuals
from jaxsat.plotting.preparation import draw_orbit_stage as draw_orbit_stage
from jaxsat.plotting.preparation import draw_panel_currents as draw_panel_currents
from jaxsat.plotting.space.orbit import draw_orbit as draw_orbit
from jaxsat.plotting.space.turned import draw_turn_in_space as draw_turn_in_space
from jaxsat.plotting.style import png_bytes as png_bytes
from jaxsat.plotting.turn import draw_turn as draw_turn
