"""What .ci/run prints and returns, with a ./run that does nothing but print, or fails in one of its commands."""
import unittest

from repository import SOURCE, RepositoryTest

RUN = """#!/usr/bin/env bash
echo "$1 with ${*:2}" >&2
[[ $1 != FAILING ]] || exit 7
[[ $1 != test ]] || printf '100%% tests passed, 0 tests failed out of 3\\nTotal Test time (real) = 2.00 sec\\n'
[[ $1 != lint ]] || echo 'lint: 1 of 3 files, no finding; no time was left for 2' >&2
"""


class Ci(RepositoryTest):
    scripts = (".ci/run",)

    def setUp(self):
        super().setUp()
        self.write(**{"tools/results": "#!/bin/sh\necho 'results: 2 of 3 are out of date'\n"})
        (self.root / "tools/results").chmod(0o755)

    def ci(self, failing="nothing", seconds=0):
        self.write(run=RUN.replace("FAILING", failing))
        (self.root / "run").chmod(0o755)
        ci = (SOURCE / ".ci/run").read_text()
        self.assertIn("minutes=34 ", ci)
        (self.root / ".ci/run").write_text(ci.replace("minutes=34 ", f"minutes=34 SECONDS={seconds} "))
        done = self.run_in(".ci/run")
        return done.returncode, done.stdout

    def test_ends_with_the_times_and_what_time_did_not_suffice_for(self):
        status, text = self.ci()
        self.assertEqual(status, 0, text)
        self.assertIn("test with -R ^studies\\.ArmContacts\n", text)
        self.assertIn("fuzz with 20 29\n", text)
        self.assertIn("lint with --recent 33\n", text)
        self.assertRegex(text, r"(?s)ci: format +0 min 0\d s\nci: results +0 min 0\d s\nci: build and tests +0 min "
                         r".*ci: headers .*ci: fuzz .*ci: lint .*\nci: results: 2 of 3 are out of date\n"
                         r"ci: lint: 1 of 3 files, no finding; no time was left for 2\nci: passed after +0 min \d\d s\n"
                         r"100% tests passed.*\nTotal Test time.*\n$")

    def test_leaves_out_the_fuzz_targets_and_limits_clang_tidy_where_the_tests_were_slow(self):
        status, text = self.ci(seconds=25 * 60)
        self.assertEqual(status, 0, text)
        self.assertNotIn("fuzz with", text)
        self.assertIn("ci: no time was left for the fuzz targets", text)
        self.assertIn("lint with --recent 8\n", text)
        self.assertIn("test with -R", text)
        _, text = self.ci(seconds=29 * 60)
        for what in ("each public header", "random hostile cases", "the contacts", "the fuzz targets"):
            self.assertIn(f"ci: no time was left for {what}", text)
        self.assertNotIn("headers with", text)
        self.assertIn("lint with --recent 4\n", text)

    def test_ends_with_a_part_that_fails(self):
        for part, name, following in (("format", "format", "test"), ("test", "build and tests", "headers"),
                                      ("fuzz", "fuzz", "lint")):
            status, text = self.ci(part)
            self.assertEqual(status, 7, text)
            self.assertRegex(text, rf"ci: {name} +failed\n")
            self.assertIn("ci: failed after", text)
            self.assertNotIn(f"{following} with", text)


unittest.main()
