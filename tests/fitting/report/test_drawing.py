"""Pictures by a process of their own: the same as here, whatever becomes of it."""

import numpy as np
import pytest

from fitting.report.fit.drawing import DrawingProcess, draw_all
from tests.fitting.report.made_up_fit import make_fit_result


def test_another_process_draws_the_same_raises_the_same_and_may_be_lost():
    result = make_fit_result()
    here = draw_all(result, "pass", None, ())
    with DrawingProcess() as draw:
        assert draw(result, "pass", None, ()) == here
        with pytest.raises(IndexError):
            draw(make_fit_result(t_s=np.zeros(3)), "pass", None, ())
        assert draw(result, "other", None, ()) != here
        draw._process.kill()
        assert draw(result, "pass", None, ()) == here
    assert not draw._process.is_alive()
