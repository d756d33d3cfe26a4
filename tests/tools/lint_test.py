"""What tools/lint returns and prints, with a clang-tidy that finds something where a file contains FINDING."""
import os
import unittest

from repository import RepositoryTest

# As the real one: a finding in a header is one of the source that includes it, and it counts what it suppressed.
CLANG_TIDY = """#!/usr/bin/env bash
echo '12 warnings generated.' >&2
cd "$(dirname "$4")"
grep -l FINDING "$(basename "$4")" $(sed -n 's/#include "\\(.*\\)"/\\1/p' "$(basename "$4")") && exit 1
exit 0
"""


class Lint(RepositoryTest):
    scripts = ("tools/lint", "tools/recent_sources", "tools/source_includes.py", "tools/retired_words",
               "docs/vocabulary.retired")

    def setUp(self):
        super().setUp()
        self.write(**{"docs/vocabulary.exceptions": ""})
        programs = self.outside / "programs"
        programs.mkdir()
        for name, text in (("clang-tidy", CLANG_TIDY), ("clang-format-16", "#!/bin/sh\n")):
            (programs / name).write_text(text)
            (programs / name).chmod(0o755)
        self.environment["PATH"] = f"{programs}:{os.environ['PATH']}"
        self.commit(100, **{"src/a.cpp": '#include "a.hpp"\n', "src/a.hpp": "", "src/b.cpp": "", "src/c.cpp": ""})

    def lint(self, *arguments):
        done = self.run_in("tools/lint", "build-lint", *arguments)
        return done.returncode, done.stdout, done.stderr

    def test_is_clean_where_nothing_was_found_in_any_file(self):
        self.commit(0, **{"src/b.cpp": "int b;"})
        status, _, text = self.lint("--recent")
        self.assertEqual(status, 0, text)
        self.assertIn("clang-tidy on 1 files", text)
        self.assertTrue(text.endswith("lint: clean\n"), text)
        self.assertNotIn("warnings generated", text)
        self.assertEqual(self.lint("--recent", "10")[0], 0)
        self.assertIn("clang-tidy on 3 files", self.lint()[2])

    def test_fails_on_a_finding_in_a_source(self):
        self.commit(0, **{"src/b.cpp": "FINDING", "src/c.cpp": "int c;"})
        for arguments in ((), ("--recent",), ("--recent", "10")):
            status, found, text = self.lint(*arguments)
            self.assertEqual((status, found), (1, "b.cpp\n"), text)
            self.assertNotIn("clean", text)

    def test_fails_on_a_finding_in_the_only_file_that_changed_a_header(self):
        self.commit(0, **{"src/a.hpp": "FINDING"})
        status, found, text = self.lint("--recent", "10")
        self.assertEqual((status, found), (1, "a.hpp\n"), text)

    def test_is_not_clean_where_the_minutes_end(self):
        self.commit(0, **{"src/b.cpp": "FINDING", "src/c.cpp": "int c;"})
        status, _, text = self.lint("--recent", "0")
        self.assertEqual(status, 0, text)
        self.assertIn("\n  src/b.cpp\n  src/c.cpp\nlint: 0 of 2 files, no finding; no time was left for 2\n", text)
        self.assertNotIn("clean", text)

    def test_every_file_is_in_one_of_the_parts(self):
        read = [self.lint(f"{k}/2")[2] for k in (1, 2)]
        self.assertEqual(sum("clang-tidy on 1 files" in text for text in read), 1)
        self.assertEqual(sum("clang-tidy on 2 files" in text for text in read), 1)

    def test_fails_where_the_list_of_files_does(self):
        (self.root / "tools/recent_sources").write_text("#!/bin/sh\nexit 3\n")
        self.assertNotEqual(self.lint("--recent")[0], 0)

    def test_refuses_what_it_does_not_understand(self):
        for arguments in (("--since", "HEAD"), ("0/2",), ("1/2", "5"), ("--recent", "ten"), ("--recent", "1", "2")):
            status, _, text = self.lint(*arguments)
            self.assertEqual(status, 2, arguments)
            self.assertIn("lint: expected", text)


unittest.main()
