import pytest
import support


@pytest.fixture(scope="session")
def model():
    return support.capsule()


@pytest.fixture(scope="session")
def cage(model):
    return support.cage_of(model, target=40)


@pytest.fixture(scope="session")
def bound(model, cage):
    import cagework as cw

    return cw.bind(model.vertices, cage, grid=24)
