"""What tools/step_ratios makes of two programs that print the times of steps."""
import json
import unittest

from repository import RepositoryTest

# The N-th run prints the N-th line of the file of times, or its last one. Each process that it started would load the clock.
PROGRAM = """#!/bin/sh
echo "$*" >> "$0.calls"
runs=0
while read -r _; do runs=$((runs + 1)); done < "$0.calls"
while [ "$runs" -gt 0 ] && read -r line; do
  runs=$((runs - 1))
  times=$line
done < "$0.times"
printf '%s\\n' "$times"
"""


class StepRatios(RepositoryTest):
    scripts = ("tools/step_ratios", "tools/step_clock.cpp")

    def program(self, name, *runs):
        """@param runs: of each the time of a step of grey_box by condition"""
        def printed(times):
            rows = [{"condition": condition, "model": model, "step_ns": time_ns}
                    for condition, time_ns in times.items()
                    for model, time_ns in (("linear", 1.0), ("grey_box", time_ns))]
            return json.dumps([{"rows": rows}]) + "\n"

        self.write(**{name: PROGRAM, f"{name}.times": "".join(map(printed, runs))})
        (self.root / name).chmod(0o755)

    def ratios(self, *arguments, status=0):
        done = self.run_in("tools/step_ratios", "old", "new", *arguments)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def row(self, text, condition):
        """Old and new time, their ratio, the ratio of each seed."""
        line = next(line for line in text.splitlines() if line.startswith(condition + " "))
        return [float(word) for word in line.removeprefix(condition).split()]

    def test_a_row_is_the_mean_over_seeds_of_the_least_of_all_rounds(self):
        # Two rounds of two seeds: the first round is slow for both programs, as on a machine that others use.
        self.program("old", {"a": 9000}, {"a": 9000}, {"a": 2000}, {"a": 4000})
        self.program("new", {"a": 8000}, {"a": 8000}, {"a": 1000}, {"a": 3000})
        old_ns, new_ns, ratio, *by_seed = self.row(self.ratios("--rounds", "2", "--seeds", "7", "8").stdout, "a")
        for found, expected in zip((old_ns, new_ns), (3000, 2000)):  # without what the clock adds
            self.assertLessEqual(found, expected)
            self.assertGreater(found, expected - 100)
        self.assertAlmostEqual(ratio, new_ns / old_ns, delta=0.001)
        for found, expected in zip(by_seed, (0.5, 0.75)):
            self.assertAlmostEqual(found, expected, delta=0.03)
        calls = (self.root / "old.calls").read_text().splitlines()
        self.assertEqual(calls, [f"reproduce coverage --fresh --seed {seed} --repeats 1 --json -" for seed in (7, 8, 7, 8)])

    def test_the_limit_is_of_each_row(self):
        self.program("old", {"a": 1000, "b": 1000, "only old": 1})
        self.program("new", {"a": 500, "b": 1200, "only new": 1})
        options = ("--rounds", "1", "--seeds", "1")
        self.assertIn("2 conditions, ", self.ratios(*options).stdout)
        self.assertIn("above 1.05: 1", self.ratios(*options, "--limit", "1.05", status=1).stdout)
        self.assertIn("above 1.3: 0", self.ratios(*options, "--limit", "1.3").stdout)

    def test_a_program_that_fails_ends_the_measurement_with_its_message(self):
        self.program("old", {"a": 1000})
        self.write(new="#!/bin/sh\necho 'no recordings' >&2\nexit 3\n")
        (self.root / "new").chmod(0o755)
        done = self.ratios("--rounds", "1", "--seeds", "1", status=1)
        self.assertIn("ended with 3", done.stderr)
        self.assertIn("no recordings", done.stderr)

    def test_what_cannot_be_measured_is_refused(self):
        self.program("old", {"a": 1000})
        self.program("new", {"b": 1000})
        self.assertIn("no condition in common", self.ratios("--rounds", "1", "--seeds", "1", status=1).stderr)
        self.assertIn("at least 1, found 0", self.ratios("--rounds", "0", status=2).stderr)
        (self.root / "new").chmod(0o644)
        self.assertIn("a program that can be run", self.ratios(status=2).stderr)


if __name__ == "__main__":
    unittest.main()
