// Tests whether polyest's uncertainties are true. Each campaign draws a truth from the prior and
// estimates it without knowing it. Over many campaigns
//   - 95 % intervals must hold the truth 95 times in 100,
//   - (truth − posterior mean)/posterior standard deviation must have standard deviation 1,
//   - the truth's rank among draws of the posterior must be uniform (Talts et al. 2018), by
//     Kolmogorov's test.
//
//   calibration [CAMPAIGNS] [--only TEXT] [--no-limits]
//
// CAMPAIGNS is 1000 by default; they are dealt out evenly over rigs, lengths and noises, or over
// those of them whose row of the table contains TEXT. Prints a table and exits with 1 when the
// whole is off: by more than 2 % in coverage and 0.05 in standard deviation for a thousand, by
// three standard errors where that is more, or ranks with p < 0.01.

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/common/check.h"
#include "polyest/estimator.h"
#include "tests/calibration/campaigns.h"

namespace polyest::internal::calibration {
namespace {

// The results of all campaigns, one value a parameter and campaign.
struct Outcomes {
  std::vector<double> errors;  // (truth − mean)/standard deviation
  std::vector<double> ranks;   // in [0, 1]
  int covered = 0;

  void Add(const Outcomes& other) {
    errors.insert(errors.end(), other.errors.begin(), other.errors.end());
    ranks.insert(ranks.end(), other.ranks.begin(), other.ranks.end());
    covered += other.covered;
  }
  double Count() const { return static_cast<double>(errors.size()); }
  double Coverage() const { return covered / Count(); }
  double StandardDeviation() const {
    double sum = 0;
    for (const double error : errors) sum += error * error;
    return std::sqrt(sum / Count());
  }
};

// Returns P(D > d) of Kolmogorov's distribution with Stephens' correction for finite samples.
double KolmogorovProbability(std::vector<double> ranks) {
  std::ranges::sort(ranks);
  const auto n = static_cast<double>(ranks.size());
  double largest = 0;
  for (size_t i = 0; i < ranks.size(); ++i) {
    const auto k = static_cast<double>(i);
    largest = std::max({largest, (k + 1) / n - ranks[i], ranks[i] - k / n});
  }
  const double x = (std::sqrt(n) + 0.12 + 0.11 / std::sqrt(n)) * largest;
  double p = 0;
  for (int j = 1; j <= 100; ++j) p += 2 * (j % 2 == 1 ? 1 : -1) * std::exp(-2.0 * j * j * x * x);
  return std::clamp(p, 0.0, 1.0);
}

Outcomes Estimate(const Campaign& campaign) {
  const auto estimator = Estimator::Make(campaign.problem).value();
  POLYEST_CHECK(estimator->Append(campaign.record).ok() && estimator->Process().ok());
  PosteriorOptions options;
  options.probabilities = {0.025, 0.975};
  options.density_bins = 0;
  options.samples = 1'000;
  const Posterior posterior = estimator->CurrentPosterior(options).value();
  Outcomes outcomes;
  for (Eigen::Index i = 0; i < campaign.truth.size(); ++i) {
    const PosteriorMarginal& marginal = posterior.marginals[static_cast<size_t>(i)];
    const double truth = campaign.truth[i];
    outcomes.errors.push_back((truth - marginal.mean) / marginal.std_dev);
    outcomes.covered += marginal.quantiles[0] <= truth && truth <= marginal.quantiles[1] ? 1 : 0;
    const auto below = static_cast<double>((posterior.samples.col(i).array() < truth).count());
    outcomes.ranks.push_back((below + 0.5) / (options.samples + 1.0));
  }
  return outcomes;
}

// What is asked of the campaigns of one row of the table.
struct Row {
  const Rig* rig = nullptr;
  bool is_long = false;
  Noise noise = Noise::kWhite;

  std::string Label() const {
    return absl::StrFormat("%-11s | %-6s | %-14s", rig->name, is_long ? "long" : "short",
                           NameOf(noise));
  }
};

void Print(const std::string& label, int campaigns, const Outcomes& outcomes) {
  std::printf("| %s | %4d | %5.1f %% | %5.2f | %6.3f |\n", label.c_str(), campaigns,
              100 * outcomes.Coverage(), outcomes.StandardDeviation(),
              KolmogorovProbability(outcomes.ranks));
  std::fflush(stdout);
}

// Tests the limits. Standard errors count campaigns: the parameters of one are not independent.
bool WithinLimits(const Outcomes& all, double campaigns) {
  const double coverage = std::max(0.02, 3 * std::sqrt(0.95 * 0.05 / campaigns));
  const double deviation = std::max(0.05, 3 / std::sqrt(2 * campaigns));
  return std::abs(all.Coverage() - 0.95) <= coverage &&
         std::abs(all.StandardDeviation() - 1) <= deviation &&
         KolmogorovProbability(all.ranks) > 0.01;
}

// Returns the rows of the table whose labels contain the text.
std::vector<Row> RowsWith(const std::string& text, const std::vector<Rig>& rigs) {
  std::vector<Row> rows;
  for (const Rig& rig : rigs) {
    for (const bool is_long : {false, true}) {
      for (const Noise noise : kNoises) {
        const Row row{&rig, is_long, noise};
        if (row.Label().find(text) != std::string::npos) rows.push_back(row);
      }
    }
  }
  return rows;
}

int Run(int campaigns, const std::string& only, bool limits) {
  const std::vector<Rig> rigs = Rigs();
  const std::vector<Row> rows = RowsWith(only, rigs);
  if (rows.empty()) {
    std::fprintf(stderr, "calibration: no row of the table contains '%s'\n", only.c_str());
    return 2;
  }
  const int each = (campaigns + static_cast<int>(rows.size()) - 1) / static_cast<int>(rows.size());
  std::printf(
      "| rig         | record | noise          | runs | covered | sd    | p      |\n"
      "|---|---|---|---|---|---|---|\n");
  Outcomes all;
  uint64_t seed = 0;
  for (const Row& row : rows) {
    Outcomes outcomes;
    for (int i = 0; i < each; ++i) {
      const int length = row.is_long ? row.rig->long_rows : row.rig->short_rows;
      outcomes.Add(Estimate(MakeCampaign(*row.rig, length, row.noise, ++seed)));
    }
    Print(row.Label(), each, outcomes);
    all.Add(outcomes);
  }
  const int total = each * static_cast<int>(rows.size());
  Print(absl::StrFormat("%-11s | %-6s | %-14s", "all", "", ""), total, all);
  return !limits || WithinLimits(all, total) ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace polyest::internal::calibration

int main(int argc, char** argv) {
  int campaigns = 1'000;
  std::string only;
  bool limits = true;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--no-limits") {
      limits = false;
    } else if (argument == "--only" && i + 1 < argc) {
      only = argv[++i];
    } else if ((campaigns = std::atoi(argv[i])) <= 0) {
      std::fprintf(stderr, "calibration [CAMPAIGNS] [--only TEXT] [--no-limits]\n");
      return 2;
    }
  }
  return polyest::internal::calibration::Run(campaigns, only, limits);
}
