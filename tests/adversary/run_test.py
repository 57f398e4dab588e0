#!/usr/bin/env python3
"""Shows that run.py tells good answers from bad ones."""
import tempfile
import unittest
from pathlib import Path

import run

ORACLE = {"k": {"mean": 10.0, "sd": 1.0}}


def answer(mean=10.0, sd=1.0, lower=None, upper=None, codes=()):
    return {"parameters": [{"name": "k", "mean": mean, "posteriorStdDev": sd,
                            "lower95": mean - 2 * sd if lower is None else lower,
                            "upper95": mean + 2 * sd if upper is None else upper}],
            "diagnostics": [{"code": code} for code in codes]}


class JudgeTest(unittest.TestCase):
    def verdict(self, case="c", **fields):
        return run.judge(case, answer(**fields), ORACLE)[0]

    def test_right_is_near_in_mean_and_standard_deviation(self):
        self.assertEqual(self.verdict(mean=10.2, sd=1.2), "RIGHT")
        self.assertEqual(self.verdict(mean=10.3), "HONEST")
        self.assertEqual(self.verdict(sd=1.3), "HONEST")

    def test_an_interval_that_reaches_the_exact_mean_is_honest(self):
        self.assertEqual(self.verdict(mean=13, sd=1), "HONEST")  # begins at 11, one sd away
        self.assertEqual(self.verdict(mean=13.1, sd=1), "SILENT")

    def test_an_interval_far_too_narrow_is_silent(self):
        self.assertEqual(self.verdict(sd=0.2), "SILENT")

    def test_only_an_admitted_failure_excuses(self):
        self.assertEqual(self.verdict(mean=20, codes=["EXPANSION_INACCURATE"]), "HONEST")
        self.assertEqual(self.verdict(mean=20, codes=["MODEL_MISFIT"]), "SILENT")

    def test_a_wrong_model_needs_a_diagnostic(self):
        self.assertEqual(self.verdict(case="c08_slow_drift"), "SILENT")
        self.assertEqual(self.verdict(case="c08_slow_drift", codes=["MODEL_MISFIT"]), "RIGHT")


class ComplaintTest(unittest.TestCase):
    def test_only_the_listed_verdict_will_do(self):
        known = {"c": "SILENT"}
        self.assertIsNone(run.complaint("c", "SILENT", known))
        self.assertIn("was SILENT", run.complaint("c", "CRASH", known))
        self.assertIn("no longer SILENT", run.complaint("c", "RIGHT", known))
        self.assertIsNone(run.complaint("d", "HONEST", known))
        self.assertEqual(run.complaint("d", "SILENT", known), "d is SILENT")


class WorkTest(unittest.TestCase):
    def test_a_folder_that_the_script_has_not_made_is_left_as_it_is(self):
        with tempfile.TemporaryDirectory() as folder:
            kept = Path(folder) / "make_cases.py"
            kept.write_text("")
            with self.assertRaisesRegex(SystemExit, "it is left as it is"):
                run.make_cases(Path(folder), Path(folder), [])
            self.assertTrue(kept.exists())


class TableTest(unittest.TestCase):
    def test_rows_of_the_guide_are_read(self):
        self.assertEqual(dict(run.ROW.findall("| `c01_x` | CRASH | why |\n| `n` | 3 |\n")),
                         {"c01_x": "CRASH"})


if __name__ == "__main__":
    unittest.main()
