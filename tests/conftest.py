import os
from collections import defaultdict
from pathlib import Path

import pytest

# Names of tests, one a line, that take long although their neighbours with other parameters do not.
LONG = Path(__file__).with_name("long_tests.txt")
# Of a test with more cases than this every tenth one is run, the others are among the slow tests, but for those
# that read files: continuous integration has twelve minutes on two cores.
MOST_CASES = 4
WHOLE = ("test_house.py", "test_layers.py", "test_docs.py", "test_pages.py", "test_site.py", "test_problems.py")
# Two workers share two cores: further threads for small matrices would wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")


def pytest_collection_modifyitems(config, items):
    """Mark the tests that take long; a name in the list that is no test is an error."""
    names = {line for line in LONG.read_text().splitlines() if line}
    # The longest test begins first: at the end the other worker would wait for it.
    items.sort(key=lambda item: item.path.name != "test_campaign.py")
    root = config.rootpath
    found = {item.nodeid: item for item in items}
    for name in names & found.keys():
        found[name].add_marker(pytest.mark.slow)
    cases = defaultdict(list)
    for item in items:
        if item.path.name not in WHOLE and hasattr(item, "callspec"):
            cases[item.path, item.originalname].append(item)
    for group in cases.values():
        for i, item in enumerate(group if len(group) > MOST_CASES else ()):
            if i % 10:
                item.add_marker(pytest.mark.slow)
    whole = not config.option.keyword and config.args == [str(root / "tests")]
    if whole and (gone := names - found.keys()):
        raise pytest.UsageError(f"{LONG.name} names what is no test: {min(gone)}")


@pytest.fixture(scope="session", autouse=True)
def own_machine_code(tmp_path_factory):
    """No machine code is read from a user's folder or written to it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("machine_code")))
        yield
