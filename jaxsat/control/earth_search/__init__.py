"""Earth search with four horizon sensors (Melnikov et al. 2022)."""

from jaxsat.control.earth_search.cases import Cases as Cases
from jaxsat.control.earth_search.cases import run_cases as run_cases
from jaxsat.control.earth_search.cases import run_one as run_one
from jaxsat.control.earth_search.draw import Dispersions as Dispersions
from jaxsat.control.earth_search.draw import draw_cases as draw_cases
from jaxsat.control.earth_search.law import EarthSearchLaw as EarthSearchLaw
from jaxsat.control.earth_search.law import search_law as search_law
from jaxsat.control.earth_search.loop import LoopSettings as LoopSettings
from jaxsat.control.earth_search.loop import LoopState as LoopState
from jaxsat.control.earth_search.loop import Sample as Sample
from jaxsat.control.earth_search.vehicle import EarthSearchVehicle as EarthSearchVehicle
from jaxsat.control.earth_search.vehicle import nominal_vehicle as nominal_vehicle
