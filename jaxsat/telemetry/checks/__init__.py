"""What is odd about a session before any fit: stamps, sizes, light, angles, against what the orbit says."""

from jaxsat.telemetry.checks.finding import Finding as Finding
from jaxsat.telemetry.checks.whole import SessionCheck as SessionCheck
from jaxsat.telemetry.checks.whole import check_session as check_session
