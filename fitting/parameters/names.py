"""Names and units of the motion's start, which every fit has beside the leaves of its satellite."""

STATE = ("attitude.x", "attitude.y", "attitude.z", "rate.x", "rate.y", "rate.z")
"""A small turn of the first attitude about the body axes [deg], and the angular velocity then [deg/s]."""
