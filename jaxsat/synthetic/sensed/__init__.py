"""Twin experiments of any satellite: its file makes telemetry with its truth, and a fit has to find that again."""

from jaxsat.synthetic.sensed.files import write_twin as write_twin
from jaxsat.synthetic.sensed.settings import TwinSettings as TwinSettings
from jaxsat.synthetic.sensed.twin import Twin as Twin
from jaxsat.synthetic.sensed.twin import make_twin as make_twin
