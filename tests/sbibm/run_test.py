#!/usr/bin/env python3
"""Shows that run.py measures how far an answer is from reference draws."""
import unittest

import run


class CompareTest(unittest.TestCase):
    def compare(self, sd=1.0, **means):
        draws = [[centre + step for centre in (9.0, 10.0, 11.0, 12.0)] for step in (-1.0, 0.0, 1.0)]
        means = {"alpha": 9.0, "beta": 10.0, "gamma": 11.0, "delta": 12.0} | means
        return run.compare([{"name": name, "mean": mean, "posteriorStdDev": sd}
                            for name, mean in means.items()], draws)

    def test_the_worst_parameter_counts(self):
        self.assertEqual(self.compare(), (0.0, 0.0))
        self.assertAlmostEqual(self.compare(alpha=9.02, delta=11.9)[0], 0.1)
        self.assertAlmostEqual(self.compare(sd=0.9)[1], 0.1)

    def test_priors_have_the_mean_and_the_deviation_of_the_lognormal(self):
        prior = run.lognormal("alpha", -0.125)["lognormal"]
        self.assertAlmostEqual(prior["mean"], 1.0)
        self.assertAlmostEqual(prior["stdDev"], (2.718281828459045**0.25 - 1)**0.5)


if __name__ == "__main__":
    unittest.main()
