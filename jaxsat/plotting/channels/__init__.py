"""Pictures of a fit of any sensors: a channel's readings, the motion, what parameters buy."""

from jaxsat.plotting.channels.motion import draw_motion as draw_motion
from jaxsat.plotting.channels.readings import Readings as Readings
from jaxsat.plotting.channels.readings import draw_readings as draw_readings
from jaxsat.plotting.channels.timeline import Timeline as Timeline
from jaxsat.plotting.channels.timeline import column_colours as column_colours
from jaxsat.plotting.channels.worth import draw_worth as draw_worth
