"""The README's example runs as it stands."""

import re
import subprocess
import sys
from pathlib import Path

README = Path(__file__).parent.parent / "README.md"


def test_python_example_runs_and_its_gradient_is_that_of_finite_differences():
    (example,) = re.findall(r"^```python\n(.*?)^```", README.read_text(), flags=re.DOTALL | re.MULTILINE)
    check = """
f, m, h = jax.jit(mean_field_angle), jnp.array([0.3, 0.0, 0.0]), 1e-6
gradient = jax.jit(jax.jacfwd(mean_field_angle))(m)
steps = [(f(m + h * e) - f(m - h * e)) / (2 * h) for e in jnp.eye(3)]
np.testing.assert_allclose(gradient, steps, rtol=1e-4)
"""
    run = subprocess.run([sys.executable, "-c", example + check], capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    assert "(1000, 1, 4)\n[" in run.stdout
