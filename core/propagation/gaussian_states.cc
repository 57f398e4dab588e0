#include "core/propagation/gaussian_states.h"

#include <cmath>

namespace polyest::internal {
namespace {

// A gradient so small beside the slope over the points says nothing of the direction.
constexpr double kMinGradient = 1e-6;

}  // namespace

GaussianStates::GaussianStates(Eigen::Index members, Eigen::Index states)
    : mean_(Eigen::ArrayXXd::Zero(members, states)),
      factor_(Eigen::ArrayXXd::Zero(members, states * (states + 1) / 2)),
      vectors_(members, (2 * states + 1) * states),
      gain_(members, states),
      deviation_(members, 2 * states),
      direction_(members, states),
      along_(members, states),
      former_(members, states),
      slope_(members),
      length_(members),
      inverse_(members),
      product_(members) {}

Eigen::ArrayXXd GaussianStates::Deviations() const {
  Eigen::ArrayXXd variances = Eigen::ArrayXXd::Zero(members(), states());
  for (Eigen::Index j = 0; j < states(); ++j) {
    for (Eigen::Index i = j; i < states(); ++i) variances.col(i) += L(i, j).square();
  }
  return variances.sqrt();
}

void GaussianStates::Diffuse(const Eigen::ArrayXXd& spectral_densities, double duration_s) {
  const Eigen::Index n = states();
  for (Eigen::Index a = 0; a < n; ++a) {
    // P + v vᵀ with v = √(q Δt) e_a, by one Givens rotation for each column of L.
    auto v = vectors_.leftCols(n);
    v.setZero();
    v.col(a) = (spectral_densities.col(a) * duration_s).sqrt();
    if ((v.col(a) == 0).all()) continue;
    for (Eigen::Index j = a; j < n; ++j) {
      length_ = (L(j, j).square() + v.col(j).square()).sqrt();
      inverse_ = (length_ > 0).select(length_.inverse(), 0);
      // c = L_jj/length, s = v_j/length; the identity where both are 0
      gain_.col(0) = (length_ > 0).select(L(j, j) * inverse_, 1);
      product_ = v.col(j) * inverse_;
      L(j, j) = length_;
      for (Eigen::Index i = j + 1; i < n; ++i) {
        inverse_ = v.col(i);
        v.col(i) = gain_.col(0) * inverse_ - product_ * L(i, j);
        L(i, j) = gain_.col(0) * L(i, j) + product_ * inverse_;
      }
    }
  }
}

void GaussianStates::Draw(Eigen::ArrayXXd& points, double part) const {
  const Eigen::Index n = states(), m = members();
  const double root = part * std::sqrt(static_cast<double>(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      auto plus = points.col(i).segment(j * m, m);
      auto minus = points.col(i).segment((n + j) * m, m);
      if (j > i) {
        plus = minus = mean_.col(i);
      } else {
        plus = mean_.col(i) + root * L(i, j);
        minus = mean_.col(i) - root * L(i, j);
      }
    }
  }
}

void GaussianStates::Collect(const Eigen::ArrayXXd& points) {
  const Eigen::Index n = states(), m = members();
  const double share = 1 / static_cast<double>(2 * n);
  const double root = std::sqrt(share);
  for (Eigen::Index i = 0; i < n; ++i) {
    // The mean is taken about one of the points, since deviations may be far smaller than it is.
    const auto first = points.col(i).head(m);
    product_.setZero();
    for (Eigen::Index s = 1; s < 2 * n; ++s) product_ += points.col(i).segment(s * m, m) - first;
    mean_.col(i) = first + share * product_;
    for (Eigen::Index s = 0; s < 2 * n; ++s) {
      vectors_.col(Component(i, s)) = root * (points.col(i).segment(s * m, m) - mean_.col(i));
    }
  }
  Triangularize(2 * n);
}

void GaussianStates::Update(const Eigen::ArrayXd& outputs, double z, Eigen::ArrayXd& r,
                            Eigen::ArrayXd& innovation, Eigen::ArrayXd& variance) {
  variance = r;
  Compare(outputs, z, innovation, variance);
  Correct(innovation, variance, r);
}

void GaussianStates::Compare(const Eigen::ArrayXd& outputs, double z, Eigen::ArrayXd& innovation,
                             Eigen::ArrayXd& variance) {
  const Eigen::Index n = states(), m = members();
  const double share = 1 / static_cast<double>(2 * n);
  const double root = std::sqrt(share);
  const auto first = outputs.head(m);
  product_.setZero();
  for (Eigen::Index s = 1; s < 2 * n; ++s) product_ += outputs.segment(s * m, m) - first;
  product_ = first + share * product_;  // ẑ
  innovation = z - product_;
  for (Eigen::Index s = 0; s < 2 * n; ++s) {
    deviation_.col(s) = root * (outputs.segment(s * m, m) - product_);
    variance += deviation_.col(s).square();
  }
}

void GaussianStates::Correct(const Eigen::ArrayXd& innovation, const Eigen::ArrayXd& variance,
                             Eigen::ArrayXd& r) {
  const Eigen::Index n = states();
  // The points deviate from the mean by ±√(1/2) L e_j, in units of the root of their number.
  const double half = std::sqrt(0.5);
  for (Eigen::Index i = 0; i < n; ++i) {
    gain_.col(i).setZero();
    for (Eigen::Index j = 0; j <= i; ++j) {
      gain_.col(i) += half * L(i, j) * (deviation_.col(j) - deviation_.col(n + j));
    }
    gain_.col(i) /= variance;
    mean_.col(i) += gain_.col(i) * innovation;
  }
  // P − K S Kᵀ = Σ (x − K e)(x − K e)ᵀ + K r Kᵀ, in which nothing is subtracted.
  r = r.sqrt();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index s = 0; s < 2 * n; ++s) {
      auto component = vectors_.col(Component(i, s));
      component = -gain_.col(i) * deviation_.col(s);
      const Eigen::Index j = s % n;
      if (j <= i) component += (s < n ? half : -half) * L(i, j);
    }
    vectors_.col(Component(i, 2 * n)) = r * gain_.col(i);
  }
  Triangularize(2 * n + 1);
}

const Eigen::ArrayXd& GaussianStates::FindDirection() {
  const Eigen::Index n = states();
  const double half = std::sqrt(0.5);
  slope_.setZero();
  for (Eigen::Index j = 0; j < n; ++j) {
    direction_.col(j) = half * (deviation_.col(j) - deviation_.col(n + j));
    slope_ += direction_.col(j).square();
  }
  slope_ = slope_.sqrt();
  for (Eigen::Index j = 0; j < n; ++j) {
    direction_.col(j) = (slope_ > 0).select(direction_.col(j) / slope_, n == 1 ? 1 : 0);
  }
  LookAlong();
  return slope_;
}

void GaussianStates::TurnToGradient(const Eigen::ArrayXXd& outputs, double part) {
  const Eigen::Index n = states();
  const double half = 0.5 / (part * std::sqrt(static_cast<double>(n)));
  former_ = direction_;
  gain_ = half * (outputs.leftCols(n) - outputs.middleCols(n, n));
  length_ = gain_.square().rowwise().sum().sqrt();
  for (Eigen::Index j = 0; j < n; ++j) {
    direction_.col(j) =
        (length_ > kMinGradient * slope_).select(gain_.col(j) / length_, direction_.col(j));
  }
  LookAlong();
}

void GaussianStates::TurnBack(Eigen::Index member) {
  direction_.row(member) = former_.row(member);
  for (Eigen::Index i = 0; i < states(); ++i) {
    along_(member, i) = 0;
    for (Eigen::Index j = 0; j <= i; ++j) {
      along_(member, i) += L(i, j)[member] * direction_(member, j);
    }
  }
}

// Sets L u.
void GaussianStates::LookAlong() {
  for (Eigen::Index i = 0; i < states(); ++i) {
    along_.col(i).setZero();
    for (Eigen::Index j = 0; j <= i; ++j) along_.col(i) += L(i, j) * direction_.col(j);
  }
}

void GaussianStates::DrawAlong(const Eigen::Ref<const Eigen::ArrayXXd>& s,
                               Eigen::ArrayXXd& points) const {
  const Eigen::Index n = states(), m = members();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index k = 0; k < 2 * n; ++k) {
      auto component = points.col(i).segment(k * m, m);
      component = mean_.col(i);
      if (k < s.cols()) component += s.col(k) * along_.col(i);
    }
  }
}

void GaussianStates::ProjectionsTo(Eigen::ArrayXXd& s) const {
  const Eigen::Index n = states();
  const double root = std::sqrt(static_cast<double>(n));
  for (Eigen::Index j = 0; j < n; ++j) {
    s.col(j) = root * direction_.col(j);
    s.col(n + j) = -root * direction_.col(j);
  }
}

void GaussianStates::Squeeze(const Eigen::ArrayXd& mean, const Eigen::ArrayXd& variance) {
  const Eigen::Index n = states();
  // L (I + (√V − 1) u uᵀ)
  product_ = variance.sqrt() - 1;
  for (Eigen::Index i = 0; i < n; ++i) {
    mean_.col(i) += mean * along_.col(i);
    for (Eigen::Index j = 0; j < n; ++j) {
      auto component = vectors_.col(Component(i, j));
      component = product_ * along_.col(i) * direction_.col(j);
      if (j <= i) component += L(i, j);
    }
  }
  Triangularize(n);
}

// Sets L with L Lᵀ = Σ v vᵀ over the first `vectors` vectors, which it uses up. Component i of all
// vectors is a row; the rows are made orthogonal one after the other.
void GaussianStates::Triangularize(Eigen::Index vectors) {
  const Eigen::Index n = states();
  for (Eigen::Index i = 0; i < n; ++i) {
    length_.setZero();
    for (Eigen::Index s = 0; s < vectors; ++s) length_ += vectors_.col(Component(i, s)).square();
    length_ = length_.sqrt();
    L(i, i) = length_;
    inverse_ = (length_ > 0).select(length_.inverse(), 0);
    for (Eigen::Index s = 0; s < vectors; ++s) vectors_.col(Component(i, s)) *= inverse_;
    for (Eigen::Index k = i + 1; k < n; ++k) {
      product_.setZero();
      for (Eigen::Index s = 0; s < vectors; ++s) {
        product_ += vectors_.col(Component(k, s)) * vectors_.col(Component(i, s));
      }
      L(k, i) = product_;
      for (Eigen::Index s = 0; s < vectors; ++s) {
        vectors_.col(Component(k, s)) -= product_ * vectors_.col(Component(i, s));
      }
    }
  }
}

}  // namespace polyest::internal
