"""What a verdict says beside its word: what data and priors think of the numbers."""

from fitting.outcome.verdict import FAR_OFF, HELD_BY_PRIOR, Evidence, judge


def remarks(no_body: bool = False, **notes: str) -> tuple[str, ...]:
    evidence = Evidence(
        cost=100.0,
        promise=0.0,
        ratio=1.0,
        hopeless=False,
        channels={},
        alternatives=(),
        attitude_sigma_deg=0.1,
        notes=notes,
        held_out=True,
        no_body=no_body,
    )
    status, verdict, _, found = judge(evidence)
    assert (status, verdict) == ("converged", "predicts")
    return found


def test_nothing_to_remark():
    assert remarks() == ()


def test_numbers_far_from_the_file_and_those_that_nothing_sees_are_told_together():
    found = remarks(a=FAR_OFF, b=HELD_BY_PRIOR, c=FAR_OFF, d="at its bound", e=HELD_BY_PRIOR)
    held, far, bound = found
    assert held == "held by their priors, the data say nothing of them: b, e"
    assert far.startswith("further from the file's values than its sigmas allow: a, c; look at ")
    assert bound == "d is at its bound"


def test_what_no_body_and_no_panel_is_like_is_told():
    found = remarks(no_body=True, **{"gains.-z": "at zero: a panel without light"})
    assert found == (
        "the inertia tensor is not that of a body (triangle inequality)",
        "gains.-z is at zero: a panel without light",
    )
