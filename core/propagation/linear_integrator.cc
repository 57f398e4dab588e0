#include "core/propagation/linear_integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/common/check.h"
#include "core/propagation/exact_step.h"

namespace polyest::internal {
namespace {

// A state beyond it is a failure: its square, which the sums of an estimate need, must be finite.
constexpr double kMaxState = 1e100;

class LinearIntegrator final : public BlockIntegrator {
 public:
  LinearIntegrator(LinearSystem system, const BlockInputs* inputs, double time_s,
                   const ConstBlock& states);

  double time_s() const override { return time_s_; }
  ConstBlock states() const override { return states_; }
  IntegratorOutcome AdvanceTo(double time_s, double stop_time_s, int max_steps,
                              Block states) override;
  void Restart() override {}
  bool RestartFrom(const ConstBlock& states) override {
    states_ = states;
    return true;
  }

 private:
  static constexpr size_t kMaxKept = 8;
  static constexpr size_t kRemembered = 16;

  struct Kept {
    ExactStep step;
    int64_t last_use = 0;
  };

  void ReadGenerators();
  void StepBy(double length_s, double tolerance_s);
  const ExactStep* Find(double length_s, double tolerance_s);
  bool ComesAgain(double length_s, double tolerance_s);
  const ExactStep* Keep(double length_s);
  void Compose(double length_s);
  IntegratorOutcome Failure() const;

  const LinearSystem system_;
  const BlockInputs* const inputs_;
  double time_s_;
  Eigen::ArrayXXd states_, next_;
  Vector w_;
  StepMemory memory_;

  std::vector<Kept> kept_;
  int64_t uses_ = 0;
  std::array<double, kRemembered> remembered_s_{};  // lengths that were composed
  size_t composed_ = 0;
  std::vector<ExactStep> ladder_;  // of the lengths 2^k δ
};

LinearIntegrator::LinearIntegrator(LinearSystem system, const BlockInputs* inputs, double time_s,
                                   const ConstBlock& states)
    : system_(std::move(system)),
      inputs_(inputs),
      time_s_(time_s),
      states_(states),
      next_(states),
      w_(system_.components),
      memory_(system_) {}

void LinearIntegrator::ReadGenerators() {
  w_[0] = 1;
  for (const LinearSystem::Generator& generator : system_.generators) {
    inputs_->GeneratorStateOf(generator.input, time_s_,
                              {w_.data() + generator.first, static_cast<size_t>(generator.size)});
  }
}

IntegratorOutcome LinearIntegrator::AdvanceTo(double time_s, double stop_time_s, int /*max_steps*/,
                                              Block states) {
  POLYEST_CHECK(time_s >= time_s_ && stop_time_s >= time_s);
  if (time_s > time_s_) {
    next_ = states_;
    ReadGenerators();
    // Each of the two times may be off by a rounding error.
    constexpr double kRoundings = 4 * std::numeric_limits<double>::epsilon();
    StepBy(time_s - time_s_, kRoundings * std::abs(time_s));
    if (!(next_.abs() <= kMaxState).all()) return Failure();
    states_.swap(next_);
    time_s_ = time_s;
  }
  states = states_;
  return {};
}

void LinearIntegrator::StepBy(double length_s, double tolerance_s) {
  const ExactStep* step = Find(length_s, tolerance_s);
  if (step == nullptr && ComesAgain(length_s, tolerance_s)) step = Keep(length_s);
  if (step == nullptr) return Compose(length_s);
  const double difference_s = length_s - step->length_s;
  // It is a few roundings of the time, so its square is nothing.
  if (difference_s != 0) ApplySeries(system_, difference_s, /*terms=*/1, next_, w_, memory_);
  Apply(system_, *step, next_, w_, memory_);
}

const ExactStep* LinearIntegrator::Find(double length_s, double tolerance_s) {
  for (Kept& kept : kept_) {
    if (std::abs(kept.step.length_s - length_s) > tolerance_s) continue;
    kept.last_use = ++uses_;
    return &kept.step;
  }
  return nullptr;
}

// The first two lengths are expected to come again, later ones when they do.
bool LinearIntegrator::ComesAgain(double length_s, double tolerance_s) {
  if (kept_.size() < 2) return true;
  const auto end =
      remembered_s_.begin() + static_cast<std::ptrdiff_t>(std::min(composed_, kRemembered));
  const bool again = std::any_of(remembered_s_.begin(), end, [&](double remembered_s) {
    return std::abs(remembered_s - length_s) <= tolerance_s;
  });
  if (!again) remembered_s_[composed_++ % kRemembered] = length_s;
  return again;
}

const ExactStep* LinearIntegrator::Keep(double length_s) {
  if (kept_.size() < kMaxKept) {
    kept_.emplace_back();
  } else {
    std::swap(*std::ranges::min_element(kept_, {}, &Kept::last_use), kept_.back());
  }
  kept_.back() = {MakeExactStep(system_, length_s), ++uses_};
  return &kept_.back().step;
}

void LinearIntegrator::Compose(double length_s) {
  // δ is the power of 2 with δ · rate in (1/2, 1]; without a rate the series ends by itself.
  int exponent = 0;
  std::frexp(system_.rate, &exponent);
  const double unit_s = system_.rate > 0 ? std::ldexp(1.0, -exponent) : 2 * length_s;
  const double rest_s = std::fmod(length_s, unit_s);
  ApplySeries(system_, rest_s, SeriesTerms(system_, rest_s), next_, w_, memory_);
  double digits = (length_s - rest_s) / unit_s;
  for (size_t k = 0; digits >= 1; ++k, digits = std::floor(digits / 2)) {
    if (k == ladder_.size()) {
      ladder_.push_back(k == 0 ? MakeExactStep(system_, unit_s) : Doubled(system_, ladder_.back()));
    }
    if (std::fmod(digits, 2) == 1) Apply(system_, ladder_[k], next_, w_, memory_);
  }
}

// Names the point that is farthest beyond the largest state, a NaN before all others.
IntegratorOutcome LinearIntegrator::Failure() const {
  IntegratorOutcome outcome;
  outcome.ok = false;
  outcome.reason = "a state exceeds 1e100 in magnitude";
  double largest = 0;
  for (Eigen::Index row = 0; row < next_.rows(); ++row) {
    if (!next_.row(row).isFinite().all()) {
      outcome.worst_point = row;
      outcome.reason = "a state is not finite";
      break;
    }
    const double size = next_.row(row).abs().maxCoeff();
    if (size <= largest) continue;
    largest = size;
    outcome.worst_point = row;
  }
  return outcome;
}

}  // namespace

std::unique_ptr<BlockIntegrator> MakeLinearIntegrator(LinearSystem system,
                                                      const BlockInputs* inputs, double time_s,
                                                      const ConstBlock& states) {
  return std::make_unique<LinearIntegrator>(std::move(system), inputs, time_s, states);
}

}  // namespace polyest::internal
