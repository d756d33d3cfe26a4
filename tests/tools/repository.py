"""A small git repository in a temporary folder, with copies of our scripts."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
NEWEST_S = 1_600_000_000  # the past, so that nothing depends on the clock of this machine
HOUR_S = 3600
# Without the settings of whoever runs the tests, among them hooks.
SETTINGS = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull,
            **{f"GIT_{who}_{what}": value for who in ("AUTHOR", "COMMITTER")
               for what, value in (("NAME", "test"), ("EMAIL", "test@example.org"))}}


class RepositoryTest(unittest.TestCase):
    scripts = ()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.outside = pathlib.Path(folder.name)
        self.root = self.outside / "repository"
        self.environment = {**{k: v for k, v in os.environ.items() if not k.startswith("GIT_")}, **SETTINGS}
        self.root.mkdir()
        self.git("init", "--quiet", "--initial-branch=main")
        for script in self.scripts:
            target = self.root / script
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(SOURCE / script, target)

    def run_in(self, *command, folder=None, environment=()):
        return subprocess.run(command, cwd=folder or self.root, env={**self.environment, **dict(environment)},
                              capture_output=True, text=True)

    def git(self, *arguments, folder=None, environment=()):
        done = self.run_in("git", *arguments, folder=folder, environment=environment)
        self.assertEqual(done.returncode, 0, f"git {arguments}: {done.stderr}")
        return done.stdout

    def write(self, **texts):
        """Files by their paths, in a dictionary: write(**{"src/a.cpp": text}); None deletes one."""
        for name, text in texts.items():
            path = self.root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.unlink() if text is None else path.write_text(text)

    def commit(self, hours_before=0.0, **texts):
        self.write(**texts)
        self.git("add", "--all")
        date = f"@{int(NEWEST_S - hours_before * HOUR_S)} +0000"
        # The author's date is years older: it is not the one that counts.
        self.git("commit", "--quiet", "--allow-empty", "--no-verify", "-m", "change",
                 environment={"GIT_COMMITTER_DATE": date, "GIT_AUTHOR_DATE": "@1000000000 +0000"})
