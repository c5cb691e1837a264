"""Sweeps: many numbered cases of a scenario, in chunks of fixed shape that are kept as files, resumed and merged."""

from jaxsat.sweep.chunks import ChunkDone as ChunkDone
from jaxsat.sweep.chunks import chunk_path as chunk_path
from jaxsat.sweep.chunks import find_missing as find_missing
from jaxsat.sweep.chunks import run_chunk as run_chunk
from jaxsat.sweep.engines import run_dask as run_dask
from jaxsat.sweep.engines import run_local as run_local
from jaxsat.sweep.history import History as History
from jaxsat.sweep.history import Page as Page
from jaxsat.sweep.merge import merge_cases as merge_cases
from jaxsat.sweep.plan import SweepPlan as SweepPlan
from jaxsat.sweep.plan import claim as claim
from jaxsat.sweep.plan import read_plan as read_plan
from jaxsat.sweep.scenario import Factory as Factory
from jaxsat.sweep.scenario import Metric as Metric
from jaxsat.sweep.scenario import Option as Option
from jaxsat.sweep.scenario import Reader as Reader
from jaxsat.sweep.scenario import Scenario as Scenario
from jaxsat.sweep.scenario import case_keys as case_keys
from jaxsat.sweep.scenario import choice_of as choice_of
from jaxsat.sweep.scenario import chunk_of as chunk_of
from jaxsat.sweep.scenario import number_of as number_of
from jaxsat.sweep.scenario import run_cases as run_cases
from jaxsat.sweep.source import Source as Source
from jaxsat.sweep.summary import MetricSummary as MetricSummary
from jaxsat.sweep.summary import summarise as summarise
