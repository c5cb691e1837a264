"""What a gain, a limit or a mass does to the mean of a metric: slopes of means, with their errors."""

from fitting.sensitivity.means.of_scenario import MetricSlopes as MetricSlopes
from fitting.sensitivity.means.of_scenario import ScenarioSlopes as ScenarioSlopes
from fitting.sensitivity.means.of_scenario import slopes_of_means as slopes_of_means
from fitting.sensitivity.means.pairs import MeanSlopes as MeanSlopes
from fitting.sensitivity.means.pairs import slopes_of_runs as slopes_of_runs
