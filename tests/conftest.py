import pytest


@pytest.fixture(scope="session", autouse=True)
def own_machine_code(tmp_path_factory):
    """No machine code is read from a user's folder or written to it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("machine_code")))
        yield
