"""Which files of docs/results tools/results calls out of date, with a program that does nothing but print its arguments."""
import unittest

from repository import RepositoryTest

TREE = {
    "studies/paper_001.cpp": '#include "studies.hpp"\n#include "torsio/fit/line.hpp"\n#include "paper_figures.inc"\n'
                             'int study();  // a comment\n',
    "studies/studies.hpp": "int study();\n",
    "studies/studies.cpp": '#include "studies.hpp"\nint count() { return 1; }\n',
    "studies/paper_003.cpp": "int other();\n",
    "include/torsio/fit/line.hpp": '#include "torsio/core/sum.hpp"\nint line();\n',
    "include/torsio/core/sum.hpp": "int sum();\n",
    "src/fit/line.cpp": '#include "torsio/fit/line.hpp"\nint line() { return 1; }\n',
    "src/core/sum.cpp": '#include "torsio/core/sum.hpp"\nint sum() { return 2; }\n',
    "src/core/other.cpp": "int other() { return 3; }\n",
    "studies/paper_figures.csv": "paper,item\n",
}


class Results(RepositoryTest):
    scripts = ("tools/results", "tools/source_includes.py")

    def setUp(self):
        super().setUp()
        self.commit(**TREE, **{"docs/results/README.md": "results\n", ".gitignore": "build\n"})
        self.write(**{"build/apps/torsio/torsio": '#!/bin/sh\necho "called with $*"\n'})
        (self.root / "build/apps/torsio/torsio").chmod(0o755)
        self.results("001")

    def results(self, *arguments, status=0):
        done = self.run_in("tools/results", *arguments)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout

    def text(self):
        return (self.root / "docs/results/001.txt").read_text()

    def test_a_result_is_the_output_below_its_command_and_above_the_hash_of_its_sources(self):
        self.assertRegex(self.text(), r"^\$ torsio reproduce 001-models 001-inverse\ncalled with reproduce 001-models "
                                      r"001-inverse\nsources: [0-9a-f]{12} of src/core=\w+ src/fit=\w+ studies=\w+\n$")

    def test_only_what_can_change_it_makes_it_out_of_date(self):
        self.assertEqual(self.results("--stale", "001"), "results: 0 of 1 are out of date\n")
        for name, text in (("studies/paper_001.cpp", TREE["studies/paper_001.cpp"].replace("a comment", "another")),
                           ("src/core/sum.cpp", TREE["src/core/sum.cpp"].replace(" { ", "\n{\n  ")),
                           ("src/core/other.cpp", "int other() { return 4; }\n"), ("studies/paper_003.cpp", "int more();\n"),
                           ("studies/studies.hpp", "int study();\nint another();\n"),
                           ("studies/studies.cpp", '#include "studies.hpp"\nint count() { return 2; }\n'),
                           ("studies/paper_items.csv", "paper,item\n")):
            self.write(**{name: text})
            self.assertIn("0 of 1", self.results("--stale", "001"), name)
        for name, part in (("src/core/sum.cpp", "src/core"), ("src/fit/line.cpp", "src/fit"),
                           ("include/torsio/core/sum.hpp", "src/core"), ("studies/paper_figures.csv", "studies")):
            self.write(**{name: TREE[name] + "int changed();\n"})
            self.assertEqual(self.results("--stale", "001"), f"results: 001 is out of date: changed since: {part}\n"
                                                             "results: 1 of 1 are out of date\n")
            self.write(**{name: TREE[name]})

    def test_runs_what_is_out_of_date_again_and_then_fails(self):
        self.results("--again", "001")
        self.write(**{"src/fit/line.cpp": TREE["src/fit/line.cpp"].replace("1", "7")})
        before = self.text()
        self.assertIn("changed since: src/fit", self.results("--again", "001", status=1))
        self.assertNotEqual(self.text(), before)
        self.results("--again", "001")

    def test_a_file_without_a_hash_and_one_that_is_missing_are_out_of_date(self):
        self.write(**{"docs/results/001.txt": "$ torsio reproduce\n"})
        self.assertIn("001 is out of date: records no hash of its sources", self.results("--stale", "001"))
        self.write(**{"docs/results/001.txt": None})
        self.assertIn("001 is out of date: has not been run", self.results("--stale", "001"))

    def test_a_run_that_fails_leaves_the_file_as_it_was(self):
        before = self.text()
        self.write(**{"build/apps/torsio/torsio": "#!/bin/sh\necho half\nexit 3\n"})
        done = self.run_in("tools/results", "001")
        self.assertEqual(done.returncode, 1)
        self.assertIn("001: torsio reproduce 001-models 001-inverse failed (exit status 3)", done.stderr)
        self.assertEqual(self.text(), before)

    def test_an_unknown_name_is_refused_with_those_that_exist(self):
        done = self.run_in("tools/results", "002-tabel3")
        self.assertEqual(done.returncode, 1)
        self.assertIn("there is no result '002-tabel3'; there are 000-brake, ", done.stderr)


unittest.main()
