"""As `contract/test_schemathesis.py`, with the routes of all parameters and more requests."""

import pytest
from schemathesis import GenerationMode

from contract.test_schemathesis import check_responses
from e2e.servers import running
from hornbill.schema.catalog import Catalog


@pytest.mark.parametrize(("mode", "examples"), [(GenerationMode.POSITIVE, 2), (GenerationMode.NEGATIVE, 1)])
def test_every_response_is_as_documented(mode: GenerationMode, examples: int) -> None:
    with running("demo", "--servos", "2", "--seed", "1") as server:
        server.ready(2)
        check_responses(server, mode, examples=examples, rows=Catalog.load().parameters)
