"""What tools/board_files makes of published files: those of the carriage are made here from the converted ones."""
import gzip
import os
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("TORSIO_DATA") or ROOT.parent / "shared/data")


class BoardFiles(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.originals, self.converted = pathlib.Path(folder.name) / "originals", pathlib.Path(folder.name) / "data"
        (self.originals / "clone/data").mkdir(parents=True)

    def convert(self):
        return subprocess.run([ROOT / "tools/board_files", self.originals, self.converted], capture_output=True, text=True)

    def write_carriage(self, change=str):
        if not (DATA / "emps").is_dir():
            self.skipTest("the recordings of emps are not here (TORSIO_DATA)")
        for name in ("est", "val"):
            lines = gzip.open(DATA / f"emps/emps_{name}.csv.gz", "rt").read().splitlines()[1:]
            text = "".join(line.partition(",")[2] + "\n" for line in lines)
            (self.originals / f"clone/data/EMPS_{name}.csv").write_text(change(text))

    def test_has_the_content_of_the_board(self):
        self.write_carriage()
        done = self.convert()
        for name in ("emps_est.csv.gz", "emps_val.csv.gz"):
            self.assertEqual(gzip.decompress((self.converted / "emps" / name).read_bytes()),
                             gzip.decompress((DATA / "emps" / name).read_bytes()))
        self.assertIn("2 of 41 files written", done.stdout)

    def test_states_what_is_missing(self):
        done = self.convert()
        self.assertEqual(done.returncode, 1)
        self.assertIn("emps_est.csv.gz: not written: EMPS_est.csv is not below", done.stderr)
        self.assertIn("0 of 41 files written", done.stdout)

    def test_does_not_write_another_content(self):
        self.write_carriage(lambda text: text.replace("2.5386", "2.5387", 1))
        done = self.convert()
        self.assertIn("emps_est.csv.gz: not written: expected SHA-256 45c38edf079b", done.stderr)
        self.assertFalse((self.converted / "emps/emps_est.csv.gz").exists())


if __name__ == "__main__":
    unittest.main()
