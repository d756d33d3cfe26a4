"""python-can's own client drives the joints of `torsio joint --can udp_multicast`: can_client_test.py TORSIO

Exit code 77: python3-can or its msgpack is not installed, or this machine has no multicast; the reason is printed.
"""

import math
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

SKIPPED = 77
GROUP = "239.74.163.2"  # UdpMulticastBus.DEFAULT_GROUP_IPv4
LONGEST_S = 30.0  # on a busy machine
CLOSED_LOOP, IDLE = 8, 1
BUSY, DISARMED, INVALID_STATE = 1, 3, 13
WATCHDOG_TIMER_EXPIRED, ESTOP_REQUESTED = 0x01000000, 0x02000000

try:
    import can
    import msgpack  # noqa: F401
except ImportError as error:
    print(f"skipped: {error}; install python3-can and python3-msgpack")
    sys.exit(SKIPPED)


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def has_multicast():
    port = free_port()
    try:
        with can.Bus(GROUP, interface="udp_multicast", port=port) as one:
            with can.Bus(GROUP, interface="udp_multicast", port=port) as other:
                one.send(can.Message(arbitration_id=1, is_extended_id=False))
                return other.recv(2.0) is not None
    except (OSError, can.CanError):
        return False


class Drive:
    """A node of CANSimple, as a program for an ODrive would use it."""

    def __init__(self, bus, node):
        self.bus = bus
        self.node = node

    def send(self, command, layout="", *values):
        self.bus.send(
            can.Message(
                arbitration_id=self.node << 5 | command,
                data=struct.pack("<" + layout, *values),
                is_extended_id=False,
            )
        )

    def hear(self, command, layout, longest_s=LONGEST_S):
        """The next frame of that command from the node."""
        latest = time.monotonic() + longest_s
        while time.monotonic() < latest:
            message = self.bus.recv(0.1)
            if message is None or message.is_remote_frame or message.is_extended_id:
                continue
            if message.arbitration_id == self.node << 5 | command and message.dlc == struct.calcsize("<" + layout):
                return struct.unpack("<" + layout, message.data)
        raise AssertionError(f"no frame of command {command:#x} within {longest_s} s")

    def drain(self):
        while self.bus.recv(0) is not None:
            pass

    def ask(self, command, layout):
        """By a remote frame. The bus also gives this program its own frames, and cyclic ones from before."""
        self.drain()
        self.bus.send(
            can.Message(
                arbitration_id=self.node << 5 | command, is_remote_frame=True, dlc=8, is_extended_id=False
            )
        )
        return self.hear(command, layout)

    def heartbeat(self):
        error, state, result, done, _ = self.ask(0x01, "IBBBB")
        return {"error": error, "state": state, "result": result, "done": done}

    def waits_for(self, is_so):
        latest = time.monotonic() + LONGEST_S
        while time.monotonic() < latest:
            found = self.heartbeat()
            if is_so(found):
                return found
        raise AssertionError(f"last heartbeat: {found}")

    def estimates(self):
        return self.ask(0x09, "ff")

    def position(self, turns, speed_ff=0.0, torque_ff_Nm=0.0):
        self.send(0x0C, "fhh", turns, round(1000 * speed_ff), round(1000 * torque_ff_Nm))

    def mode(self, control, passthrough=1):
        self.send(0x0B, "II", control, passthrough)

    def state(self, wanted):
        self.send(0x07, "I", wanted)


class PythonCan(unittest.TestCase):
    rate = "100Hz"

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.port = free_port()
        self.daemon = subprocess.Popen(
            [TORSIO, "joint", "3=dfki-50", "--can", f"udp_multicast:{GROUP}:{self.port}", "--can-rate", self.rate,
             "--unix", os.path.join(self.folder.name, "joint"), "--watchdog", "1s",
             "--json", os.path.join(self.folder.name, "run.json")],
            stdout=subprocess.PIPE, text=True)  # fmt: skip
        self.addCleanup(self.end)
        self.bus = can.Bus(GROUP, interface="udp_multicast", port=self.port)
        self.addCleanup(self.bus.shutdown)
        self.drive = Drive(self.bus, 3)
        self.drive.hear(0x01, "IBBBB")
        self.drive.waits_for(lambda found: found["error"] == 0)

    def end(self):
        if self.daemon.poll() is None:
            self.daemon.send_signal(signal.SIGTERM)
        self.daemon.communicate(timeout=LONGEST_S)

    def start(self, control=3):
        self.drive.mode(control)
        self.drive.state(CLOSED_LOOP)
        self.drive.waits_for(lambda found: found["state"] == CLOSED_LOOP)

    def stream(self, duration_s, send):
        end = time.monotonic() + duration_s
        while time.monotonic() < end:
            send()
            time.sleep(0.01)

    def test_follows_positions_with_inertia(self):
        self.start()
        self.assertEqual(self.drive.heartbeat()["result"], BUSY)
        self.stream(0.03, lambda: self.drive.position(0.05))
        first, _ = self.drive.estimates()
        self.assertLess(first, 0.049, "a mirror would be there at once")
        self.stream(1.5, lambda: self.drive.position(0.05))
        turns, speed = self.drive.estimates()
        self.assertAlmostEqual(turns, 0.05, delta=0.002)
        self.assertAlmostEqual(speed, 0.0, delta=0.02)
        _, torque_Nm = self.drive.ask(0x1C, "ff")
        # A quarter of the rated torque at a right angle, here at 0.05 turns.
        self.assertAlmostEqual(torque_Nm, 12.5 * math.sin(2 * math.pi * turns), delta=2.0)
        wanted_A, measured_A = self.drive.ask(0x14, "ff")
        self.assertAlmostEqual(wanted_A, measured_A, delta=0.5)
        voltage, _ = self.drive.ask(0x17, "ff")
        self.assertGreater(voltage, 10.0)

    def test_follows_velocities(self):
        self.start(2)
        self.stream(1.2, lambda: self.drive.send(0x0D, "ff", 0.1, 0.0))
        _, speed = self.drive.estimates()
        self.assertAlmostEqual(speed, 0.1, delta=0.03)

    def test_follows_torques(self):
        self.start(1)
        largest_Nm = 0.0
        end = time.monotonic() + 2.0
        while time.monotonic() < end:
            self.drive.send(0x0E, "f", 3.0)
            wanted_Nm, torque_Nm = self.drive.ask(0x1C, "ff")
            largest_Nm = max(largest_Nm, torque_Nm)
        self.assertEqual(wanted_Nm, 3.0)
        self.assertGreater(largest_Nm, 2.0)  # the lever swings

    def test_stops_and_clears_its_errors(self):
        self.start()
        self.drive.send(0x02)
        found = self.drive.waits_for(lambda found: found["state"] == IDLE)
        self.assertEqual(found["error"], ESTOP_REQUESTED)
        self.assertEqual(found["result"], DISARMED)
        self.assertEqual(self.drive.ask(0x03, "II"), (ESTOP_REQUESTED, ESTOP_REQUESTED))
        self.drive.state(CLOSED_LOOP)
        self.assertEqual(self.drive.heartbeat()["state"], IDLE)

        def clears(found):
            self.drive.send(0x18, "B", 0)  # refused while the joint moves
            return found["error"] == 0

        self.drive.waits_for(clears)
        self.start()

    def test_stops_when_its_host_is_silent(self):
        self.start()
        found = self.drive.waits_for(lambda found: found["state"] == IDLE)
        self.assertEqual(found["error"], WATCHDOG_TIMER_EXPIRED)

    def test_refuses_other_states_and_wrong_frames(self):
        self.drive.state(3)
        found = self.drive.waits_for(lambda found: found["result"] == INVALID_STATE)
        self.assertEqual(found["state"], IDLE)
        self.bus.send(can.Message(arbitration_id=0x1234567, is_extended_id=True, data=b"\x08\0\0\0"))
        self.bus.send(can.Message(arbitration_id=3 << 5 | 7, is_extended_id=False, is_fd=True, data=b"\x08\0\0\0"))
        self.bus.send(can.Message(arbitration_id=0x7E7, is_extended_id=False, data=b"\x08\0\0\0"))
        self.bus.send(can.Message(arbitration_id=4 << 5 | 7, is_extended_id=False, data=b"\x08\0\0\0"))
        self.drive.send(0x07, "H", 8)
        self.drive.send(0x16, "B", 0)
        self.drive.send(0x0E, "f", math.nan)
        self.assertEqual(self.drive.heartbeat()["state"], IDLE)


class PythonCanOnRequest(PythonCan):
    """Without cyclic frames of position, current and torque."""

    rate = "0Hz"


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: can_client_test.py TORSIO")
    TORSIO = sys.argv.pop()
    if not has_multicast():
        print(f"skipped: no frame arrives by the multicast group {GROUP} on this machine")
        sys.exit(SKIPPED)
    unittest.main()
