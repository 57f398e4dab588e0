#include "client/paper/experiments.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "client/paper/experiment_definitions.h"
#include "core/chaos/germ.h"
#include "core/common/status.h"
#include "polyest/estimator.h"

namespace polyest::internal {
namespace {

using paper_experiments::Figure11;
using paper_experiments::Figure12;
using paper_experiments::Figure13;
using paper_experiments::Figure14;
using paper_experiments::Figure4;
using paper_experiments::Figure5;
using paper_experiments::Figure6;
using paper_experiments::Figure7;
using paper_experiments::Figure8;
using paper_experiments::ReferenceScenario;
using paper_experiments::Section35;
using paper_experiments::Section36;

struct Entry {
  const char* figure;
  absl::StatusOr<Experiment> (*make)();
};

constexpr Entry kEntries[] = {
    {"4", Figure4},   {"5", Figure5},     {"6", Figure6},     {"7", Figure7},
    {"8", Figure8},   {"11", Figure11},   {"12", Figure12},   {"13", Figure13},
    {"14", Figure14}, {"3.5", Section35}, {"3.6", Section36}, {"reference", ReferenceScenario},
};

constexpr int kResponsePoints = 401;

// Draws standard normal numbers that are the same with every standard library: each is the quantile
// at the middle of one of 2⁵³ equal intervals of probability.
class NormalDraws {
 public:
  explicit NormalDraws(uint64_t seed) : engine_(seed) {}

  double Next() {
    const double u = (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53;
    return normal_.Quantile(u);
  }

 private:
  std::mt19937_64 engine_;
  Germ normal_ = Germ::Normal();
};

absl::StatusOr<ReferenceResponse> Respond(const ResolvedProblem& problem, const Vector& reference,
                                          double until_s) {
  ReferenceResponse response;
  for (int i = 0; i < kResponsePoints; ++i) {
    response.time_s.push_back(until_s * i / (kResponsePoints - 1));
  }
  POLYEST_ASSIGN_OR_RETURN(response.value, SimulateOutputs(problem, reference, response.time_s));
  return response;
}

absl::StatusOr<VariantResult> RunVariant(const ExperimentVariant& variant, const Vector& reference,
                                         double until_s, int threads, const Stop& stop) {
  VariantResult result;
  result.name = variant.name;
  POLYEST_ASSIGN_OR_RETURN(result.samples, SyntheticSamples(variant, reference));
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ResolvedProblem::Make(variant.problem));
  POLYEST_ASSIGN_OR_RETURN(result.response, Respond(problem, reference, until_s));
  POLYEST_ASSIGN_OR_RETURN(
      auto estimator,
      Estimator::Make(variant.problem, {.threads = threads, .store = {}, .snapshot = {}}));
  POLYEST_RETURN_IF_ERROR(estimator->Append(result.samples));
  POLYEST_RETURN_IF_ERROR(estimator->Process(stop));
  POLYEST_ASSIGN_OR_RETURN(result.estimate, estimator->CurrentEstimate(stop));

  const int n = problem.dimension();
  Vector map(n), std_dev(n);
  for (int i = 0; i < n; ++i) {
    map(i) = result.estimate.parameters[i].map;
    std_dev(i) = result.estimate.parameters[i].std_dev;
  }
  result.map_germ = problem.prior().ToGerm(map);
  // The paper's priors are affine in ξ: the slope is the same everywhere.
  const Matrix slope = problem.prior().Jacobian(result.map_germ);
  result.std_dev_germ = std_dev.cwiseQuotient(slope.diagonal());
  CostGridOptions options;
  options.threads = threads;
  options.regularization = result.estimate.regularization;
  POLYEST_ASSIGN_OR_RETURN(result.cost, EvaluateCostGrid(problem, result.samples, options, stop));
  return result;
}

}  // namespace

std::string Heading(const Experiment& experiment) {
  if (!experiment.from_paper) return absl::StrCat("Reference scenario: ", experiment.title);
  const bool section = experiment.figure.find('.') != std::string::npos;
  return absl::StrCat(section ? "Section " : "Figure ", experiment.figure, ": ", experiment.title);
}

std::vector<std::string> PaperFigures() {
  std::vector<std::string> figures;
  for (const Entry& entry : kEntries) figures.emplace_back(entry.figure);
  return figures;
}

absl::StatusOr<Experiment> MakeExperiment(std::string_view figure) {
  for (const Entry& entry : kEntries) {
    if (figure == entry.figure) return entry.make();
  }
  return absl::InvalidArgumentError(absl::StrCat("figure: \"", std::string(figure),
                                                 "\" must be one of ",
                                                 absl::StrJoin(PaperFigures(), ", ")));
}

absl::StatusOr<Matrix> SimulateOutputs(const ResolvedProblem& problem, const Vector& theta,
                                       const std::vector<double>& time_s) {
  const InputSignals inputs = problem.MakeInputs();
  const Matrix thetas = theta.transpose();
  EnsemblePropagator propagator(problem.MakeEnsemble(thetas, problem.outputs(), 1), &inputs);
  const int channels = problem.channels();
  Matrix row(1, channels * static_cast<Eigen::Index>(time_s.size()));
  POLYEST_RETURN_IF_ERROR(propagator.Advance(time_s, row, {}));
  if (!propagator.failures().empty()) {
    return absl::InternalError(
        absl::StrCat("the reference simulation failed: ", propagator.failures().front().reason));
  }
  return row.reshaped(channels, time_s.size()).transpose();
}

absl::StatusOr<Samples> SyntheticSamples(const ExperimentVariant& variant, const Vector& reference,
                                         uint64_t seed) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ResolvedProblem::Make(variant.problem));
  POLYEST_ASSIGN_OR_RETURN(Matrix value,
                           SimulateOutputs(problem, reference, variant.sample_times_s));
  Samples samples;
  samples.time_s = variant.sample_times_s;
  Vector largest = Vector::Zero(problem.channels());
  NormalDraws draws(seed);
  for (Eigen::Index k = 0; k < value.rows(); ++k) {
    for (Eigen::Index j = 0; j < value.cols() && !variant.noise_free; ++j) {
      largest(j) = std::max(largest(j), std::abs(value(k, j)));
      const NoiseModel& noise = variant.problem.measured[j].noise;
      value(k, j) += noise.StandardDeviation(value(k, j), largest(j)) * draws.Next();
    }
  }
  for (int j = 0; j < problem.channels(); ++j) {
    const auto column = value.col(j);
    samples.columns.push_back({.name = variant.problem.measured[j].output,
                               .value = {column.begin(), column.end()},
                               .missing = {}});
  }
  return samples;
}

absl::StatusOr<ExperimentResult> RunExperiment(const Experiment& experiment, int threads,
                                               const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem,
                           ResolvedProblem::Make(experiment.variants.front().problem));
  ExperimentResult result{
      .experiment = experiment, .reference_germ = {}, .prior = problem.prior(), .variants = {}};
  result.reference_germ = problem.prior().ToGerm(experiment.reference);
  // All variants are simulated over the same time, so that their plots can be compared.
  double until_s = 0;
  for (const ExperimentVariant& variant : experiment.variants) {
    until_s = std::max(until_s, variant.sample_times_s.back());
  }
  for (const ExperimentVariant& variant : experiment.variants) {
    POLYEST_ASSIGN_OR_RETURN(VariantResult one,
                             RunVariant(variant, experiment.reference, until_s, threads, stop));
    result.variants.push_back(std::move(one));
  }
  return result;
}

}  // namespace polyest::internal
