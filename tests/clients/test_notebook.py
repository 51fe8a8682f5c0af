"""The notebook of the documentation runs from end to end against the service."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import nbclient
import nbformat
import pytest
from starlette.testclient import TestClient

ROOT = Path(__file__).parents[2]
_PASSED_ON = ("content-type", "idempotency-key", "prefer", "accept")


@pytest.fixture
def address(client: TestClient) -> Iterator[str]:
    """The tests' own service under an address of this machine."""

    class Forward(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = self.rfile.read(int(self.headers.get("content-length", 0)))
            headers = {name: self.headers[name] for name in _PASSED_ON if self.headers[name]}
            answer = client.request(self.command, self.path, content=body, headers=headers)
            self.send_response(answer.status_code)
            for name in ("content-type", "location", "retry-after"):
                if name in answer.headers:
                    self.send_header(name, answer.headers[name])
            self.send_header("content-length", str(len(answer.content)))
            self.end_headers()
            self.wfile.write(answer.content)

        do_POST = do_GET

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Forward) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def test_the_notebook_designs_draws_and_exports(address, tmp_path, monkeypatch):
    notebook = nbformat.read(ROOT / "docs/design-a-pin.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "committed without outputs"
    monkeypatch.setenv("CRANKWRIGHT_URL", address)
    monkeypatch.setenv("CRANKWRIGHT_FILES", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "clients/python"))
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    told = "".join(
        output.get("text", "") + "".join(output.get("data", {}))
        for cell in notebook.cells
        for output in cell.get("outputs", ())
    )
    assert told.count("It holds.") >= 2 and told.count("image/svg+xml") == 2
    assert (tmp_path / "pin.pdf").read_bytes().startswith(b"%PDF-")
    assert {file.name for file in tmp_path.iterdir()} >= {"pin.pdf", "pin.html", "pin.svg", "pin.dxf"}
