"""What tools/release dates, commits and tags, and which releases it refuses."""
import unittest

from repository import RepositoryTest

HEADER = "include/torsio/core/version.hpp"
VERSION = 'inline constexpr const char* kVersion = "1.2.0";\n'
CHANGES = "# Changelog\n\n## Unreleased: 1.2.0\n\n### Data\n- New readers.\n\n## 1.1.0 (2020-01-01)\n- Old.\n"


class Release(RepositoryTest):
    scripts = ("tools/release",)

    def setUp(self):
        super().setUp()
        self.commit(1, **{HEADER: VERSION, "CHANGELOG.md": CHANGES})

    def release(self, *arguments):
        done = self.run_in("tools/release", *arguments)
        return done.returncode, done.stdout + done.stderr

    def test_dates_commits_and_tags_with_the_notes(self):
        status, text = self.release("1.2.0")
        self.assertEqual(status, 0, text)
        self.assertRegex((self.root / "CHANGELOG.md").read_text(), r"## 1\.2\.0 \(\d{4}-\d\d-\d\d\)\n")
        self.assertEqual(self.git("log", "-1", "--format=%s"), "release: 1.2.0\n")
        tag = self.git("tag", "--list", "--format=%(contents)", "v1.2.0")
        self.assertEqual(tag.strip(), "torsio 1.2.0\n\n### Data\n- New readers.")
        self.assertEqual(self.git("rev-parse", "v1.2.0^{}"), self.git("rev-parse", "HEAD"))
        status, text = self.release("1.2.0")
        self.assertEqual((status, text), (1, "release: the tag v1.2.0 exists\n"))

    def test_prints_notes_without_changing_anything(self):
        self.assertEqual(self.release("--notes", "1.2.0"), (0, "### Data\n- New readers.\n"))
        self.assertEqual(self.release("--notes", "1.1.0"), (0, "- Old.\n"))
        self.assertEqual(self.git("status", "--porcelain") + self.git("tag"), "")

    def test_refuses_another_version_a_change_and_a_missing_section(self):
        for arguments, part in ((("1.3.0",), "expected a section '## Unreleased: 1.3.0'"), (("1.1.0",), "has a date"),
                                ((), "expected a version"), (("v1.2.0",), "expected a version")):
            status, text = self.release(*arguments)
            self.assertEqual(status, 1, text)
            self.assertIn(part, text)
        self.commit(0, **{HEADER: VERSION.replace("1.2.0", "1.1.9")})
        self.assertIn("expected 1.2.0, found 1.1.9", self.release("1.2.0")[1])
        self.write(**{HEADER: VERSION})
        self.assertIn("the working tree has changes", self.release("1.2.0")[1])
        self.assertEqual(self.git("tag"), "")


if __name__ == "__main__":
    unittest.main()
