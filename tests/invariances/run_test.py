#!/usr/bin/env python3
"""Shows that run.py tells estimates that stay from those that move."""
import unittest

import run


def answer(mean=10.0, sd=1.0, robust=0.0, best=None, names=("k",), codes=()):
    parameter = {"mean": mean, "map": mean if best is None else best, "stdDev": sd, "robustStdDev": robust,
                 "lower95": mean - 2 * sd, "upper95": mean + 2 * sd}
    return {"parameters": [parameter | {"name": name} for name in names],
            "diagnostics": [{"code": code} for code in codes]}


class JudgeTest(unittest.TestCase):
    def verdict(self, judge, *arguments):
        deviation, _, limit, excuse = judge(*arguments)
        return run.verdict(deviation, limit, excuse)

    def test_an_estimate_that_moves_with_the_noise_is_found(self):
        self.assertEqual(self.verdict(run.judge_noise, answer(), answer(mean=10.09), 0.1), "passed")
        self.assertEqual(self.verdict(run.judge_noise, answer(), answer(mean=10.11), 0.1), "MISSED")
        self.assertEqual(self.verdict(run.judge_noise, answer(), answer(best=10.11), 0.1), "MISSED")
        self.assertEqual(self.verdict(run.judge_noise, answer(robust=2), answer(mean=10.11), 0.1), "passed")

    def test_what_is_no_number_is_missed(self):
        names = {"names": ("k", "c")}
        moved = answer(mean=float("nan"), **names)
        self.assertEqual(self.verdict(run.judge_noise, answer(**names), moved, 1), "MISSED")
        self.assertEqual(self.verdict(run.judge_thinned, answer(), answer(sd=0)), "MISSED")

    def test_with_larger_noise_only_the_minimum_counts_in_the_wider_standard_deviation(self):
        self.assertEqual(self.verdict(run.judge_noise, answer(), answer(mean=15, best=10.9, sd=10), 10), "passed")
        self.assertEqual(self.verdict(run.judge_noise, answer(), answer(mean=10, best=11.1, sd=10), 10), "MISSED")

    def test_a_thinned_record_has_the_whole_ones_estimate_in_its_interval(self):
        self.assertEqual(self.verdict(run.judge_thinned, answer(mean=11.9), answer()), "passed")
        self.assertEqual(self.verdict(run.judge_thinned, answer(mean=12.1), answer()), "MISSED")
        several = {"names": tuple("abcd")}  # z(0.025/4)/z(0.025) = 1.274
        self.assertEqual(self.verdict(run.judge_thinned, answer(mean=12.5, **several), answer(**several)), "passed")
        self.assertEqual(self.verdict(run.judge_thinned, answer(mean=12.6, **several), answer(**several)), "MISSED")

    def test_halves_overlap_in_what_they_share_or_the_whole_says_that_they_do_not(self):
        apart = (answer(mean=14.1, names=("k", "x0[0]")), answer(names=("k", "x0[0]")))
        self.assertEqual(self.verdict(run.judge_halves, answer(), answer(mean=13.9), answer(), {}), "passed")
        self.assertEqual(self.verdict(run.judge_halves, answer(), *apart, {"x0": (0, 1)}), "MISSED")
        self.assertEqual(self.verdict(run.judge_halves, answer(codes=["WINDOWS_DISAGREE"]), *apart, {}),
                         "passed: WINDOWS_DISAGREE")
        self.assertEqual(self.verdict(run.judge_halves, answer(codes=["NON_GAUSSIAN"]), *apart, {}), "MISSED")


class ProblemTest(unittest.TestCase):
    def test_priors_become_flat_over_their_range_and_noise_absolute(self):
        problem = {"uncertain": [{"name": "a", "normal": {"mean": 10, "stdDev": 1}, "perRun": True},
                                 {"name": "b", "beta": {"alpha": 2, "beta": 2, "lower": 1, "upper": 3}},
                                 {"name": "c", "lognormal": {"mean": 1, "stdDev": 1}},
                                 {"name": "d", "truncatedNormal": {"mean": 5, "stdDev": 1, "lower": 4}}],
                   "correlations": [{}], "measured": [{"output": "x", "noise": {"relative": 0.1}}]}
        flat = run.flatten(problem, {"x": 0.5})
        self.assertEqual([parameter["uniform"] for parameter in flat["uncertain"]],
                         [{"lower": low, "upper": high} for low, high in ((7, 13), (1, 3), (0.1, 4), (4, 8))])
        self.assertNotIn("correlations", flat)
        self.assertTrue(flat["uncertain"][0]["perRun"])
        self.assertEqual(run.scale_noise(flat, 10)["measured"][0]["noise"], {"absolute": 5})

    def test_the_initial_state_is_freed_whether_it_was_known_or_not(self):
        problem = {"fixed": {"m": 1, "x0": 1}, "uncertain": [{"name": "v0", "uniform": {"lower": 0, "upper": 1}}]}
        freed = run.free_initial_state(problem, {"x0": (-1, 1), "v0": (-2, 2)})
        self.assertEqual(freed["fixed"], {"m": 1})
        self.assertEqual({parameter["name"]: parameter["uniform"]["upper"] for parameter in freed["uncertain"]},
                         {"x0": 1, "v0": 2})


class RowsTest(unittest.TestCase):
    def test_streamed_inputs_keep_their_rows(self):
        rows = [{"t": str(i), "u": "1", "x": "2"} for i in range(5)]
        free = {"measured": [{"output": "x"}]}
        self.assertEqual([row["t"] for row in run.thin(rows, 2, free)], ["0", "2", "4"])
        driven = free | {"inputs": [{"name": "u", "streamed": {}}]}
        self.assertEqual([row["x"] for row in run.thin(rows, 2, driven)], ["2", "", "2", "", "2"])

    def test_the_second_half_begins_at_time_0_of_its_first_run(self):
        rows = [{"t": str(t), "run": str(r)} for t, r in ((1, 0), (2, 0), (3, 0), (4, 1), (5, 1), (1, 2))]
        self.assertEqual([(float(row["t"]), row["run"]) for row in run.second_half(rows)],
                         [(0, 0), (1, 0), (1, 1)])


if __name__ == "__main__":
    unittest.main()
