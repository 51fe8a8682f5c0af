"""One running application for all tests of the edge."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from starlette.testclient import TestClient

from app.designs.kind import Mode
from app.designs.registry import KINDS
from tests.app.serving import serving


@pytest.fixture(scope="session")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with serving(tmp_path_factory.mktemp("service")) as running:
        yield running


@pytest.fixture
def check_request() -> dict:
    return KINDS["flexible-rod"].example(Mode.CHECK)


@pytest.fixture
def design_request() -> dict:
    return KINDS["flexible-rod"].example(Mode.DESIGN)
