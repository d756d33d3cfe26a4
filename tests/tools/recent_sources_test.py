"""What tools/recent_sources lists for clang-tidy, from commits with known dates."""
import unittest

from repository import SOURCE, RepositoryTest

OLD = {"src/old.cpp": "", "src/other.cpp": "", "apps/program.cpp": "", "tests/a_test.cpp": "", "README.md": ""}


def including(*headers):
    return "".join(f'#include "{header}"\n' for header in headers)


class RecentSources(RepositoryTest):
    def listed(self, folder=None):
        done = self.run_in(SOURCE / "tools/recent_sources", folder=folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.notes = done.stderr
        return done.stdout.split()

    def test_lists_sources_of_two_days_the_most_recent_first(self):
        self.commit(100, **OLD)
        self.commit(48.1, **{"src/old.cpp": "// before the two days"})
        self.commit(48, **{"src/edge.cpp": "// the first second of them"})
        self.commit(5, **{"apps/program.cpp": "// 5", "src/other.cpp": "// 5"})
        self.commit(0, **{"src/edge2.cpp": "// now", "tests/a_test.cpp": "// no", "README.md": "no"})
        self.assertEqual(self.listed(), ["src/edge2.cpp", "apps/program.cpp", "src/other.cpp", "src/edge.cpp"])
        self.assertIn("since", self.notes)

    def test_lists_nothing_where_only_documents_changed(self):
        self.commit(100, **OLD)
        self.commit(0, **{"README.md": "text"})
        self.assertEqual(self.listed(), [])

    def test_a_changed_header_is_read_through_two_sources(self):
        users = {f"src/part/user_{name}.cpp": including("torsio/part/thing.hpp") for name in "abc"}
        self.commit(100, **users, **OLD, **{"include/torsio/part/thing.hpp": "", "src/part/thing.cpp":
                                            including("torsio/part/thing.hpp")})
        self.commit(0, **{"include/torsio/part/thing.hpp": "// changed"})
        self.assertEqual(self.listed(), ["src/part/thing.cpp", "src/part/user_a.cpp"])

    def test_sources_in_the_list_serve_for_headers_too(self):
        self.commit(100, **OLD, **{"src/a.hpp": "", "src/b.hpp": "", "src/a.cpp": including("a.hpp")})
        self.commit(10, **{"src/old.cpp": including("a.hpp", "b.hpp"), "src/other.cpp": including("a.hpp"),
                           "apps/program.cpp": "// before the header"})
        self.commit(9, **{"apps/program.cpp": "// more recent"})
        self.commit(0, **{"src/a.hpp": "// a", "src/b.hpp": "// b"})
        # As recent as the header that they are read for.
        self.assertEqual(self.listed(), ["src/old.cpp", "src/other.cpp", "apps/program.cpp"])

    def test_a_source_of_two_changed_headers_is_preferred(self):
        self.commit(100, **{"src/a.hpp": "", "src/b.hpp": "", "src/u.cpp": including("a.hpp"), "src/v.cpp":
                            including("a.hpp"), "src/z.cpp": including("a.hpp", "b.hpp")})
        self.commit(0, **{"src/a.hpp": "// a", "src/b.hpp": "// b"})
        self.assertEqual(self.listed(), ["src/u.cpp", "src/z.cpp"])

    def test_without_a_direct_user_a_header_is_read_through_other_headers(self):
        self.commit(100, **{"src/low.hpp": "", "src/high.hpp": including("low.hpp"), "src/top.hpp": including("high.hpp"),
                            "src/near.cpp": including("high.hpp"), "src/far.cpp": including("top.hpp")})
        self.commit(0, **{"src/low.hpp": "// changed"})
        self.assertEqual(self.listed(), ["src/near.cpp"])

    def test_headers_that_include_each_other_end(self):
        self.commit(100, **{"src/a.hpp": including("b.hpp"), "src/b.hpp": including("a.hpp")})
        self.commit(0, **{"src/a.hpp": including("b.hpp") + "// changed"})
        self.assertEqual(self.listed(), [])

    def test_names_a_header_that_no_source_includes(self):
        self.commit(100, **OLD, **{"include/torsio/alone.hpp": ""})
        self.commit(0, **{"include/torsio/alone.hpp": "// changed", "tests/a_test.cpp": including("torsio/alone.hpp")})
        self.assertEqual(self.listed(), [])
        self.assertIn("include/torsio/alone.hpp is included by no source", self.notes)

    def test_a_deleted_file_is_not_listed_and_a_renamed_one_under_its_new_name(self):
        self.commit(100, **OLD)
        self.commit(10, **{"src/old.cpp": "// changed", "src/brief.cpp": ""})
        self.commit(5, **{"src/old.cpp": None, "src/brief.cpp": None})
        self.git("mv", "src/other.cpp", "src/renamed.cpp")
        self.commit(0)
        self.assertEqual(self.listed(), ["src/renamed.cpp"])

    def test_a_merge_brings_what_is_old_on_its_branch(self):
        self.commit(100, **OLD)
        self.git("checkout", "--quiet", "-b", "branch")
        self.commit(90, **{"src/of_the_branch.cpp": ""})
        self.git("checkout", "--quiet", "main")
        self.commit(1, **{"README.md": "main"})
        date = {"GIT_COMMITTER_DATE": "@1600000000 +0000"}
        self.git("merge", "--quiet", "--no-ff", "-m", "merge", "branch", environment=date)
        self.assertEqual(self.listed(), ["src/of_the_branch.cpp"])

    def test_what_is_not_committed_is_the_most_recent(self):
        self.commit(100, **OLD)
        self.commit(0, **{"src/old.cpp": "// committed"})
        self.write(**{"src/other.cpp": "// not yet"})
        self.assertEqual(self.listed(), ["src/other.cpp", "src/old.cpp"])

    def test_a_young_repository_is_compared_with_nothing(self):
        self.commit(3, **{"src/first.cpp": ""})
        self.commit(0, **{"src/second.cpp": ""})
        self.assertEqual(self.listed(), ["src/second.cpp", "src/first.cpp"])
        self.assertIn("whole history", self.notes)

    def test_a_shallow_clone_lists_what_it_has_and_reports_where_it_ends(self):
        self.commit(100, **OLD)
        self.commit(20, **{"src/old.cpp": "// 20"})
        self.commit(10, **{"src/other.cpp": "// 10"})
        self.commit(0, **{"apps/program.cpp": "// 0"})

        def clone(depth):
            self.git("clone", "--quiet", f"--depth={depth}", self.root.as_uri(), f"depth_{depth}", folder=self.outside)
            return self.listed(self.outside / f"depth_{depth}")

        self.assertEqual(clone(4), ["apps/program.cpp", "src/other.cpp", "src/old.cpp"])
        self.assertNotIn("clone ends", self.notes)
        self.assertEqual(clone(2), ["apps/program.cpp"])
        self.assertRegex(self.notes, r"clone ends less than 2 days .*since \w+ of 2020-09-13 02:26 UTC")
        # All that is there counts as changed, rather than nothing.
        self.assertEqual(clone(1), ["apps/program.cpp", "src/old.cpp", "src/other.cpp"])
        self.assertIn("this clone has one commit", self.notes)


unittest.main()
