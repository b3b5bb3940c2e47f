"""Quality of service, one profile for each kind of topic."""

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

IMAGE = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
"""Images as they are published: nothing is lost on the way, and only the newest waits."""

IMAGE_INPUT = QoSProfile(depth=3, reliability=ReliabilityPolicy.RELIABLE)
"""Images as they are taken: a moment without the processor loses none."""

VIDEO = QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE)
"""Video as it is published: one that is lost breaks those after it, so a few are sent again."""

VIDEO_INPUT = QoSProfile(depth=30, reliability=ReliabilityPolicy.RELIABLE)
"""Video as it is taken: all of it has to be decoded, and that is quick."""

BEST_EFFORT_INPUT = QoSProfile(depth=3, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Where the publisher is not ours: this meets a reliable one and a best-effort one."""

COMMAND = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
"""What is told once has to arrive, and only the last counts."""

SENSOR_INPUT = QoSProfile(depth=20, reliability=ReliabilityPolicy.BEST_EFFORT)
"""What comes by the hundred a second: a moment without the processor loses none, and after a
longer one the newest are what counts."""

LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""State: who comes later still gets the last one."""

LATCHED_INPUT = QoSProfile(
    depth=30, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""State that may come with each picture: none is lost before its picture is handled."""

HEARTBEAT = QoSProfile(depth=10, deadline=Duration(seconds=3))
"""What comes once a second, and promises to."""

ADJUSTABLE = QoSOverridingOptions((QoSPolicyKind.RELIABILITY, QoSPolicyKind.DEPTH))
"""What a parameter such as `qos_overrides.TOPIC.subscription.depth` may change."""
