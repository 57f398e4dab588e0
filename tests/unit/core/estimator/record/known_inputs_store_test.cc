// Tests which samples count as missing because an early input is not known for them.

#include "core/estimator/record/known_inputs_store.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/estimator/record/sample_checks.h"
#include "tests/testing/oscillator.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

// RunInputs takes an input for known at t if t + lead is at most the time of its last sample. The
// two must agree where rounding decides, or what a row says would depend on when it is asked for.
TEST(KnownInputsStore, TakesSamplesForMissingExactlyWhereTheirInputsAreNotKnown) {
  for (const double lead_s : {0.1, 0.3, 0.6, 0.7}) {
    Problem problem;
    problem.model = *FindBuiltinModel("mass_spring_damper");
    problem.uncertain = {UncertainParameter::Normal("k", 40, 4).value()};
    problem.fixed["force.delay"] = -lead_s;
    problem.inputs = {{"force", StreamedInput{.interpolation = Interpolation::kLinear}}};
    problem.measured = {{"x", {.absolute = 0.01}}};
    const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
    ASSERT_EQ(resolved.lead_s(), lead_s);
    Samples samples;
    samples.columns = {{"x", {}, {}}, {"force", {}, {}}};
    for (int k = 0; k < 200; ++k) {
      samples.time_s.push_back(k / 100.0);
      for (SampleColumn& column : samples.columns) column.value.push_back(1);
    }
    const std::shared_ptr<SampleStore> store = StoreFor(resolved, nullptr);
    ASSERT_TRUE(store->Append(SampleChecks(resolved).Check(samples).value()).ok());
    RowBlock block;
    ASSERT_TRUE(store->Read(0, 200, block).ok());
    for (size_t k = 0; k < 200; ++k) {
      const bool known = samples.time_s[k] + lead_s <= samples.time_s.back();
      EXPECT_EQ(std::isnan(block.values[2 * k]), !known) << lead_s << " s, row " << k;
    }
  }
}

}  // namespace
}  // namespace polyest::internal
