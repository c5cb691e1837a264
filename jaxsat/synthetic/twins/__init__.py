"""Twin experiments of any satellite: its file makes telemetry with its truth, and a fit has to find that again."""

from jaxsat.synthetic.twins.files import write_twin as write_twin
from jaxsat.synthetic.twins.settings import TwinSettings as TwinSettings
from jaxsat.synthetic.twins.settings import twin_settings as twin_settings
from jaxsat.synthetic.twins.twin import Twin as Twin
from jaxsat.synthetic.twins.twin import make_twin as make_twin
