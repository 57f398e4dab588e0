#pragma once

// What the windows of the record say of an estimate: whether they agree with each other, and how
// much wider its uncertainty is where the residuals contradict the noise or the model.

#include <optional>
#include <vector>

#include "core/estimator/posterior/constancy.h"
#include "core/estimator/posterior/robust_covariance.h"
#include "core/estimator/record/record_summary.h"
#include "polyest/estimate.h"

namespace polyest::internal {

// The limit of the disagreement r above which windows are said to disagree.
inline constexpr double kDisagreement = 2;

struct WindowAssessment {
  RobustCovariance robust;
  std::optional<Inconsistency> inconsistency;
  // Whether residuals or windows contradict the noise or the model.
  bool contradicted = false;
  // Per parameter: the factor ≥ 1 of its standard deviation and interval. It is 1 unless the
  // estimate is contradicted: then it is the robust standard deviation ÷ the model's own or, where
  // there are too few windows for that, the residuals' standard deviation ÷ the noise's.
  Vector widening;
  // Per parameter: whether it must not be called identified, because it changes over the record, or
  // because the windows disagree and its robust standard deviation is more than twice the model's.
  std::vector<bool> doubtful;
  // The windows' own estimates; none unless windows disagree or a parameter changes.
  std::vector<WindowEstimate> estimates;

  // Returns whether the windows disagree.
  bool Disagree() const { return robust.significant && robust.disagreement > kDisagreement; }
};

// Assesses the windows at `eta` (local coordinates). `channels` are those of the estimate,
// `degrees` are their degrees of freedom, `record` is the record's summary.
WindowAssessment AssessWindows(const RegionalExpansion& expansion, const ResolvedProblem& problem,
                               const RecordSummary& record,
                               const std::vector<ChannelEstimate>& channels,
                               const std::vector<double>& degrees, const Vector& eta,
                               double regularization);

// Returns parameter i when its score has changed from that at `xi` by `change` ± `std_dev` prior
// standard deviations; the value lies within the parameter's bounds.
WindowParameter ChangedParameter(const Prior& prior, const Vector& xi, int i, double change,
                                 double std_dev);

}  // namespace polyest::internal
