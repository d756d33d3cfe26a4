"""Stores of studies for tools/fleet_trial and tools/slurm_cluster: a PostgreSQL server of their own, or a SQLite file."""
import contextlib
import os
import pathlib
import pwd
import shutil
import socket
import sqlite3
import subprocess
import tempfile
import urllib.parse


class StoreDown(Exception):
    """The server does not take a question now, or a process holds the whole file."""


def newest_programs():
    """The folder of initdb; None: PostgreSQL's server is not installed."""
    found = sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    return found[-1].parent if found else None


def free_port():
    with socket.socket() as connection:
        connection.bind(("127.0.0.1", 0))
        return connection.getsockname()[1]


class Postgresql:
    """A server in a folder under /tmp. PostgreSQL refuses to run as root: then it runs as the user of Debian's package.

    fsync is on, as in any real server: the times of a study and what is left after a crash depend on it.
    """
    name = "PostgreSQL"

    def __init__(self):
        self.programs = newest_programs()
        if self.programs is None:
            raise SystemExit("there is no PostgreSQL server on this machine: apt-get install postgresql")
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="torsio-fleet-postgresql-", dir="/tmp"))
        self.port = free_port()
        self.url = f"postgresql://fleet:secret@127.0.0.1:{self.port}/postgres"
        self.as_user = []
        try:
            (self.folder / "password").write_text("secret\n")
            if os.geteuid() == 0:
                owner = pwd.getpwnam("postgres")
                for path in (self.folder, self.folder / "password"):
                    os.chown(path, owner.pw_uid, owner.pw_gid)
                self.as_user = ["setpriv", "--reuid=postgres", "--regid=postgres", "--clear-groups"]
            self.call("initdb", "-A", "scram-sha-256", "-E", "UTF8", "--no-locale", "-U", "fleet",
                      f"--pwfile={self.folder}/password")
            self.start()
        except BaseException:
            self.remove()
            raise

    def call(self, program, *arguments):
        done = subprocess.run([*self.as_user, self.programs / program, "-D", self.folder / "data", *arguments],
                              stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                              cwd="/", check=False)
        if done.returncode != 0:
            raise RuntimeError(f"{program} {' '.join(arguments)}: {done.stderr.strip()}")

    def start(self):
        # The standard error of the server is its log: else it keeps the pipe of pg_ctl open.
        self.call("pg_ctl", "-w", "-l", f"{self.folder}/log", "-o",
                  f"-p {self.port} -k {self.folder} -c listen_addresses=127.0.0.1 -c fsync=on", "start")

    def stop(self, mode):
        """mode: fast, or immediate, which is a crash that the next start recovers from."""
        self.call("pg_ctl", "-w", "-m", mode, "stop")

    def query(self, sql, patience_s=None):
        """Rows of texts. Raises StoreDown, and RuntimeError if the tables do not exist yet. Halted clients do not hold a server."""
        done = subprocess.run([self.programs / "psql", self.url, "-X", "-q", "-A", "-t", "-F", "\t", "-c", sql],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        if done.returncode == 2:
            raise StoreDown(done.stderr.strip())
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip())
        return [line.split("\t") for line in done.stdout.splitlines()]

    def remove(self):
        try:
            self.stop("immediate")
        except RuntimeError:
            pass  # it does not run
        shutil.rmtree(self.folder, ignore_errors=True)


class Sqlite:
    """A file in a folder under /tmp."""
    name = "SQLite"

    def __init__(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="torsio-fleet-sqlite-", dir="/tmp"))
        self.url = str(self.folder / "studies.sqlite")

    def query(self, sql, patience_s=30.0):
        """Rows of texts. Raises StoreDown after patience_s, and RuntimeError if the file or its tables do not exist yet."""
        try:
            with contextlib.closing(sqlite3.connect(f"file:{urllib.parse.quote(self.url)}?mode=rw", uri=True,
                                                    timeout=patience_s)) as connection:
                rows = connection.execute(sql).fetchall()
        except sqlite3.OperationalError as error:
            is_held = error.sqlite_errorcode & 0xff in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_PROTOCOL)
            raise (StoreDown if is_held else RuntimeError)(str(error)) from error
        return [["" if value is None else str(value) for value in row] for row in rows]

    def remove(self):
        shutil.rmtree(self.folder, ignore_errors=True)


STORES = {"postgresql": Postgresql, "sqlite": Sqlite}
