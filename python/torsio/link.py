"""A joint that is reached over its link: registers, references, telemetry (docs/robot/connect.md).

    from torsio import link

    with link.RemoteJoint(3, host="192.168.2.10") as joint:
        joint["largest_torque_Nm"] = 20.0
        joint.subscribe(["torque_Nm"], rate_Hz=1000)
        joint.enable()
        for _ in range(1000):
            joint.send("torque", torque_Nm=5.0)
            time_s, values = joint.poll(0.001)     # shapes (n,) and (n, 1)
        joint.disable()

Python does not keep a period of a millisecond: the joint repeats the last reference until its age is `valid_s`.
"""

from ._core import RemoteJoint, find_joints

RemoteJoint.__module__ = "torsio.link"
find_joints.__module__ = "torsio.link"

__all__ = ["RemoteJoint", "find_joints"]
