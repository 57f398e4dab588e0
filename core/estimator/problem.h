#pragma once

// What is to be estimated: a model, what of it is uncertain, what drives it and what is measured.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/bayes/noise.h"
#include "core/bayes/prior.h"
#include "core/chaos/collocation_points.h"
#include "core/chaos/multi_index.h"
#include "core/estimator/settable_quantities.h"
#include "core/model/equations/expressions.h"
#include "core/model/input_signal.h"
#include "core/model/model.h"
#include "core/propagation/ensemble_propagator.h"

namespace polyest {

struct NamedInput {
  std::string name;  // of one of the model's inputs
  InputSpecification signal;
};

struct MeasuredOutput {
  std::string output;  // one of the model's outputs
  NoiseModel noise;
};

struct ExpansionOptions {
  // p ≥ 1 of the truncation. Without it an adaptive expansion begins at 3, or less for so many
  // uncertain parameters that 3 is not affordable, and goes up while it is not accurate where the
  // posterior is, as far as that is affordable; any other has the order it would begin with.
  std::optional<int> order;
  double hyperbolic_exponent = 1;  // q in (0, 1] of the truncation; 1 is the total degree
  double points_per_term = 2;      // Q = ⌈points_per_term · S⌉; > 1 when adaptive, ≥ 1 otherwise
  PointSet points = PointSet::kHalton;
  bool adaptive = true;  // re-expand where the posterior is; false is the paper's fixed expansion
};

// How α² is chosen (bayes/regularization.h); where a rule has no answer, 1.
enum class RegularizationMode { kFixed, kLCurve, kDiscrepancy, kEvidence };

struct Problem {
  std::shared_ptr<const Model> model;
  // What is known of the settable quantities (settable_quantities.h). What is named neither here
  // nor among the uncertain and the derived has the model's default.
  std::map<std::string, double> fixed;
  std::vector<UncertainParameter> uncertain;
  std::vector<Correlation> correlations;  // of pairs of them; a pair not listed has none
  // Settable quantities tied to others by expressions: {"k2": "k1"}. They may use all that may be
  // set, other derived ones among them, but not in a circle.
  std::map<std::string, std::string> derived;
  std::vector<NamedInput> inputs;  // an input not listed is 0
  std::vector<MeasuredOutput> measured;
  ExpansionOptions expansion;
  double regularization = 1;  // α² ≥ 0 of (56)
  RegularizationMode regularization_mode = RegularizationMode::kFixed;
  IntegrationOptions integration;
  // Tighten integration.relative_tolerance where the noise of the samples asks for it; false when
  // the user has set a tolerance, and without effect on a fixed expansion.
  bool tolerance_follows_noise = true;
};

// The truncation an expansion in n uncertain parameters begins with.
Truncation FirstTruncation(const ExpansionOptions& options, int dimension);
// Of one order more; nothing when the order is given or more is not affordable: past 500 terms or
// order 9, beyond which two points a term no longer determine the terms well.
std::optional<Truncation> NextTruncation(const ExpansionOptions& options, int dimension,
                                         const Truncation& present);

// Limits that keep one problem from taking a machine: past them RESOURCE_EXHAUSTED.
inline constexpr int64_t kMostTerms = 2'000;    // S
inline constexpr int64_t kMostPoints = 20'000;  // Q

// A problem whose every name has been found in its model.
class ResolvedProblem {
 public:
  // INVALID_ARGUMENT or RESOURCE_EXHAUSTED name the field, the value and the rule; an unknown name
  // is answered with the names there are. `measured` may be empty (a propagation needs none).
  static absl::StatusOr<ResolvedProblem> Make(Problem problem);
  // All that Make has to say against it, not only the first.
  static std::vector<absl::Status> Check(Problem problem);

  const Problem& problem() const { return problem_; }
  // 0 < tolerance, within IntegrationOptions' limits; for ensembles made from then on.
  void set_relative_tolerance(double tolerance) {
    problem_.integration.relative_tolerance = tolerance;
  }
  const Prior& prior() const { return prior_; }
  int dimension() const { return prior_.dimension(); }                         // n
  int channels() const { return static_cast<int>(problem_.measured.size()); }  // m
  const std::vector<int>& outputs() const { return outputs_; }  // the model's columns, by channel
  const std::vector<std::string>& units() const { return units_; }  // by uncertain parameter

  // One signal for each of the model's inputs, in its order.
  InputSignals MakeInputs() const;
  // The streamed inputs: their columns among the model's inputs.
  const std::vector<int>& streamed_inputs() const { return streamed_inputs_; }

  // Rows that must follow a row of the data before the streamed inputs are settled up to it.
  int knots_ahead() const { return knots_ahead_; }

  // An ensemble with one trajectory for each row of thetas (Q × n, the uncertain parameters'
  // values), reading `outputs` of the model.
  EnsembleSpecification MakeEnsemble(const ConstMatrixRef& thetas, std::vector<int> outputs,
                                     int threads) const;

 private:
  class Resolver;

  ResolvedProblem(Problem problem, Prior prior)
      : problem_(std::move(problem)),
        prior_(std::move(prior)),
        settable_(problem_.model->description()),
        base_(settable_.Defaults()) {}

  void Derive(Matrix& values) const;

  Problem problem_;
  Prior prior_;
  SettableQuantities settable_;
  Vector base_;               // values of the settable quantities that are not uncertain
  std::vector<int> targets_;  // the settable quantity of each uncertain parameter
  std::vector<int> derived_targets_;
  std::vector<int> derived_variables_;
  std::shared_ptr<const Expressions> derived_;  // over all settable quantities; null without any
  std::vector<int> outputs_;
  std::vector<std::string> units_;
  std::vector<int> streamed_inputs_;
  int knots_ahead_ = 0;
};

}  // namespace polyest
