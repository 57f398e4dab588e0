#pragma once

// Coordinates u in which products and ratios of parameters are straight. Data often determine
// only these, k/m say: where one of the two has a lognormal prior and the other a uniform one, the
// posterior is a thin curved ridge in germ coordinates, but a straight one in u.
//
//   u_i = log |θ_i|   if the prior of θ_i is of one sign, and log |θ_i| not affine in the score,
//   u_i = z_i         else.

#include <vector>

#include "core/bayes/prior.h"
#include "core/bayes/region.h"

namespace polyest::internal {

class LogCoordinates {
 public:
  // Both arguments must outlive the object.
  LogCoordinates(const Prior& prior, const Region& region);

  // Whether u is anything but affine in the local coordinates η.
  bool curved() const { return !curved_.empty(); }

  // Map the rows of `etas` to those of `us`, and back; `log_volumes` receives log |dη/du| at each,
  // up to a constant. Rows of u outside of Ω are mapped outside of it, or to what is not a number.
  void FromLocal(const ConstMatrixRef& etas, Matrix& us, Vector& log_volumes) const;
  void ToLocal(const ConstMatrixRef& us, Matrix& etas, Vector& log_volumes) const;

 private:
  struct Curved {
    int parameter;
    double sign;  // of θ
  };

  // Returns log |dz/du| of a parameter with u = log |θ|.
  double LogSlope(int parameter, double z, double u) const;

  const Prior& prior_;
  const Region& region_;
  std::vector<Curved> curved_;
};

}  // namespace polyest::internal
