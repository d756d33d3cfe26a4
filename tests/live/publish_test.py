"""Both outputs of `torsio connect publish` at the same time, against a recording of the same joints: publish_test.py TORSIO

Twelve simulated joints. The WebSocket client is a few lines on a socket, so that nothing has to be installed."""

import base64
import csv
import json
import math
import os
import pathlib
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

TORSIO = str(pathlib.Path(sys.argv[1]).resolve())
JOINTS = 12
LONGEST_S = 60.0  # on a busy machine


def free_ports(count):
    """Ports that are free now for UDP and for TCP, each once."""
    ports, sockets = [], []
    while len(ports) < count:
        datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        stream = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        sockets += datagrams, stream
        datagrams.bind(("127.0.0.1", 0))
        port = datagrams.getsockname()[1]
        try:
            stream.bind(("127.0.0.1", port))
        except OSError:
            continue
        ports.append(port)
    for each in sockets:
        each.close()
    return ports


class WebSocket:
    def __init__(self, test, port, subprotocols, receive_buffer_B=None):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if receive_buffer_B:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer_B)
        self.socket.settimeout(LONGEST_S)
        self.socket.connect(("127.0.0.1", port))
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(
            f"GET / HTTP/1.1\r\nHost: localhost:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            f"Sec-WebSocket-Protocol: {subprotocols}\r\n\r\n".encode()
        )
        test.addCleanup(self.socket.close)
        self.received = b""
        while b"\r\n\r\n" not in self.received:
            self.received += self.socket.recv(4096)
        head, self.received = self.received.split(b"\r\n\r\n", 1)
        self.head = head.decode()

    def take(self, size):
        while len(self.received) < size:
            more = self.socket.recv(1 << 16)
            if not more:
                raise EOFError
            self.received += more
        taken, self.received = self.received[:size], self.received[size:]
        return taken

    def message(self):
        """Opcode and payload of the next one."""
        first, size = self.take(2)
        if size == 126:
            (size,) = struct.unpack("!H", self.take(2))
        elif size == 127:
            (size,) = struct.unpack("!Q", self.take(8))
        return first & 15, self.take(size)

    def send(self, opcode, payload):
        assert len(payload) < 65536
        size = struct.pack("!BH", 0x80 | 126, len(payload))
        self.socket.sendall(bytes([0x80 | opcode]) + size + bytes(4) + payload)

    def subscribe(self, channels):
        subscriptions = [{"id": 100 + each, "channelId": each} for each in channels]
        self.send(1, json.dumps({"op": "subscribe", "subscriptions": subscriptions}).encode())


class Publish(unittest.TestCase):
    def start(self, *arguments, **options):
        process = subprocess.Popen([TORSIO, *map(str, arguments)], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True, **options)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        return process

    def end(self, process):
        process.send_signal(signal.SIGINT)
        return process.communicate(timeout=LONGEST_S)

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.port, self.host, self.other_host, self.plotjuggler, self.foxglove = free_ports(5)
        self.joints = self.start("joint", *["dfki-50"] * JOINTS, "--port", self.port,
                                 "--host-port", self.host,
                                 "--allow", f"127.0.0.1:{self.host}",
                                 "--allow", f"127.0.0.1:{self.other_host}")
        self.addCleanup(lambda: self.end(self.joints))
        self.line = ["--port", self.port]

    def publish(self, *arguments):
        process = self.start("connect", "publish", *self.line, "--host-port", self.host,
                             "--timeout", "1s", "--joints", f"1-{JOINTS}",
                             "--plotjuggler", f"127.0.0.1:{self.plotjuggler}",
                             "--foxglove", self.foxglove, *arguments)
        for line in process.stderr:
            if line.startswith(("torsio: Foxglove", "Foxglove")):
                return process
        self.fail(process.communicate())

    def test_both_outputs_have_the_values_that_a_recording_has(self):
        datagrams = []
        reader = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        reader.bind(("127.0.0.1", self.plotjuggler))
        reader.settimeout(0.2)
        ends = threading.Event()

        def read_datagrams():
            while not ends.is_set():
                try:
                    datagrams.append(reader.recv(65536))
                except TimeoutError:
                    pass

        thread = threading.Thread(target=read_datagrams)
        thread.start()
        self.addCleanup(lambda: (ends.set(), thread.join(), reader.close()))
        publish = self.publish("--rate", "200Hz", "--json", self.folder / "sent.json")
        clients = [WebSocket(self, self.foxglove, "foxglove.websocket.v1"),
                   WebSocket(self, self.foxglove, "foxglove.sdk.v1, foxglove.websocket.v1")]
        self.assertRegex(clients[1].head, "(?i)sec-websocket-protocol: foxglove.sdk.v1")
        topics = {}
        for each in clients:
            self.assertEqual(json.loads(each.message()[1])["op"], "serverInfo")
            channels = json.loads(each.message()[1])["channels"]
            self.assertEqual(len(channels), JOINTS)
            topics = {channel["id"]: channel["topic"] for channel in channels}
            self.assertEqual({channel["encoding"] for channel in channels}, {"json"})
            self.assertEqual(json.loads(channels[0]["schema"])["type"], "object")
            each.subscribe(topics)
        record = self.start("connect", "record", *self.line, "--host-port", self.other_host, "--id", 200,
                            "--timeout", "1s", "--joint", 5, "--for", "1s",
                            "-o", self.folder / "joint5.csv")
        # Until the recording has ended, so that its samples are among those of the clients.
        streams = [{}, {}]
        while record.poll() is None or any(len(each) < 100 * JOINTS for each in streams):
            for each, stream in zip(clients, streams):
                opcode, payload = each.message()
                self.assertEqual(opcode, 2)
                kind, subscription, time_ns = struct.unpack("<BIQ", payload[:13])
                self.assertEqual(kind, 1)
                self.assertEqual(time_ns % 1000, 0)
                stream[topics[subscription - 100], time_ns // 1000] = json.loads(payload[13:])
        self.assertEqual(record.returncode, 0, record.communicate())
        _, problem = self.end(publish)
        self.assertEqual(publish.returncode, 0, problem)
        ends.set()
        thread.join()
        plotted = {}
        for each in datagrams:
            sample = json.loads(each)
            time_us = round(1e6 * sample.pop("timestamp"))
            ((name, values),) = sample.items()
            plotted["/" + name, time_us] = values
        for stream in streams:
            common = stream.keys() & plotted.keys()
            # Datagrams may be lost on a busy machine.
            self.assertGreater(len(common), len(stream) // 2)
            for key in common:  # floats are equal only if every bit is
                self.assertEqual(stream[key], plotted[key])
        # The recording has each millisecond, and the times of the joint's clock: samples are found by their values.
        with open(self.folder / "joint5.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        names = [name for name in rows[0] if name != "t_s"]

        def values(row):
            numbers = (float(row[name]) for name in names)
            return tuple(number if math.isfinite(number) else None for number in numbers)

        # Rows of lost datagrams have no values.
        written = [(values(row), n) for n, row in enumerate(rows) if math.isfinite(float(row[names[0]]))]
        milliseconds = dict(written)
        self.assertEqual(len(milliseconds), len(written))
        self.assertGreater(len(written), len(rows) // 2)
        found = {}
        for stream in streams:
            for (topic, time_us), sample in stream.items():
                n = milliseconds.get(tuple(sample.get(name) for name in names))
                if topic == topics[5] and n is not None:
                    found[time_us] = n
        self.assertGreater(len(found), 100)
        shifts = sorted(round(time_us / 1000) - n for time_us, n in found.items())
        usual = shifts[len(shifts) // 2]
        # Rounding of a late cycle; a busy machine may delay a few by more.
        self.assertGreater(sum(abs(each - usual) <= 1 for each in shifts), 0.95 * len(shifts))
        sent = json.loads((self.folder / "sent.json").read_text())
        self.assertEqual(sent["clients"], 2)
        self.assertEqual(sent["dropped"], 0)
        self.assertEqual(len(sent["joints"]), JOINTS)

    def test_a_client_that_does_not_read_is_dropped_and_the_other_goes_on(self):
        publish = self.publish("--json", "-")
        stalled = WebSocket(self, self.foxglove, "foxglove.sdk.v1", receive_buffer_B=4096)
        stalled.subscribe(range(1, JOINTS + 1))
        good = WebSocket(self, self.foxglove, "foxglove.sdk.v1")
        good.subscribe([1])
        good.send(1, b"{")
        good.send(1, b'{"op": "getParameters"}')
        statuses, samples = [], 0
        end = time.monotonic() + 6.0
        while time.monotonic() < end:
            opcode, payload = good.message()
            if opcode == 1 and b'"status"' in payload:
                statuses.append(json.loads(payload)["message"])
            samples += opcode == 2
        output, _ = self.end(publish)
        self.assertEqual(len(statuses), 2)
        self.assertIn("getParameters: not offered", statuses[1])
        counts = json.loads(output)
        self.assertEqual(counts["clients"], 2)
        self.assertEqual(counts["dropped"], 1)
        self.assertGreater(samples, 1000)

    def test_a_page_of_another_origin_is_refused_and_named(self):
        process = self.publish()
        answer = socket.create_connection(("127.0.0.1", self.foxglove), timeout=LONGEST_S)
        answer.sendall(
            f"GET / HTTP/1.1\r\nHost: localhost:{self.foxglove}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Origin: https://app.foxglove.dev\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n".encode()
        )
        self.assertIn(b" 403 ", answer.recv(4096))
        answer.close()
        _, problem = self.end(process)
        self.assertIn("--origins https://app.foxglove.dev", problem)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:], verbosity=2)
