#include "core/estimator/studies/experiment_design.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/expansion/prior_expansion.h"
#include "core/estimator/problem/assumed_noise.h"
#include "core/estimator/problem/validate_noise.h"
#include "core/estimator/studies/information_gain.h"
#include "core/estimator/studies/model_slopes.h"
#include "core/estimator/studies/sample_times.h"
#include "core/model/list_names.h"
#include "polyest/prior_propagation.h"

namespace polyest::internal {
namespace {

constexpr int kDraws = 64;  // number of draws of the true value

// An output that is, or could be, measured.
struct Candidate {
  int column;               // column of the model's outputs
  const NoiseModel* noise;  // nullptr if not known
};

// Returns the problem's channels, then the other possible outputs.
absl::StatusOr<std::vector<Candidate>> FindCandidates(const ResolvedProblem& problem,
                                                      const ExperimentOptions& options) {
  const ModelDescription& model = problem.problem().model->description();
  std::vector<Candidate> candidates;
  for (const int column : problem.outputs()) {
    candidates.push_back({column, GivenNoise(problem, column)});
  }
  const auto known = [&](int column) {
    return std::any_of(candidates.begin(), candidates.end(),
                       [column](const Candidate& other) { return other.column == column; });
  };
  for (size_t i = 0; i < options.possible.size(); ++i) {
    const MeasuredOutput& possible = options.possible[i];
    const FieldPath field{"possible", i};
    const auto column = model.FindOutput(possible.output);
    if (!column) {
      return InvalidField(field,
                          absl::StrFormat("model %s has no output \"%s\"; it has %s", model.name,
                                          possible.output, ListNames(model.outputs)));
    }
    POLYEST_RETURN_IF_ERROR(ValidateNoise(field.Then("noise"), possible.noise));
    if (known(*column)) {
      if (!HasNumbers(possible.noise)) continue;
      return InvalidField(field.Then("noise"),
                          absl::StrFormat("output %s has a noise already", possible.output));
    }
    candidates.push_back({*column, HasNumbers(possible.noise) ? &possible.noise : nullptr});
  }
  if (options.possible.empty()) {
    for (int column = 0; column < static_cast<int>(model.outputs.size()); ++column) {
      if (!known(column)) candidates.push_back({column, nullptr});
    }
  }
  return candidates;
}

// The samples of the experiment as each draw of the true value predicts them.
class Outlook {
 public:
  Outlook(const ResolvedProblem& problem, const std::vector<Candidate>& candidates,
          const ModelAtDraws& model)
      : m_(static_cast<int>(candidates.size())),
        draws_(problem.prior(), model.xis),
        noise_variance_(Vector::Zero(m_)) {
    const std::vector<NoiseModel> noises = Noises(candidates, model);
    for (const OutputsAtDraw& at : model.outputs) AddDraw(at, noises);
    noise_variance_ /= static_cast<double>(model.outputs.size()) * static_cast<double>(times());
  }

  int times() const { return static_cast<int>(slopes_.front().rows()) / m_; }
  const TruthDraws& draws() const { return draws_; }
  // Returns the mean of σ² of output i over times and draws.
  double NoiseVariance(int i) const { return noise_variance_[i]; }

  // Returns Σ a aᵀ of each draw over all samples of output i.
  std::vector<Matrix> Information(int i) const {
    std::vector<Matrix> information;
    for (const Matrix& slopes : slopes_) {
      const Matrix a = slopes(Eigen::seq(i, slopes.rows() - 1, m_), Eigen::all);
      information.push_back(a.transpose() * a);
    }
    return information;
  }

  // Returns a of each draw for the first `count` outputs, (times · count) × n.
  std::vector<Matrix> Slopes(int count) const {
    std::vector<Matrix> all;
    for (const Matrix& slopes : slopes_) {
      Matrix chosen(times() * count, slopes.cols());
      for (int k = 0; k < times(); ++k) {
        chosen.middleRows(k * count, count) = slopes.middleRows(k * m_, count);
      }
      all.push_back(std::move(chosen));
    }
    return all;
  }

 private:
  std::vector<NoiseModel> Noises(const std::vector<Candidate>& candidates,
                                 const ModelAtDraws& model) const {
    const Eigen::Index rows = model.outputs.front().values.size();
    const auto count = static_cast<double>(model.outputs.size());
    Vector mean = Vector::Zero(rows), square = Vector::Zero(rows);
    for (const OutputsAtDraw& at : model.outputs) mean += at.values / count;
    for (const OutputsAtDraw& at : model.outputs) square += (at.values - mean).cwiseAbs2() / count;
    const Vector deviation = square.cwiseSqrt();
    std::vector<NoiseModel> noises;
    for (int i = 0; i < m_; ++i) {
      const auto at = Eigen::seq(i, rows - 1, m_);
      const NoiseModel* given = candidates[static_cast<size_t>(i)].noise;
      noises.push_back(given != nullptr ? *given : AssumedNoise(mean(at), deviation(at)));
    }
    return noises;
  }

  // Adds a_k = L ∂y_k/∂ξ /√R_k at the draw.
  void AddDraw(const OutputsAtDraw& at, const std::vector<NoiseModel>& noises) {
    const Vector& y = at.values;
    Matrix slopes = at.slopes * draws_.germ_standard_deviation().asDiagonal();
    // An output at rest has the noise of a small part of its later range.
    Vector largest(m_);
    for (int i = 0; i < m_; ++i) {
      largest[i] =
          NoiseModel::kMinMagnitude * y(Eigen::seq(i, y.size() - 1, m_)).cwiseAbs().maxCoeff();
    }
    for (Eigen::Index row = 0; row < slopes.rows(); ++row) {
      const Eigen::Index i = row % m_;
      largest[i] = std::max(largest[i], std::abs(y[row]));
      const double sigma = noises[static_cast<size_t>(i)].StandardDeviation(y[row], largest[i]);
      noise_variance_[i] += sigma * sigma;
      if (sigma > 0) {
        slopes.row(row) /= sigma;
      } else {
        slopes.row(row).setZero();  // an output that is always 0 has no relative noise
      }
    }
    slopes_.push_back(std::move(slopes));
  }

  int m_;
  TruthDraws draws_;
  std::vector<Matrix> slopes_;  // one per draw, (m · times) × n
  Vector noise_variance_;
};

std::vector<Matrix> Sum(const std::vector<Matrix>& a, const std::vector<Matrix>& b) {
  std::vector<Matrix> sum = a;
  for (size_t d = 0; d < sum.size(); ++d) sum[d] += b[d];
  return sum;
}

// `planned` is the number of candidates, from the first on, that will be measured in any case.
absl::Status CompareOutputs(const ResolvedProblem& problem,
                            const std::vector<Candidate>& candidates, const Outlook& outlook,
                            int planned, const Stop& stop, ExperimentDesign& design) {
  std::vector<std::vector<Matrix>> information;
  for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
    information.push_back(outlook.Information(i));
  }
  std::vector<Matrix> all_planned = information[0];
  for (int i = 1; i < planned; ++i) {
    all_planned = Sum(all_planned, information[static_cast<size_t>(i)]);
  }
  design.gain = outlook.draws().Expected(all_planned);
  const auto& outputs = problem.problem().model->description().outputs;
  for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    const auto index = static_cast<size_t>(i);
    const Quantity& output = outputs[static_cast<size_t>(candidates[index].column)];
    OutputGain gain{output.name,
                    output.unit,
                    std::sqrt(outlook.NoiseVariance(i)),
                    i < problem.channels(),
                    outlook.draws().Expected(information[index]),
                    {}};
    gain.together =
        i < planned ? design.gain : outlook.draws().Expected(Sum(all_planned, information[index]));
    design.outputs.push_back(std::move(gain));
  }
  return absl::OkStatus();
}

absl::Status ChooseTimes(const Outlook& outlook, const TimeGrid& grid, int planned, int most,
                         const Stop& stop, ExperimentDesign& design) {
  const std::vector<Matrix> slopes = outlook.Slopes(planned);
  POLYEST_ASSIGN_OR_RETURN(const std::vector<int> chosen,
                           ChooseSampleTimes(slopes, planned, most, stop));
  const Eigen::Index n = slopes.front().cols();
  std::vector<Matrix> information(slopes.size(), Matrix::Zero(n, n));
  for (const int k : chosen) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    for (size_t d = 0; d < slopes.size(); ++d) {
      const auto a = slopes[d].middleRows(k * planned, planned);
      information[d] += a.transpose() * a;
    }
    design.samples.push_back({grid.time_s(k), outlook.draws().Expected(information)});
  }
  return absl::OkStatus();
}

}  // namespace

}  // namespace polyest::internal

namespace polyest {

using namespace internal;

absl::Status ExperimentOptions::Validate() const {
  POLYEST_RETURN_IF_ERROR((TimeGrid{until_s, step_s}.Validate()));
  POLYEST_RETURN_IF_ERROR(CheckRange("samples", samples, 1, kMaxSampleTimes));
  return CheckAtLeast("threads", threads, 1);
}

}  // namespace polyest

namespace polyest::internal {

absl::StatusOr<ExperimentDesign> DesignExperiment(const ResolvedProblem& problem,
                                                  const ExperimentOptions& options,
                                                  const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_ASSIGN_OR_RETURN(const auto candidates, FindCandidates(problem, options));
  std::vector<int> columns;
  for (const Candidate& candidate : candidates) columns.push_back(candidate.column);
  const auto m = static_cast<int>(columns.size());
  const TimeGrid grid{options.until_s, options.step_s};
  POLYEST_RETURN_IF_ERROR(CheckAnswerSize(grid, columns.size(), kDraws * (problem.dimension() + 1),
                                          kMaxPropagatedValues));
  POLYEST_ASSIGN_OR_RETURN(const ModelAtDraws model,
                           EvaluateAtDraws(problem, columns, DrawTruths(problem.prior(), kDraws),
                                           grid, options.threads, stop));
  const Outlook outlook(problem, candidates, model);
  const int planned = problem.channels() > 0 ? problem.channels() : m;
  ExperimentDesign design;
  POLYEST_RETURN_IF_ERROR(CompareOutputs(problem, candidates, outlook, planned, stop, design));
  POLYEST_RETURN_IF_ERROR(ChooseTimes(outlook, grid, planned, options.samples, stop, design));
  design.draws = outlook.draws().count();
  design.trajectories = model.trajectories;
  if (!model.failures.empty()) {
    design.diagnostics.push_back(DescribeFailures(model.failures, model.trajectories));
  }
  return design;
}

}  // namespace polyest::internal
