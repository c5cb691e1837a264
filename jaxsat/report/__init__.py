"""Self-contained HTML reports."""

from jaxsat.report.html import Verdict as Verdict
from jaxsat.report.html import page as page
from jaxsat.report.sections import Contents as Contents
from jaxsat.report.sections import Facts as Facts
from jaxsat.report.sections import Folded as Folded
from jaxsat.report.sections import KeyNumbers as KeyNumbers
from jaxsat.report.sections import Lead as Lead
from jaxsat.report.sections import Link as Link
from jaxsat.report.sections import Live as Live
from jaxsat.report.sections import Picture as Picture
from jaxsat.report.sections import Remarks as Remarks
from jaxsat.report.sections import Section as Section
from jaxsat.report.sections import Table as Table
from jaxsat.report.sections import sentence as sentence
