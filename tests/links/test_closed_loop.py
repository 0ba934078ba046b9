"""The arm that is planned again and again, as the script flies it."""

import re
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
def test_an_arm_with_an_unknown_payload_reaches_its_goal_if_it_is_planned_again():
    script = Path(__file__).parents[2] / "scripts" / "arm_loop.py"
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    off = [[float(x) for x in pair] for pair in re.findall(r"off by (\S+) rad and (\S+) rad/s", done.stdout)]
    (once, _), (again, rate) = off
    assert once > 0.5 and again < 0.03 and rate < 0.05
    plans, iterations = re.search(r"(\d+) plans, .* (\d+) iterations", done.stdout).groups()
    assert int(plans) == 20 and int(iterations) <= 10
