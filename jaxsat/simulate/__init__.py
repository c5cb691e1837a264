"""Attitude motion: within a tolerance at any times, of many satellites at once, or over a grid that is given."""

from jaxsat.simulate.many import simulate_many as simulate_many
from jaxsat.simulate.on_grid import Trajectory as Trajectory
from jaxsat.simulate.on_grid import attitude_step as attitude_step
from jaxsat.simulate.on_grid import simulate_on_grid as simulate_on_grid
from jaxsat.simulate.sensitivities import Derivatives as Derivatives
from jaxsat.simulate.sensitivities import Sensitivities as Sensitivities
from jaxsat.simulate.single import simulate as simulate
from jaxsat.simulate.turns import past_turns as past_turns
from jaxsat.simulate.turns import rod_fields as rod_fields
