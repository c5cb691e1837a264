"""What of a table a fit takes."""

from pathlib import Path

import numpy as np
import pytest

from fitting.measurements.assembly import channels_within
from jaxsat.errors import InputError
from jaxsat.telemetry import Channel, TableSession
from jaxsat.time import Epoch


def channel(name, t_s):
    values = np.ones((len(t_s), 3))
    return Channel(name, np.asarray(t_s, float), values, 1.0, "1", 1.0, None, ("x", "y", "z"))


SESSION = TableSession(
    paths=(Path("pass.csv"),),
    sha256=("",),
    epoch=Epoch.from_iso("2021-05-01T00:00:00Z"),
    channels={"mag": channel("mag", range(100)), "star": channel("star", [0, 50, 99])},
    columns={},
    rejections=(),
    remarks=(),
)


def test_a_channel_without_a_reading_in_the_arc_is_left_out():
    assert {name: len(each.t_s) for name, each in channels_within(SESSION, None).items()} == {"mag": 100, "star": 3}
    assert {name: len(each.t_s) for name, each in channels_within(SESSION, (10.0, 50.0)).items()} == {
        "mag": 41,
        "star": 1,
    }
    assert {name: len(each.t_s) for name, each in channels_within(SESSION, (10.0, 40.0)).items()} == {"mag": 31}
    with pytest.raises(InputError, match="no sample between 200 and 300 s"):
        channels_within(SESSION, (200.0, 300.0))
