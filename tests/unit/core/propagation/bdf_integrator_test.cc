#include "core/propagation/bdf_integrator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace polyest::internal::bdf_integrator_test {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kMaxSteps = 1'000;
constexpr double kTolerance = 1e-8;

// ẋ = −x for all points. It throws at one evaluation of the derivatives or of their Jacobian.
class Decay final : public BlockSystem {
 public:
  Decay(double fault_s, bool in_jacobian) : fault_s_(fault_s), in_jacobian_(in_jacobian) {}
  Eigen::Index points() const override { return kLanes; }
  Eigen::Index states() const override { return 1; }
  void Derivatives(double time_s, const ConstBlock& states, Block derivatives) override {
    if (!in_jacobian_) ThrowOnce(time_s);
    derivatives = -states;
  }
  bool StateJacobian(double time_s, const ConstBlock&, Block jacobian) override {
    if (in_jacobian_) ThrowOnce(time_s);
    jacobian = -1;
    return true;
  }

 private:
  void ThrowOnce(double time_s) {
    if (time_s < fault_s_) return;
    fault_s_ = kNever;
    throw std::runtime_error("out of order");
  }

  double fault_s_;
  const bool in_jacobian_;
};

class ThatThrows : public ::testing::TestWithParam<bool> {};

// The global error of ẋ = −x is at most the sum of the local ones; CVODE's estimate of those may be
// too small by a small factor.
TEST_P(ThatThrows, PassesOnWhatIsThrownAndGoesOn) {
  const bool in_jacobian = GetParam();
  // The integrator evaluates the Jacobian at the beginning, and the derivatives along the way.
  Decay system(/*fault_s=*/in_jacobian ? 0 : 0.5, in_jacobian);
  Eigen::ArrayXXd states = Eigen::ArrayXXd::Ones(kLanes, 1);
  const auto integrator = MakeBdfIntegrator(&system, kTolerance, 0, states);
  EXPECT_THROW(integrator->AdvanceTo(1, kNever, kMaxSteps, states), std::runtime_error);
  ASSERT_TRUE(integrator->AdvanceTo(1, kNever, kMaxSteps, states).ok);
  EXPECT_NEAR(states(0, 0), std::exp(-1), 100 * kTolerance);
}

INSTANTIATE_TEST_SUITE_P(BdfIntegrator, ThatThrows, ::testing::Bool(),
                         [](const auto& of) { return of.param ? "Jacobian" : "Derivatives"; });

}  // namespace
}  // namespace polyest::internal::bdf_integrator_test
