#pragma once

// What a sample tells a Gaussian of the states where the measured output is curved over the
// Gaussian's width, for many filters at once.
//
// Problem: the states are x = m + L ε, ε ~ N(0, I), and the sample is z = h(x) + e, e with the
// scale σ. Along the unit vector u in which the output changes most, s = uᵀ ε ~ N(0, 1) and
//
//   h(x) = h(m + L u s) + d,
//
// where d is taken for independent of s, with mean μ and variance V_d: 0 for a function of one
// combination of the states, such as any function of one state. Then
//
//   p(z) = ∫ N(s; 0, 1) p_e(z − h(m + L u s) − μ) ds,   E = E[s | z],   V = Var[s | z],
//   m ← m + L u E,   P ← L (I − (1 − V) u uᵀ) Lᵀ,
//
// p_e with the squared scale R = r + V_d. These are the likelihood and the moments of the states
// without a linearization of h, which is all that the filter keeps of them (assumed density). For a
// linear h they are those of the Kalman filter. Where h saturates or grows exponentially, the
// filter's own p(z) = N(z; ẑ, S) may be off by several nats in a sample.
//
// The integral is taken by the trapezoidal rule over nodes that close in on where the integrand is,
// and are then divided, until −Δ² log of the integrand, (step/standard deviation)² of a Gaussian,
// is at most 1 there. For a Gaussian the rule's relative error is then 2 e^{−2π²} = 5e-9.
//
// Sources: Maybeck, Stochastic Models, Estimation, and Control 2 (1982), ch. 12, for the assumed
// density filter; Trefethen and Weideman, The Exponentially Convergent Trapezoidal Rule, SIAM
// Review 56 (2014) 385–458.

#include <Eigen/Core>
#include <vector>

namespace polyest::internal {

class OutputQuadrature {
 public:
  static constexpr Eigen::Index kNodes = 32;

  explicit OutputQuadrature(Eigen::Index members);

  // Begins with a sample of the value z, whose noise has the scale `stated` > 0 as stated, and R
  // (members) as `squared_scales`; Student's t of HeavyTail if `tailed`. `shifts`: μ (members).
  // `used` (by member): whether the member is asked for.
  void Begin(double z, double stated, bool tailed, const Eigen::ArrayXd& squared_scales,
             const Eigen::ArrayXd& shifts, const std::vector<bool>& used);
  // The nodes s and, to be filled in by the caller, h(m + L u s) there; both members × kNodes. A
  // value that is not finite is one that cannot be.
  const Eigen::ArrayXXd& nodes() const { return nodes_; }
  Eigen::ArrayXXd& values() { return values_; }
  // Takes the values. Returns whether those at other nodes are needed.
  bool Refine();

  // After Refine has returned false, whether member i has an integral: there is none where no node
  // has a finite value, or none near the integrand was found.
  bool Found(Eigen::Index i) const { return lines_[static_cast<size_t>(i)].found; }
  // −2 log(p(z)/p_0), p_0 the density of e at 0 with the noise as stated.
  double Deviance(Eigen::Index i) const { return lines_[static_cast<size_t>(i)].deviance; }
  double Mean(Eigen::Index i) const { return lines_[static_cast<size_t>(i)].mean; }          // E
  double Variance(Eigen::Index i) const { return lines_[static_cast<size_t>(i)].variance; }  // V
  // Mean and variance of h + μ before the sample.
  double OutputMean(Eigen::Index i) const { return lines_[static_cast<size_t>(i)].output_mean; }
  double OutputVariance(Eigen::Index i) const {
    return lines_[static_cast<size_t>(i)].output_variance;
  }

 private:
  // One member's integral.
  struct Line {
    double first = 0, step = 0;  // of its nodes
    int panels = 1, panel = 0;   // of kNodes each: how many, and the present one
    bool done = false, found = false;
    double top = 0;              // of the integrand's logarithm
    double curvature = 0;        // the largest −Δ² of it so far
    double sum = 0, square = 0;  // Σ e^{log − top}, Σ e^{log − top} (s − E)²
    double deviance = 0, mean = 0, variance = 1, output_mean = 0, output_variance = 0;
  };

  void PlaceNodes();
  void DescribeOutput(Eigen::Index i);
  double LogDensity(double error, double squared_scale) const;
  void TakeLogs(Eigen::Index i);
  void Advance(Eigen::Index i);
  bool CloseIn(Eigen::Index i);
  void AddCurvature(Line& line) const;
  void Add(Eigen::Index i);
  static void Divide(Line& line, int panels);

  double z_ = 0, stated_ = 1;
  bool tailed_ = false;
  int rounds_ = 0;
  Eigen::ArrayXd squared_scales_, shifts_;  // members
  Eigen::ArrayXXd nodes_, values_;          // members × kNodes
  Eigen::ArrayXd logs_;                     // of the integrand at one member's nodes
  std::vector<Line> lines_;
};

}  // namespace polyest::internal
