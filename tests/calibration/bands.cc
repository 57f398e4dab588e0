// Tests whether the bands of predictions are true. Each campaign draws a truth from the prior,
// estimates it from the first half of a record, and predicts the whole record. Over many campaigns,
// the 95 % bands must hold the signal without noise, and the samples, 95 times in 100: in the half
// that the estimate knows and in the other one.
//
//   bands [CAMPAIGNS]
//
// CAMPAIGNS is 200 by default; they are dealt out evenly over rigs and kinds of noise. Prints a
// table and exits with 1 when a coverage is off by more than 2 %, or by three standard errors where
// that is more. Standard errors count campaigns: the times of one are not independent.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "core/common/check.h"
#include "polyest/estimator.h"
#include "tests/calibration/campaigns.h"

namespace polyest::internal::calibration {
namespace {

// Values within the band, of how many.
struct Covered {
  int64_t inside = 0;
  int64_t count = 0;

  void Add(double lower, double value, double upper) {
    inside += lower <= value && value <= upper ? 1 : 0;
    ++count;
  }
  double Fraction() const { return static_cast<double>(inside) / static_cast<double>(count); }
};

struct Coverage {
  Covered signal, samples;
};

// Returns the first `rows` rows.
Samples Beginning(const Samples& record, int rows) {
  Samples beginning = record;
  beginning.time_s.resize(static_cast<size_t>(rows));
  for (SampleColumn& column : beginning.columns) column.value.resize(static_cast<size_t>(rows));
  return beginning;
}

// Adds the rows of one campaign to the coverage in and out of sample.
void Predict(const Campaign& campaign, int rows, Coverage& in, Coverage& out) {
  const auto estimator = Estimator::Make(campaign.problem).value();
  POLYEST_CHECK(estimator->Append(Beginning(campaign.record, rows / 2)).ok());
  POLYEST_CHECK(estimator->Process().ok());
  PredictionOptions options;
  options.probabilities = {0.025, 0.975};
  options.record = campaign.record;
  const Prediction prediction = estimator->CurrentPrediction(options).value();
  for (size_t c = 0; c < prediction.outputs.size(); ++c) {
    const PredictedOutput& output = prediction.outputs[c];
    for (int k = 0; k < rows; ++k) {
      Coverage& coverage = k < rows / 2 ? in : out;
      coverage.signal.Add(output.quantiles(k, 0), campaign.signal(k, static_cast<Eigen::Index>(c)),
                          output.quantiles(k, 1));
      coverage.samples.Add(output.sample_quantiles(k, 0), output.measured[k],
                           output.sample_quantiles(k, 1));
    }
  }
}

bool Print(const char* name, const Covered& in, const Covered& out, double limit) {
  std::printf("| %-8s | %9.1f %% | %13.1f %% |\n", name, 100 * in.Fraction(), 100 * out.Fraction());
  return std::abs(in.Fraction() - 0.95) <= limit && std::abs(out.Fraction() - 0.95) <= limit;
}

int Run(int campaigns) {
  const std::vector<Rig> rigs = Rigs();
  Coverage in, out;
  for (int i = 0; i < campaigns; ++i) {
    const Rig& rig = rigs[static_cast<size_t>(i) % rigs.size()];
    const Noise noise = i / std::ssize(rigs) % 2 == 0 ? Noise::kWhite : Noise::kUnknown;
    const int rows = 2 * rig.short_rows;
    Predict(MakeCampaign(rig, rows, noise, static_cast<uint64_t>(i) + 1), rows, in, out);
  }
  const double limit = std::max(0.02, 3 * std::sqrt(0.95 * 0.05 / campaigns));
  std::printf("| 95 %% band of | in sample | out of sample |\n|---|---|---|\n");
  const bool signal = Print("signal", in.signal, out.signal, limit);
  const bool samples = Print("samples", in.samples, out.samples, limit);
  return signal && samples ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace polyest::internal::calibration

int main(int argc, char** argv) {
  const int campaigns = argc > 1 ? std::atoi(argv[1]) : 200;
  return polyest::internal::calibration::Run(campaigns > 0 ? campaigns : 200);
}
