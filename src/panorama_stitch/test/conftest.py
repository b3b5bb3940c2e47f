import pytest
from serving import answered

from panorama_stitch.viewer_server import ViewerServer
from panorama_stitch.viewer_settings import ViewerSettings


@pytest.fixture
def serve():
    servers = []

    def start(calibrate=lambda: answered('measured'), watched=lambda: None, **settings):
        settings = ViewerSettings(**{'port': 0, 'stale_after_s': 60.0, **settings})
        faults = []
        server = ViewerServer(
            settings,
            calibrate=calibrate,
            watched=watched,
            report=lambda sentence, trace: faults.append(sentence),
        )
        server.faults = faults
        servers.append(server)
        server.start()
        return server

    yield start
    for server in servers:
        server.stop()
        assert not server.faults
