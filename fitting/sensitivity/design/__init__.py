"""Designs that lower a chosen sigma: when to sample and where sensors look, by derivatives of the sigma itself.

And those that lower a mean by slopes which have errors (`descended`; `fitting.sensitivity.means`).
"""

from fitting.sensitivity.design.aim import ATTITUDE as ATTITUDE
from fitting.sensitivity.design.aim import Aim as Aim
from fitting.sensitivity.design.aim import aim_of as aim_of
from fitting.sensitivity.design.aim import squared_sigma as squared_sigma
from fitting.sensitivity.design.descent import descended as descended
from fitting.sensitivity.design.sensors import best_directions as best_directions
from fitting.sensitivity.design.sensors import sigma_of_sensors as sigma_of_sensors
from fitting.sensitivity.design.times import Candidates as Candidates
from fitting.sensitivity.design.times import Weights as Weights
from fitting.sensitivity.design.times import best_weights as best_weights
from fitting.sensitivity.design.times import whole_samples as whole_samples
