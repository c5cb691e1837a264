"""Fixed-step integration over tabulated nodes: Runge-Kutta of order 4 and 8, Adams of order 12, and their steps."""

from jaxsat.integrators.adams import AdamsGrid as AdamsGrid
from jaxsat.integrators.adams import integrate_adams as integrate_adams
from jaxsat.integrators.grid import BLOCK as BLOCK
from jaxsat.integrators.grid import StepGrid as StepGrid
from jaxsat.integrators.runge_kutta import integrate as integrate
from jaxsat.integrators.runge_kutta import integrate_blocks as integrate_blocks
from jaxsat.integrators.runge_kutta import nodes_of_steps as nodes_of_steps
from jaxsat.integrators.runge_kutta import staged_step as staged_step
from jaxsat.integrators.runge_kutta import tableau_step as tableau_step
from jaxsat.integrators.step_size import step_for as step_for
from jaxsat.math.runge_kutta import DORMAND_PRINCE_8 as DORMAND_PRINCE_8
from jaxsat.math.runge_kutta import RK4 as RK4
from jaxsat.math.runge_kutta import Tableau as Tableau
