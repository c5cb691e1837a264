"""Control: attitude error, thrusters, Sun pointing."""
