"""Self-contained HTML reports."""

from jaxsat.report.html import Facts as Facts
from jaxsat.report.html import Live as Live
from jaxsat.report.html import Picture as Picture
from jaxsat.report.html import Remarks as Remarks
from jaxsat.report.html import Section as Section
from jaxsat.report.html import Table as Table
from jaxsat.report.html import Verdict as Verdict
from jaxsat.report.html import page as page
