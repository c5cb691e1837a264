"""What drives the results of a sweep, or of any function of random inputs: variance and derivatives."""

from fitting.sensitivity.sweeps.derivatives import DerivativeMeasures as DerivativeMeasures
from fitting.sensitivity.sweeps.derivatives import derivative_measures as derivative_measures
from fitting.sensitivity.sweeps.indices import OutputIndices as OutputIndices
from fitting.sensitivity.sweeps.indices import dependences as dependences
from fitting.sensitivity.sweeps.indices import sobol_indices as sobol_indices
from fitting.sensitivity.sweeps.report import write_sweep_indices as write_sweep_indices
from fitting.sensitivity.sweeps.table import holds_sweep as holds_sweep
from fitting.sensitivity.sweeps.table import read_sweep as read_sweep
