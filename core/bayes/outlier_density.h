#pragma once

// The density that noise with outliers gives to weighted samples, in constant memory.
//
// Weights turn such samples into mismatch sums (noise.h), which tell where the posterior is and how
// wide, but their value is not −log of the density of the samples. That is kept besides, at the
// point at which the weights were decided: with u_k = e_k/√v_k the residuals there in units of the
// working noise, and e^x a factor of its size,
//
//   −log p(x) = Σ ρ(u_k e^{−x}) + N x + N c + Σ ½ log v_k,
//
// −log of the density of one u being ρ + c (RobustLoss, LackOfDensity), and its curvature in the
// predictions Σ ρ″(u_k e^{−x}) e^{−2x}/v_k, both at the nodes of a grid of x, or at 0 alone if the
// size is known. Over the posterior of many samples, which is narrow, that is enough.

#include <cstdint>
#include <optional>

#include "core/common/types.h"
#include "polyest/noise.h"

namespace polyest::internal {

class OutlierDensity {
 public:
  // Without outliers (kNone) it stands for a channel of which nothing is kept.
  explicit OutlierDensity(OutlierHandling outliers = OutlierHandling::kNone,
                          bool size_unknown = false);

  OutlierHandling outliers() const { return outliers_; }
  // Whether the handling and the sizes are those of `fresh`, and all numbers are finite.
  bool IsValidLike(const OutlierDensity& fresh) const;

  // Adds one sample with the residual u. `precision` is v/R, R being the variance that it has in
  // the sums, and `excess` what their normalization has for it in place of ½ log v.
  void Add(double u, double precision, double excess);
  // Returns the sum of what the normalization of the sums has in place of Σ ½ log v.
  double excess() const { return excess_; }

  // The density of all samples but for e^{−Σ ½ log v}.
  struct Value {
    double log_density = 0;
    double curvature = 0;  // Σ ρ″/v relative to Σ 1/R of the sums
    // The slope in the predictions relative to that of the sums, whatever the direction: where it
    // is 0 hardly depends on the size, so that it changes with the size as the curvature does.
    double slope = 0;
  };
  // Returns it for noise of known size.
  Value OfKnownSize() const;
  // Returns it for noise of unknown size, log ∫ p(x) dx by the trapezoidal rule on polynomials
  // through six nodes, with the curvature at the most probable x. Returns nothing if p has not
  // vanished at the ends of the grid, where the working noise is off by a factor 4.
  std::optional<Value> OfUnknownSize() const;

  // Write to or read from a cereal archive. What is read is not checked.
  template <class Archive>
  void save(Archive& archive) const {
    archive(static_cast<int>(outliers_), count_, excess_, precision_, losses_, curvatures_);
  }
  template <class Archive>
  void load(Archive& archive) {
    int outliers = 0;
    archive(outliers, count_, excess_, precision_, losses_, curvatures_);
    outliers_ = static_cast<OutlierHandling>(outliers);
  }

 private:
  double NormalizationOfAll() const;  // N c

  OutlierHandling outliers_;
  int64_t count_ = 0;
  double excess_ = 0;
  double precision_ = 0;  // Σ v/R
  Vector losses_;         // Σ ρ(u e^{−x}) at the nodes; empty without outliers
  Vector curvatures_;     // Σ ρ″(u e^{−x}) e^{−2x}
};

}  // namespace polyest::internal
