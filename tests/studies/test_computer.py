"""`dmoc doctor` says what is here and what is not, without noise."""

import pytest

from dmoc.reports.tables import findings_table
from dmoc.reports.words import console
from dmoc.studies.computer import LINEAR_SOLVERS, PACKAGES, benchmark, examine, try_linear_solver


def test_a_linear_solver_is_here_if_it_solves(capfd):
    mumps = try_linear_solver("mumps")
    assert mumps.works and mumps.full_name.startswith("MUMPS") and mumps.ipopt.startswith("3.")
    assert not try_linear_solver("abacus").works
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_the_table_names_everything(capsys):
    found = examine(seconds=0.0)
    assert set(PACKAGES) < set(found.versions) and found.cores >= 1
    assert [solver.name for solver in found.linear_solvers] == list(LINEAR_SOLVERS)
    console().print(findings_table(found))
    shown = capsys.readouterr().out
    for word in ("casadi 3.", "ipopt 3.", "MUMPS", "C compiler", "cores", "machine code"):
        assert word in shown


@pytest.mark.parametrize(("order", "steps"), [(2, 40), (8, 6)])
def test_the_benchmark_gives_medians(order, steps):
    timing = benchmark(order, steps, 0.0)
    assert (timing.order, timing.steps, timing.runs) == (order, steps, 3)
    assert 0 < timing.build_s < 5 and 0 < timing.solve_s < 5
