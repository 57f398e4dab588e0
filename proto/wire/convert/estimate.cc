#include "proto/wire/convert/estimate.h"

#include <algorithm>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

v1::Identifiability::Verdict ToProto(Verdict verdict) {
  switch (verdict) {
    case Verdict::kIdentified:
      return v1::Identifiability::IDENTIFIED;
    case Verdict::kWeak:
      return v1::Identifiability::WEAK;
    case Verdict::kNotIdentified:
      return v1::Identifiability::NOT_IDENTIFIED;
  }
  POLYEST_CHECK(false);
}

v1::Diagnostic::Code ToProto(DiagnosticCode code) {
  switch (code) {
    case DiagnosticCode::kNotIdentified:
      return v1::Diagnostic::NOT_IDENTIFIED;
    case DiagnosticCode::kUndersampled:
      return v1::Diagnostic::UNDERSAMPLED;
    case DiagnosticCode::kExpansionInaccurate:
      return v1::Diagnostic::EXPANSION_INACCURATE;
    case DiagnosticCode::kModelMisfit:
      return v1::Diagnostic::MODEL_MISFIT;
    case DiagnosticCode::kAtPriorBound:
      return v1::Diagnostic::AT_PRIOR_BOUND;
    case DiagnosticCode::kMultipleMinima:
      return v1::Diagnostic::MULTIPLE_MINIMA;
    case DiagnosticCode::kNotConverged:
      return v1::Diagnostic::NOT_CONVERGED;
    case DiagnosticCode::kPointsFailed:
      return v1::Diagnostic::POINTS_FAILED;
    case DiagnosticCode::kNonGaussian:
      return v1::Diagnostic::NON_GAUSSIAN;
    case DiagnosticCode::kCorrelatedResiduals:
      return v1::Diagnostic::CORRELATED_RESIDUALS;
    case DiagnosticCode::kNoiseNotLearned:
      return v1::Diagnostic::NOISE_NOT_LEARNED;
    case DiagnosticCode::kRegularizationNotDetermined:
      return v1::Diagnostic::REGULARIZATION_NOT_DETERMINED;
    case DiagnosticCode::kSuspiciousData:
      return v1::Diagnostic::SUSPICIOUS_DATA;
    case DiagnosticCode::kInconsistentOverTime:
      return v1::Diagnostic::INCONSISTENT_OVER_TIME;
    case DiagnosticCode::kReplayPostponed:
      return v1::Diagnostic::REPLAY_POSTPONED;
    case DiagnosticCode::kWindowsDisagree:
      return v1::Diagnostic::WINDOWS_DISAGREE;
    case DiagnosticCode::kPriorDataConflict:
      return v1::Diagnostic::PRIOR_DATA_CONFLICT;
    case DiagnosticCode::kFixedValueConflict:
      return v1::Diagnostic::FIXED_VALUE_CONFLICT;
  }
  POLYEST_CHECK(false);
}

void ToProto(const ParameterEstimate& parameter, v1::ParameterEstimate& proto) {
  proto.set_name(parameter.name);
  proto.set_unit(parameter.unit);
  proto.set_map(parameter.map);
  proto.set_std_dev(parameter.std_dev);
  proto.set_mean(parameter.mean);
  proto.set_lower95(parameter.lower95);
  proto.set_upper95(parameter.upper95);
  proto.set_prior_mean(parameter.prior_mean);
  proto.set_prior_std_dev(parameter.prior_std_dev);
  proto.set_contraction(parameter.contraction);
  proto.set_verdict(ToProto(parameter.verdict));
  proto.set_posterior_std_dev(parameter.posterior_std_dev);
  proto.set_bias(parameter.bias);
  proto.set_robust_std_dev(parameter.robust_std_dev);
}

void ToProto(const ChannelEstimate& channel, v1::ChannelEstimate& proto) {
  proto.set_output(channel.output);
  proto.set_samples(channel.samples);
  proto.set_chi_squared(channel.chi_squared);
  proto.set_noise_std_dev(channel.noise_std_dev);
  proto.set_lag1_correlation(channel.lag1_correlation);
  proto.set_effective_samples(channel.effective_samples);
  proto.set_noise_time_constant_s(channel.noise_time_constant_s);
  proto.set_noise_white_share(channel.noise_white_share);
  proto.set_outliers(channel.outliers);
}

void ToProto(const ExpansionSummary& expansion, v1::ExpansionSummary& proto) {
  proto.set_order(expansion.order);
  proto.set_terms(expansion.terms);
  proto.set_points(expansion.points);
  proto.set_residual_to_noise(expansion.residual_to_noise);
  proto.set_reexpansions(expansion.reexpansions);
  proto.set_trajectories(expansion.trajectories);
  if (expansion.pareto_shape) proto.set_pareto_shape(*expansion.pareto_shape);
}

void AddComponents(const Estimate& estimate, v1::Estimate& proto) {
  for (const ComponentEstimate& component : estimate.components) {
    v1::MixtureComponent& added = *proto.add_components();
    added.set_weight(component.weight);
    for (const auto& parameter : component.parameters) ToProto(parameter, *added.add_parameters());
  }
}

void AddWindows(const Estimate& estimate, v1::Estimate& proto) {
  for (const WindowEstimate& window : estimate.windows) {
    v1::WindowEstimate& added = *proto.add_windows();
    added.set_first_run(window.first_run);
    added.set_last_run(window.last_run);
    added.set_start_time_s(window.start_s);
    added.set_end_time_s(window.end_s);
    for (const WindowParameter& parameter : window.parameters) {
      v1::WindowEstimate::Value& value = *added.add_values();
      value.set_parameter(estimate.parameters[static_cast<size_t>(parameter.parameter)].name);
      value.set_value(parameter.value);
      value.set_std_dev(parameter.std_dev);
    }
  }
}

void AddFiltered(const Estimate& estimate, v1::Estimate& proto) {
  for (const FilteredQuantity& quantity : estimate.filtered) {
    v1::FilteredQuantity& added = *proto.add_filtered();
    added.set_name(quantity.name);
    added.set_unit(quantity.unit);
    added.set_mean(quantity.mean);
    added.set_std_dev(quantity.std_dev);
    added.set_lower95(quantity.lower95);
    added.set_upper95(quantity.upper95);
  }
}

void AddTradeOffs(const Estimate& estimate, v1::Estimate& proto) {
  for (const TradeOff& trade_off : estimate.trade_offs) {
    v1::TradeOff& added = *proto.add_trade_offs();
    added.set_first(estimate.parameters[static_cast<size_t>(trade_off.first)].name);
    added.set_second(estimate.parameters[static_cast<size_t>(trade_off.second)].name);
    added.set_combination(trade_off.combination);
    added.set_relative_std_dev(trade_off.relative_std_dev);
    added.set_first_alone(trade_off.first_alone);
    added.set_second_alone(trade_off.second_alone);
  }
}

void AddDirections(const Estimate& estimate, v1::Estimate& proto) {
  for (const Direction& direction : estimate.directions) {
    v1::Direction& added = *proto.add_directions();
    added.set_information(direction.information);
    added.set_verdict(ToProto(direction.verdict));
    for (size_t i = 0; i < estimate.parameters.size(); ++i) {
      v1::Direction::Coefficient& coefficient = *added.add_coefficients();
      coefficient.set_parameter(estimate.parameters[i].name);
      coefficient.set_value(direction.coefficients[static_cast<Eigen::Index>(i)]);
    }
  }
}

}  // namespace

v1::Diagnostic ToProto(const Diagnostic& diagnostic) {
  v1::Diagnostic proto;
  proto.set_code(ToProto(diagnostic.code));
  proto.set_message(diagnostic.message);
  return proto;
}

v1::EstimateHistory::Point ToHistoryPoint(const v1::Estimate& estimate) {
  v1::EstimateHistory::Point point;
  point.set_time_s(estimate.time());
  point.set_sample_count(estimate.samples());
  point.set_sequence(estimate.sequence());
  point.set_reexpansion_count(estimate.expansion().reexpansions());
  for (const v1::Diagnostic& diagnostic : estimate.diagnostics()) {
    if (!std::ranges::count(point.warnings(), diagnostic.code())) {
      point.add_warnings(diagnostic.code());
    }
  }
  for (const v1::ParameterEstimate& parameter : estimate.parameters()) {
    v1::EstimateHistory::Parameter& added = *point.add_parameters();
    added.set_name(parameter.name());
    added.set_unit(parameter.unit());
    added.set_mean(parameter.mean());
    added.set_std_dev(parameter.std_dev());
    added.set_lower95(parameter.lower95());
    added.set_upper95(parameter.upper95());
    added.set_verdict(parameter.verdict());
  }
  for (const v1::FilteredQuantity& quantity : estimate.filtered()) {
    const bool is_parameter = std::ranges::any_of(
        estimate.parameters(), [&](const auto& one) { return one.name() == quantity.name(); });
    if (!is_parameter) continue;  // a state
    v1::EstimateHistory::Parameter& added = *point.add_drifting();
    added.set_name(quantity.name());
    added.set_unit(quantity.unit());
    added.set_mean(quantity.mean());
    added.set_std_dev(quantity.std_dev());
    added.set_lower95(quantity.lower95());
    added.set_upper95(quantity.upper95());
  }
  return point;
}

v1::Estimate ToProto(const Estimate& estimate) {
  v1::Estimate proto;
  for (const auto& parameter : estimate.parameters) ToProto(parameter, *proto.add_parameters());
  for (Eigen::Index row = 0; row < estimate.covariance.rows(); ++row) {
    for (Eigen::Index column = 0; column < estimate.covariance.cols(); ++column) {
      proto.add_covariance(estimate.covariance(row, column));
    }
  }
  proto.mutable_cost()->set_total(estimate.cost.total);
  proto.mutable_cost()->set_mismatch(estimate.cost.mismatch);
  proto.mutable_cost()->set_prior(estimate.cost.prior);
  for (const auto& channel : estimate.channels) ToProto(channel, *proto.add_channels());
  AddDirections(estimate, proto);
  AddTradeOffs(estimate, proto);
  AddComponents(estimate, proto);
  proto.set_disagreement(estimate.disagreement);
  AddWindows(estimate, proto);
  AddFiltered(estimate, proto);
  ToProto(estimate.expansion, *proto.mutable_expansion());
  for (const auto& diagnostic : estimate.diagnostics) {
    *proto.add_diagnostics() = ToProto(diagnostic);
  }
  proto.set_time(estimate.time_s);
  proto.set_samples(estimate.samples);
  proto.set_regularization(estimate.regularization);
  return proto;
}

}  // namespace polyest::internal
