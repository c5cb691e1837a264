"""What a fit returns: plain NumPy, ready for JSON, CSV, tables and pictures. A failure is a value."""

from dataclasses import dataclass

CONVERGED, NOT_CONVERGED, AMBIGUOUS = "converged", "not_converged", "ambiguous"


@dataclass(frozen=True)
class FittedParameter:
    """One scalar of the model in the unit of its name, with its 1-sigma where it was free."""

    name: str
    value: float
    sigma: float | None
    unit: str
    free: bool
    note: str = ""
    """Such as `held by its prior`, empty where there is nothing to say."""
