#!/usr/bin/python3
"""make_logs.py FOLDER: writes the recordings of tests/data/logs with the programs that people use.

Debian: python3-rosbag python3-numpy python3-scipy python3-h5py octave. Every file holds the same numbers: sample n of
200, at 200 Hz, has q = sin(0.05 n) and tau = 20 q; the tests have these equations.
"""
import pathlib
import sqlite3
import struct
import subprocess
import sys

import h5py
import numpy
import rosbag
import scipy.io

SAMPLES = 200
STEP_S = 0.005
HEADER = "===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
JOINT_STATE = "Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n" + HEADER


def values(n):
    q = float(numpy.sin(0.05 * n))
    return q, 20.0 * q


def ros1_text(value):
    return struct.pack("<I", len(value)) + value.encode()


class Ros1JointState:
    """Enough of a generated message class for rosbag to write it."""

    _type = "sensor_msgs/JointState"
    _md5sum = "3066dcd76a6cfaef579bd0f34173e9fd"
    _full_text = JOINT_STATE

    def __init__(self, n):
        self.n = n

    def serialize(self, buffer):
        q, tau = values(self.n)
        nanoseconds = round(self.n * STEP_S * 1e9)
        buffer.write(struct.pack("<III", self.n, 100 + nanoseconds // 10**9, nanoseconds % 10**9) + ros1_text("base"))
        buffer.write(struct.pack("<I", 2) + ros1_text("elbow") + ros1_text("wrist"))
        buffer.write(struct.pack("<Idd", 2, q, -q))
        buffer.write(struct.pack("<I", 0))
        buffer.write(struct.pack("<Idd", 2, tau, -tau))


def write_bags(folder):
    import genpy

    for packing in ("none", "bz2", "lz4"):
        with rosbag.Bag(folder / f"joints_{packing}.bag", "w", compression=packing, chunk_threshold=8192) as bag:
            for n in range(SAMPLES):
                bag.write("/joint_states", Ros1JointState(n), genpy.Time.from_sec(100.0 + n * STEP_S))


def cdr_joint_state(n):
    q, tau = values(n)
    nanoseconds = round(n * STEP_S * 1e9)
    body = struct.pack("<iI", 100 + nanoseconds // 10**9, nanoseconds % 10**9)

    def add(body, size, data):
        return body + bytes(-len(body) % size) + data

    for text in ("base",):
        body = add(body, 4, struct.pack("<I", len(text) + 1) + text.encode() + b"\0")
    body = add(body, 4, struct.pack("<I", 2))
    for text in ("elbow", "wrist"):
        body = add(body, 4, struct.pack("<I", len(text) + 1) + text.encode() + b"\0")
    for pair in ((q, -q), (), (tau, -tau)):
        body = add(body, 4, struct.pack("<I", len(pair)))
        if pair:
            body = add(body, 8, struct.pack("<dd", *pair))
    return b"\0\1\0\0" + body


def write_databases(folder):
    """As rosbag2_storage_sqlite3 lays them out, before Iron (no definitions) and since."""
    definition = JOINT_STATE.replace("Header header", "std_msgs/Header header").replace(
        "uint32 seq\ntime stamp", "builtin_interfaces/Time stamp")
    for name, has_definitions in (("humble.db3", False), ("iron.db3", True)):
        path = folder / name
        path.unlink(missing_ok=True)
        with sqlite3.connect(path) as database:
            database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                             "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
            database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
                             "timestamp INTEGER NOT NULL, data BLOB NOT NULL)")
            database.execute("INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr', '')")
            if has_definitions:
                database.execute("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, "
                                 "encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL, "
                                 "type_description_hash TEXT NOT NULL)")
                database.execute("INSERT INTO message_definitions VALUES(1, 'sensor_msgs/msg/JointState', 'ros2msg', "
                                 "?, '')", (definition,))
            for n in range(SAMPLES):
                database.execute("INSERT INTO messages VALUES(?, 1, ?, ?)",
                                 (n + 1, 10**11 + round(n * STEP_S * 1e9), cdr_joint_state(n)))


def write_arrays(folder):
    n = numpy.arange(SAMPLES)
    q = numpy.array([values(i)[0] for i in n])
    tau = 20.0 * q
    columns = {"t_s": STEP_S * n, "q": q, "tau": tau.astype(numpy.float32), "both": numpy.stack([q, tau], axis=1),
               "both_f": numpy.asfortranarray(numpy.stack([q, tau], axis=1)), "count": n.astype(numpy.int16),
               "is_on": n % 2 == 0, "gain": numpy.float64(3.0), "text": numpy.array(["a", "b"]), "z": q + 1j * q}
    numpy.savez(folder / "arrays.npz", **columns)
    numpy.savez_compressed(folder / "packed.npz", **columns)
    scipy.io.savemat(folder / "scipy.mat", {"t_s": STEP_S * n, "log": {"q": q[:, None], "tau": tau.astype(
        numpy.float32)}, "note": "text", "both": numpy.stack([q, tau], axis=1)}, do_compression=True)
    for version in ("4", "6", "7"):
        log = "" if version == "4" else "log = struct('q', q, 'deep', struct('tau', single(tau)));"
        names = "'t_s', 'q'" if version == "4" else "'t_s', 'log', 'count'"
        subprocess.run(["octave-cli", "--norc", "--eval",
                        f"n = (0:{SAMPLES - 1})'; t_s = {STEP_S} * n; q = sin(0.05 * n); tau = 20 * q; "
                        f"count = int16(n); {log} save('-v{version}', '{folder}/octave_v{version}.mat', {names});"],
                       check=True)
    # As MATLAB's -v7.3: HDF5 after 512 bytes of text, and class names that end in NUL.
    path = folder / "matlab_v73.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, column in (("t_s", STEP_S * n), ("q", q)):
            made = file.create_dataset(name, data=column[None, :])
            kind = h5py.h5t.TypeID.copy(h5py.h5t.C_S1)
            kind.set_size(7)
            kind.set_strpad(h5py.h5t.STR_NULLTERM)
            space = h5py.h5s.create(h5py.h5s.SCALAR)
            attribute = h5py.h5a.create(made.id, b"MATLAB_class", kind, space)
            attribute.write(numpy.array(b"double", dtype="S7"))
    head = b"MATLAB 7.3 MAT-file, written by h5py".ljust(116) + bytes(8) + b"\0\2IM"
    with open(path, "r+b") as file:
        file.write(head)


def write_other_arrays(folder):
    """Types and dimensions besides real numbers in one or two dimensions."""
    n = numpy.arange(SAMPLES)
    q = numpy.array([values(i)[0] for i in n])
    tau = 20.0 * q
    both = numpy.stack([q, tau])
    start = numpy.datetime64("2025-04-17T17:00:08", "ns")
    numpy.savez_compressed(
        folder / "types.npz", time=start + (n * 5_000_000).astype("timedelta64[ns]"), q_rad=q.astype(">f8"),
        torque_Nm=tau.astype(">f4"), half_Nm=tau.astype(numpy.float16), count_1=n.astype(">i2"),
        deep=both[:, None, :], deep_f=numpy.asfortranarray(both[:, None, :]), rows=both[:, :, None].transpose(1, 0, 2),
        z=q + 1j * q, note=numpy.array(["a"]), wide=both, cube=numpy.zeros((2, 3, 4)),
        robot=numpy.array([{"name": "x"}], dtype=object), log=numpy.array([(0.0, 1.0)], dtype=[("t", "f8"), ("q", "f8")]))
    scipy.io.savemat(folder / "dimensions.mat", {
        "t_s": STEP_S * n, "deep": {"data": both[:, None, :], "one": tau[None, None, :]}, "z": q + 1j * q,
        "names": numpy.array(["elbow", "wrist"], dtype=object), "note": "text", "cube": numpy.zeros((2, 3, 4)),
        "wide": both}, do_compression=True)


def main():
    folder = pathlib.Path(sys.argv[1])
    write_bags(folder)
    write_databases(folder)
    write_arrays(folder)
    write_other_arrays(folder)


main()
