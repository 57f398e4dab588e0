#include "core/propagation/backward_pass.h"

#include <cmath>
#include <limits>
#include <utility>

namespace polyest::internal {
namespace {

// A pivot of I − M below this is rounding: nothing is left of the variance there.
constexpr double kMinPivot = 16 * std::numeric_limits<double>::epsilon();

Eigen::Index Packed(Eigen::Index n, Eigen::Index i, Eigen::Index j) {
  return GaussianStates::FactorColumn(n, i, j);
}

}  // namespace

BackwardPass::BackwardPass(Eigen::Index members, Eigen::Index states)
    : members_(members),
      n_(states),
      map_(Identity()),
      stage_(members, states * states),
      product_(members, states * states),
      slope_(members, states) {}

BackwardPass::Map BackwardPass::Identity() const {
  Map map{Eigen::ArrayXXd::Zero(members_, n_ * n_), Eigen::ArrayXXd::Zero(members_, n_),
          Eigen::ArrayXXd::Zero(members_, n_ * n_)};
  for (Eigen::Index i = 0; i < n_; ++i) Full(map.A, i, i).setOnes();
  return map;
}

// Replaces the matrix by L⁻¹ times it, row by row; a row whose diagonal element of L is 0 becomes
// 0.
void BackwardPass::Solve(const Eigen::ArrayXXd& factor, Eigen::ArrayXXd& matrix) const {
  for (Eigen::Index i = 0; i < n_; ++i) {
    const auto pivot = factor.col(Packed(n_, i, i));
    for (Eigen::Index j = 0; j < n_; ++j) {
      auto element = Full(matrix, i, j);
      for (Eigen::Index k = 0; k < i; ++k) {
        element -= factor.col(Packed(n_, i, k)) * Full(matrix, k, j);
      }
      element = (pivot.abs() > 0).select(element / pivot, 0);
    }
  }
}

// A ← A X or A Xᵀ
void BackwardPass::Compose(const Eigen::ArrayXXd& matrix, bool transposed) {
  for (Eigen::Index i = 0; i < n_; ++i) {
    for (Eigen::Index j = 0; j < n_; ++j) {
      auto element = Full(product_, i, j);
      element.setZero();
      for (Eigen::Index k = 0; k < n_; ++k) {
        element += Full(map_.A, i, k) * (transposed ? Full(matrix, j, k) : Full(matrix, k, j));
      }
    }
  }
  map_.A.swap(product_);
}

void BackwardPass::AddNoise(const Eigen::ArrayXXd& before, const Eigen::ArrayXXd& after) {
  stage_.setZero();
  for (Eigen::Index j = 0; j < n_; ++j) {
    for (Eigen::Index i = j; i < n_; ++i) Full(stage_, i, j) = before.col(Packed(n_, i, j));
  }
  Solve(after, stage_);
  Compose(stage_, true);
}

void BackwardPass::AddMotion(const Eigen::ArrayXXd& points, const Eigen::ArrayXXd& after) {
  const double half = 0.5 / std::sqrt(static_cast<double>(n_));
  for (Eigen::Index i = 0; i < n_; ++i) {
    for (Eigen::Index j = 0; j < n_; ++j) {
      Full(stage_, i, j) = half * (points.col(i).segment(j * members_, members_) -
                                   points.col(i).segment((n_ + j) * members_, members_));
    }
  }
  Solve(after, stage_);
  Compose(stage_, true);
}

void BackwardPass::AddSample(const Eigen::ArrayXd& outputs, const Eigen::ArrayXd& innovation,
                             const Eigen::ArrayXd& variance, const Eigen::ArrayXd& spread,
                             const Eigen::ArrayXXd& before, const Eigen::ArrayXXd& after) {
  const double half = 0.5 / std::sqrt(static_cast<double>(n_));
  // A hᵀ
  slope_.setZero();
  for (Eigen::Index j = 0; j < n_; ++j) {
    const Eigen::ArrayXd h = half * (outputs.segment(j * members_, members_) -
                                     outputs.segment((n_ + j) * members_, members_));
    for (Eigen::Index i = 0; i < n_; ++i) slope_.col(i) += Full(map_.A, i, j) * h;
  }
  // a ← a + A hᵀ ν/S,  B ← B + (A hᵀ)(A hᵀ)ᵀ/spread
  for (Eigen::Index i = 0; i < n_; ++i) {
    map_.a.col(i) += slope_.col(i) * innovation / variance;
    for (Eigen::Index j = 0; j < n_; ++j) {
      Full(map_.B, i, j) += slope_.col(i) * slope_.col(j) / spread;
    }
  }
  stage_.setZero();
  for (Eigen::Index j = 0; j < n_; ++j) {
    for (Eigen::Index i = j; i < n_; ++i) Full(stage_, i, j) = after.col(Packed(n_, i, j));
  }
  Solve(before, stage_);
  Compose(stage_, false);
}

void BackwardPass::Mark(const GaussianStates& states) {
  Map map = std::exchange(map_, Identity());
  if (!marks_.empty()) marks_.back().map = std::move(map);
  marks_.push_back({{states.mean(), states.factor(), {}}, {}});
}

void BackwardPass::Finish() {
  if (marks_.empty()) return;
  marks_.back().map = std::exchange(map_, Identity());
  Eigen::ArrayXXd epsilon = Eigen::ArrayXXd::Zero(members_, n_);
  Eigen::ArrayXXd M = Eigen::ArrayXXd::Zero(members_, n_ * n_), moved = M;
  for (size_t mark = marks_.size(); mark-- > 0;) {
    Map& map = marks_[mark].map;
    // ε ← A ε + a,  M ← A M Aᵀ + B
    for (Eigen::Index i = 0; i < n_; ++i) {
      for (Eigen::Index k = 0; k < n_; ++k) map.a.col(i) += Full(map.A, i, k) * epsilon.col(k);
      for (Eigen::Index j = 0; j < n_; ++j) {
        Full(moved, i, j).setZero();
        for (Eigen::Index k = 0; k < n_; ++k) {
          Full(moved, i, j) += Full(map.A, i, k) * Full(M, k, j);
        }
      }
    }
    for (Eigen::Index i = 0; i < n_; ++i) {
      for (Eigen::Index j = 0; j < n_; ++j) {
        for (Eigen::Index k = 0; k < n_; ++k) {
          Full(map.B, i, j) += Full(moved, i, k) * Full(map.A, j, k);
        }
      }
    }
    epsilon.swap(map.a);
    M.swap(map.B);
    map = {};
    ScoreJumps(marks_[mark].states, epsilon, M);
    Correct(marks_[mark].states, epsilon, M);
  }
}

// With L v = e_i, r_i = vᵀ ε and N_ii = vᵀ M v; the first i elements of v are 0.
void BackwardPass::ScoreJumps(Marked& states, const Eigen::ArrayXXd& epsilon,
                              const Eigen::ArrayXXd& M) const {
  states.jump_scores.setZero(members_, n_);
  Eigen::ArrayXXd v(members_, n_);
  for (Eigen::Index state = 0; state < n_; ++state) {
    Eigen::ArrayXd r = Eigen::ArrayXd::Zero(members_), N = r;
    for (Eigen::Index i = state; i < n_; ++i) {
      v.col(i).setConstant(i == state ? 1 : 0);
      for (Eigen::Index k = state; k < i; ++k) {
        v.col(i) -= states.factor.col(Packed(n_, i, k)) * v.col(k);
      }
      const auto pivot = states.factor.col(Packed(n_, i, i));
      v.col(i) = (pivot.abs() > 0).select(v.col(i) / pivot, 0).eval();
      r += v.col(i) * epsilon.col(i);
    }
    for (Eigen::Index i = state; i < n_; ++i) {
      for (Eigen::Index k = state; k < n_; ++k) N += v.col(i) * Full(M, i, k) * v.col(k);
    }
    states.jump_scores.col(state) = (N > 0).select(r / N.sqrt(), 0);
  }
}

// Sets m ← m + L ε and L ← L C with C Cᵀ = I − M.
void BackwardPass::Correct(Marked& states, const Eigen::ArrayXXd& epsilon,
                           const Eigen::ArrayXXd& M) const {
  Eigen::ArrayXXd C = Eigen::ArrayXXd::Zero(members_, states.factor.cols()), factor = C;
  for (Eigen::Index j = 0; j < n_; ++j) {
    for (Eigen::Index i = j; i < n_; ++i) {
      Eigen::ArrayXd element = (i == j ? 1.0 : 0.0) - Full(M, i, j);
      for (Eigen::Index k = 0; k < j; ++k) {
        element -= C.col(Packed(n_, i, k)) * C.col(Packed(n_, j, k));
      }
      const auto pivot = C.col(Packed(n_, j, j));
      C.col(Packed(n_, i, j)) = i == j
                                    ? (element > kMinPivot).select(element.max(0).sqrt(), 0).eval()
                                    : (pivot > 0).select(element / pivot, 0).eval();
    }
  }
  for (Eigen::Index j = 0; j < n_; ++j) {
    for (Eigen::Index i = j; i < n_; ++i) {
      states.mean.col(i) += states.factor.col(Packed(n_, i, j)) * epsilon.col(j);
      for (Eigen::Index k = j; k <= i; ++k) {
        factor.col(Packed(n_, i, j)) +=
            states.factor.col(Packed(n_, i, k)) * C.col(Packed(n_, k, j));
      }
    }
  }
  states.factor.swap(factor);
}

}  // namespace polyest::internal
