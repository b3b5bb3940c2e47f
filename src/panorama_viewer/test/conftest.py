import pytest
from serving import answered

from panorama_viewer.server import ViewerServer
from panorama_viewer.settings import ViewerSettings


@pytest.fixture
def serve():
    servers = []

    def start(calibrate=lambda: answered('measured'), watched=lambda: None, tls=None, **settings):
        settings = ViewerSettings(**{'port': 0, 'stale_after_s': 60.0, **settings})
        faults = []
        server = ViewerServer(
            settings,
            calibrate=calibrate,
            watched=watched,
            report=lambda sentence, trace: faults.append(sentence),
            tls=tls,
        )
        server.faults = faults
        servers.append(server)
        server.start()
        return server

    yield start
    for server in servers:
        server.stop()
        assert not server.faults
