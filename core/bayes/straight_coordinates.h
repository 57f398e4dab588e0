#pragma once

// Coordinates u in which sums, or products and ratios, of parameters are straight. Data often
// determine only these, k/m say: where one of the two has a lognormal prior and the other a uniform
// one, the posterior is a thin curved ridge in germ coordinates.
//
//   of sums       u_i = θ_i, if the scale of a logarithmic prior is at most 1
//   of products   u_i = log |θ_i|, if the prior of θ_i has bounds of one sign
//
// and u_i = z_i where that would be affine in the score z_i, or does not exist, or would take long:
// for beta, gamma and truncated normal priors that are correlated.

#include <vector>

#include "core/bayes/prior.h"
#include "core/bayes/region.h"

namespace polyest::internal {

class StraightCoordinates {
 public:
  // Makes those of sums for ParameterMap::kAffine, those of products for kExponential. The prior
  // and the region must outlive the object.
  StraightCoordinates(const Prior& prior, const Region& region, ParameterMap map);

  // Whether u is anything but affine in the local coordinates η.
  bool curved() const { return !curved_.empty(); }

  // Map the rows of `etas` to those of `us`, and back; `log_volumes`, unless null, receives log
  // |dη/du| at each, up to a constant. Rows of u outside of Ω are mapped outside of it, or to what
  // is not a number.
  void FromLocal(const ConstMatrixRef& etas, Matrix& us, Vector* log_volumes) const;
  void ToLocal(const ConstMatrixRef& us, Matrix& etas, Vector& log_volumes) const;

 private:
  struct Curved {
    int parameter;
    double sign;       // of θ, if u is its logarithm
    bool of_own_germ;  // whether the score z is the parameter's own germ, so that θ = T(l + s z)
    double location;   // l
    double scale;      // s
  };

  // Replace the scores z of a parameter in `column` by u, or u by z, and add log |dz/du|, up to a
  // constant, to `log_volumes`, unless null.
  void ToStraight(const Curved& curved, VectorRef column, Vector* log_volumes) const;
  void FromStraight(const Curved& curved, VectorRef column, Vector& log_volumes) const;
  double LogSlope(const Curved& curved, double z, double u) const;  // log |dz/du| by the prior

  const Prior& prior_;
  const Region& region_;
  const ParameterMap map_;
  std::vector<Curved> curved_;
};

}  // namespace polyest::internal
