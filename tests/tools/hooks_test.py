"""What tools/install_hooks installs, and which commits the hook refuses."""
import shutil
import unittest

from repository import RepositoryTest

CLANG_FORMAT = shutil.which("clang-format-16")
# Of docs/vocabulary.retired, in two parts because this file is checked too.
RETIRED = "on what it hang" + "s on\n"
GOOD = "what it depends on\n"


class Hooks(RepositoryTest):
    scripts = ("tools/install_hooks", "tools/hooks/pre-commit", "tools/retired_words", "docs/vocabulary.retired",
               ".clang-format")

    def setUp(self):
        super().setUp()
        self.write(**{"docs/vocabulary.exceptions": ""})
        self.commit(1, **{"docs/page.md": GOOD, "src/a.cpp": "int a;\n"})

    def install(self):
        return self.run_in("tools/install_hooks")

    def try_commit(self, *arguments, folder=None):
        done = self.run_in("git", "commit", "--quiet", "-m", "change", *arguments, folder=folder)
        return done.returncode, done.stderr + done.stdout

    def stage(self, **texts):
        self.write(**texts)
        self.git("add", *texts)

    def test_refuses_a_staged_word_that_is_not_used(self):
        self.assertEqual(self.install().returncode, 0)
        self.stage(**{"docs/page.md": GOOD + RETIRED})
        self.write(**{"docs/page.md": GOOD})  # good in the folder, but that is not what is committed
        status, text = self.try_commit()
        self.assertEqual(status, 1)
        self.assertIn("docs/page.md:2:", text)
        self.assertIn("depends on", text)
        self.assertEqual(self.git("rev-list", "--count", "HEAD"), "1\n")

    def test_a_change_that_is_not_staged_does_not_count(self):
        self.install()
        self.stage(**{"docs/page.md": GOOD + GOOD})
        self.write(**{"docs/page.md": GOOD + RETIRED, "docs/other.md": RETIRED})
        status, text = self.try_commit()
        self.assertEqual(status, 0, text)
        self.assertEqual(self.git("show", "HEAD:docs/page.md"), GOOD + GOOD)
        # With --all it is committed, through an index of its own.
        self.assertEqual(self.try_commit("--all")[0], 1)

    def test_checks_only_files_of_the_commit(self):
        self.commit(0, **{"docs/old.md": RETIRED})
        self.install()
        self.stage(**{"docs/page.md": GOOD + GOOD})
        self.assertEqual(self.try_commit()[0], 0)

    def test_accepts_deleted_and_renamed_files_and_names_with_spaces(self):
        self.commit(0, **{"docs/with a word.md": RETIRED, "docs/last.md": GOOD})
        self.install()
        self.git("rm", "--quiet", "docs/with a word.md")
        self.git("mv", "docs/last.md", "docs/last of all.md")
        status, text = self.try_commit()
        self.assertEqual(status, 0, text)
        self.stage(**{"docs/last of all.md": RETIRED})
        self.assertIn("docs/last of all.md:1:", self.try_commit()[1])

    def test_reads_the_lists_that_are_staged(self):
        self.install()
        self.stage(**{"docs/page.md": RETIRED, "docs/vocabulary.exceptions": f'docs/page.md: "{RETIRED.strip()}": a quote\n'})
        status, text = self.try_commit()
        self.assertEqual(status, 0, text)

    @unittest.skipUnless(CLANG_FORMAT, "clang-format-16 is not installed")
    def test_refuses_staged_formatting(self):
        self.install()
        self.stage(**{"src/a.cpp": "int  a ;\n"})
        self.write(**{"src/a.cpp": "int a;\n"})
        status, text = self.try_commit()
        self.assertEqual(status, 1)
        self.assertIn("src/a.cpp:1:", text)
        self.stage(**{"src/a.cpp": "int b;\n"})
        self.write(**{"src/a.cpp": "int  b ;\n"})
        status, text = self.try_commit()
        self.assertEqual(status, 0, text)

    def test_works_in_every_worktree_and_is_installed_once(self):
        self.assertEqual(self.install().returncode, 0)
        self.assertIn("already", self.install().stdout)
        other = self.outside / "worktree"
        self.git("worktree", "add", "--quiet", other)
        (other / "docs/page.md").write_text(RETIRED)
        self.git("add", "docs/page.md", folder=other)
        self.assertEqual(self.try_commit(folder=other)[0], 1)
        self.assertIn("already", self.run_in("tools/install_hooks", folder=other).stdout)

    def test_does_not_replace_a_hook(self):
        (self.root / ".git/hooks").mkdir(exist_ok=True)
        hook = self.root / ".git/hooks/pre-push"
        hook.write_text("#!/bin/sh\n")
        done = self.install()
        self.assertEqual(done.returncode, 1)
        self.assertIn("found pre-push; either call tools/hooks/pre-commit", done.stderr)
        hook.unlink()
        self.git("config", "core.hooksPath", "elsewhere")
        done = self.install()
        self.assertEqual(done.returncode, 1)
        self.assertIn("found 'elsewhere'", done.stderr)
        self.assertEqual(self.git("config", "core.hooksPath"), "elsewhere\n")


unittest.main()
