import threading

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
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


@pytest.fixture
def ros():
    """Return a context whose nodes, once added to the executor, spin in a thread."""

    class Ros:
        context = rclpy.Context()
        nodes = ()

        def __init__(self):
            rclpy.init(context=self.context)
            self.executor = SingleThreadedExecutor(context=self.context)
            self.is_done = False
            self.thread = threading.Thread(target=self.spin)

        def start(self, *nodes):
            self.nodes = nodes
            for node in nodes:
                self.executor.add_node(node)
            self.thread.start()

        def spin(self):
            while not self.is_done:
                self.executor.spin_once(timeout_sec=0.05)

        def stop(self):
            self.is_done = True
            if self.nodes:
                self.thread.join()
            for node in self.nodes:
                node.destroy_node()
            self.executor.shutdown()
            rclpy.shutdown(context=self.context)

    ros = Ros()
    yield ros
    ros.stop()
