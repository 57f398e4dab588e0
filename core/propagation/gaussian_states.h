#pragma once

// The states of many filters at once: each member has the mean m (n) and the covariance P = L Lᵀ (n
// × n) of a Gaussian. L is lower triangular and is all that is kept of P, so P is symmetric and
// positive semidefinite whatever the rounding; it may be 0 (states that are known). All operations
// are loops over the states, vectorized over the members, and none allocates.
//
// The square-root cubature Kalman filter takes the moments of a function of the states as means
// over 2n points,
//
//   X_j = m + √n L e_j,   X_{n+j} = m − √n L e_j,   j = 0 … n − 1,
//
// which are exact for polynomials of degree 3. Sums of squares of vectors become triangular by an
// orthogonal transformation from the right, here modified Gram–Schmidt, whose triangular factor is
// as accurate as Householder's (Higham, Accuracy and Stability of Numerical Algorithms, 2002, ch.
// 19).
//
// Source: Arasaratnam and Haykin, Cubature Kalman Filters, IEEE Transactions on Automatic Control
// 54 (2009) 1254–1269.

#include <Eigen/Core>

namespace polyest::internal {

class GaussianStates {
 public:
  // Begins with m = 0 and P = 0.
  GaussianStates(Eigen::Index members, Eigen::Index states);

  Eigen::Index members() const { return mean_.rows(); }
  Eigen::Index states() const { return mean_.cols(); }
  Eigen::ArrayXXd& mean() { return mean_; }              // members × n
  const Eigen::ArrayXXd& mean() const { return mean_; }  // members × n
  // Members × n (n + 1)/2: L_ij, i ≥ j, is in column FactorColumn(n, i, j).
  Eigen::ArrayXXd& factor() { return factor_; }
  const Eigen::ArrayXXd& factor() const { return factor_; }

  // Returns the column of a factor that has L_ij, i ≥ j, of n states.
  static Eigen::Index FactorColumn(Eigen::Index n, Eigen::Index i, Eigen::Index j) {
    return j * n - j * (j - 1) / 2 + i - j;
  }

  // Returns the standard deviations of the states (members × n).
  Eigen::ArrayXXd Deviations() const;

  // Adds `spectral_densities` (members × n, of independent noises) times `duration_s` to P.
  void Diffuse(const Eigen::ArrayXXd& spectral_densities, double duration_s);
  // Writes the points: row s · members + i of `points` (at least 2n · members rows, n columns) is
  // X_s of member i, or with a `part` below 1 the point at that part of the way from m to X_s.
  void Draw(Eigen::ArrayXXd& points, double part = 1) const;
  // Takes mean and covariance of points that Draw wrote and the model has moved.
  void Collect(const Eigen::ArrayXXd& points);
  // Takes one sample into account. `outputs` (at least 2n · members) are the values at the points
  // that Draw would write, ẑ their mean, z the sample and r the variance of its noise (members),
  // which is used up. Writes ν = z
  // − ẑ and its variance S, and takes
  //   K = P_xz/S,   m ← m + K ν,   P ← P − K S Kᵀ.
  void Update(const Eigen::ArrayXd& outputs, double z, Eigen::ArrayXd& r,
              Eigen::ArrayXd& innovation, Eigen::ArrayXd& variance);
  // The two halves of Update. Compare writes ν and adds the variance of the outputs to `variance`;
  // Correct takes S and r as they are then, which may be those of another noise (heavy_tail.h).
  void Compare(const Eigen::ArrayXd& outputs, double z, Eigen::ArrayXd& innovation,
               Eigen::ArrayXd& variance);
  void Correct(const Eigen::ArrayXd& innovation, const Eigen::ArrayXd& variance, Eigen::ArrayXd& r);

  // For a sample of a curved output (output_quadrature.h). FindDirection, after Compare, takes for
  // u the unit vector in which the output changes most with ε, x = m + L ε, by the outputs at the
  // points, and returns the slopes c there (members); where c is 0, u is 0, and 1 for a single
  // state. TurnToGradient takes for u the gradient at m instead, by the outputs at points that were
  // drawn with `part`, unless it is almost 0 there: for a function of one combination of the states
  // that is its direction, however curved it is. TurnBack undoes that for one member. DrawAlong
  // writes m + L u s for `count` ≤ 2n columns of s (members × count) into rows as Draw's; the rest
  // is m. ProjectionsTo writes uᵀ ε of the 2n points. Squeeze takes m ← m + E L u, P ← L (I − (1 −
  // V) u uᵀ) Lᵀ.
  const Eigen::ArrayXd& FindDirection();
  void TurnToGradient(const Eigen::ArrayXXd& outputs, double part);
  void TurnBack(Eigen::Index member);
  void DrawAlong(const Eigen::Ref<const Eigen::ArrayXXd>& s, Eigen::ArrayXXd& points) const;
  void ProjectionsTo(Eigen::ArrayXXd& s) const;
  void Squeeze(const Eigen::ArrayXd& mean, const Eigen::ArrayXd& variance);

 private:
  auto L(Eigen::Index i, Eigen::Index j) { return factor_.col(FactorColumn(states(), i, j)); }
  auto L(Eigen::Index i, Eigen::Index j) const { return factor_.col(FactorColumn(states(), i, j)); }
  // Column of the vectors' memory with component i of vector `vector`.
  Eigen::Index Component(Eigen::Index i, Eigen::Index vector) const {
    return vector * states() + i;
  }
  void LookAlong();
  void Triangularize(Eigen::Index vectors);

  Eigen::ArrayXXd mean_, factor_;
  // Members × (2n + 1) n: vectors v with P = Σ v vᵀ.
  Eigen::ArrayXXd vectors_;
  Eigen::ArrayXXd gain_;               // members × n
  Eigen::ArrayXXd deviation_;          // members × 2n, of the outputs
  Eigen::ArrayXXd direction_, along_;  // u and L u, members × n
  Eigen::ArrayXXd former_;             // u before TurnToGradient
  Eigen::ArrayXd slope_;               // c
  Eigen::ArrayXd length_, inverse_, product_;
};

}  // namespace polyest::internal
