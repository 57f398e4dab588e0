#include "core/umbridge/umbridge_model.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/propagation/finite_parameters.h"
#include "core/propagation/output_limit.h"
#include "core/umbridge/evaluation_requests.h"

namespace polyest::internal {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::uintmax_t kLongestFile = 4 << 20;
// A time is that of a sample if both differ by at most so much of the last time listed: times are
// differences of numbers with finitely many digits.
constexpr double kSameTime = 1e-9;

// Returns the reason if these are not one vector of `count` values for each output, or a value is
// beyond the limit of outputs.
std::string FailureOf(const Vectors& outputs, size_t vectors, size_t count) {
  if (outputs.size() != vectors) {
    return absl::StrFormat("it has %d output vectors where its description has %d outputs",
                           outputs.size(), vectors);
  }
  for (size_t i = 0; i < vectors; ++i) {
    if (outputs[i].size() == count) continue;
    return absl::StrFormat("its output vector %d has %d values for %d times", i, outputs[i].size(),
                           count);
  }
  for (const std::vector<double>& output : outputs) {
    const char* const failure =
        FailureOfOutputs(Eigen::Map<const Eigen::ArrayXd>(output.data(), std::ssize(output)));
    if (failure != nullptr) return failure;
  }
  return "";
}

// Returns the specification without the model. It outlives a computation while a late answer is
// awaited, and the model's pool of connections must not end with one of its own threads.
std::shared_ptr<const EnsembleSpecification> WithoutModel(EnsembleSpecification specification) {
  specification.model = nullptr;
  return std::make_shared<const EnsembleSpecification>(std::move(specification));
}

class UmBridgeEnsemble final : public TrajectoryEnsemble {
 public:
  UmBridgeEnsemble(std::shared_ptr<const UmBridgeDescription> description,
                   std::shared_ptr<EvaluationPool> pool, EnsembleSpecification specification,
                   const InputSignals* inputs)
      : description_(std::move(description)),
        pool_(std::move(pool)),
        specification_(WithoutModel(std::move(specification))),
        inputs_(inputs),
        failed_(static_cast<size_t>(points()), false) {
    for (int q = 0; q < points(); ++q) {
      if (specification_->parameters.row(q).allFinite() &&
          specification_->amplitudes.row(q).allFinite()) {
        continue;
      }
      failed_[static_cast<size_t>(q)] = true;
      PointFailure& failure = failures_.emplace_back();
      failure.point = q;
      failure.reason = kParametersNotFinite;
    }
  }

  int points() const override { return static_cast<int>(specification_->parameters.rows()); }
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs,
                       const Stop& stop) override;
  const std::vector<PointFailure>& failures() const override { return failures_; }

 private:
  absl::StatusOr<std::vector<Evaluation>> EvaluateAll(std::span<const double> times_s,
                                                      const Stop& stop);
  absl::Status Annotate(const absl::Status& status) const;
  absl::StatusOr<size_t> IndexOf(double time_s) const;
  absl::Status EvaluateListed(const Stop& stop);

  std::shared_ptr<const UmBridgeDescription> description_;
  std::shared_ptr<EvaluationPool> pool_;
  std::shared_ptr<const EnsembleSpecification> specification_;
  const InputSignals* inputs_;
  std::vector<Evaluation> listed_;  // by point, at the listed times; empty before the first Advance
  std::vector<bool> failed_;        // by point
  std::vector<PointFailure> failures_;
  double time_s_ = 0;  // reached
};

absl::Status UmBridgeEnsemble::Annotate(const absl::Status& status) const {
  if (!absl::IsFailedPrecondition(status) && !absl::IsUnavailable(status)) return status;
  return absl::Status(status.code(),
                      absl::StrCat("umbridge ", description_->model.name, ": ", status.message()));
}

// Evaluates the points that have not failed; those that fail now are noted. Others are empty.
absl::StatusOr<std::vector<Evaluation>> UmBridgeEnsemble::EvaluateAll(
    std::span<const double> times_s, const Stop& stop) {
  const size_t count = times_s.empty() ? description_->time_s.size() : times_s.size();
  absl::StatusOr<EvaluationRequests> requests =
      EvaluationRequests::Make(description_, specification_, *inputs_, times_s);
  if (!requests.ok()) return Annotate(requests.status());
  std::vector<size_t> points;
  for (size_t q = 0; q < failed_.size(); ++q) {
    if (!failed_[q]) points.push_back(q);
  }
  const auto request_of = [requests = *std::move(requests), points](size_t i) {
    return requests.Of(static_cast<Eigen::Index>(points[i]));
  };
  auto evaluated = pool_->Evaluate(points.size(), request_of, stop);
  if (!evaluated.ok()) return Annotate(evaluated.status());
  std::vector<Evaluation> results(failed_.size());
  for (size_t i = 0; i < points.size(); ++i) {
    Evaluation& result = results[points[i]] = std::move((*evaluated)[i]);
    if (result.failure.empty()) {
      result.failure = FailureOf(result.outputs, description_->model.outputs.size(), count);
    }
    if (result.failure.empty()) continue;
    failed_[points[i]] = true;
    failures_.push_back({static_cast<int>(points[i]), time_s_, 0, result.failure});
  }
  std::ranges::sort(failures_, {}, &PointFailure::point);
  return results;
}

absl::StatusOr<size_t> UmBridgeEnsemble::IndexOf(double time_s) const {
  const std::vector<double>& times_s = description_->time_s;
  const double near = kSameTime * times_s.back();
  const auto next = std::ranges::lower_bound(times_s, time_s - near);
  if (next != times_s.end() && std::abs(*next - time_s) <= near) {
    return static_cast<size_t>(next - times_s.begin());
  }
  return absl::FailedPreconditionError(
      absl::StrFormat("umbridge %s: t = %g s is not among the times of its description (timesS)",
                      description_->model.name, time_s));
}

absl::Status UmBridgeEnsemble::EvaluateListed(const Stop& stop) {
  if (!listed_.empty()) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(listed_, EvaluateAll({}, stop));
  return absl::OkStatus();
}

absl::Status UmBridgeEnsemble::Advance(std::span<const double> times_s, MatrixRef outputs,
                                       const Stop& stop) {
  POLYEST_CHECK(outputs.rows() == points());
  POLYEST_CHECK(outputs.cols() == std::ssize(times_s) * std::ssize(specification_->outputs));
  POLYEST_RETURN_IF_ERROR(stop.Check());
  if (points() == 0 || times_s.empty()) return absl::OkStatus();
  std::vector<size_t> index(times_s.size());
  std::vector<Evaluation> evaluated;
  const bool listed = !description_->time_s.empty();
  if (listed) {
    for (size_t k = 0; k < times_s.size(); ++k) {
      POLYEST_ASSIGN_OR_RETURN(index[k], IndexOf(times_s[k]));
    }
    POLYEST_RETURN_IF_ERROR(EvaluateListed(stop));
  } else {
    for (size_t k = 0; k < times_s.size(); ++k) index[k] = k;
    POLYEST_ASSIGN_OR_RETURN(evaluated, EvaluateAll(times_s, stop));
  }
  const std::vector<Evaluation>& values = listed ? listed_ : evaluated;
  const auto m = std::ssize(specification_->outputs);
  for (size_t q = 0; q < failed_.size(); ++q) {
    for (Eigen::Index j = 0; j < outputs.cols(); ++j) {
      const auto output = static_cast<size_t>(specification_->outputs[static_cast<size_t>(j % m)]);
      outputs(static_cast<Eigen::Index>(q), j) =
          failed_[q] ? kNaN : values[q].outputs[output][index[static_cast<size_t>(j / m)]];
    }
  }
  time_s_ = times_s.back();
  return absl::OkStatus();
}

absl::StatusOr<std::string> ReadFile(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::file_size(file, error) > kLongestFile || error) {
    return absl::FailedPreconditionError("the file cannot be read or has more than 4 MiB");
  }
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) return absl::FailedPreconditionError("the file cannot be read");
  return text.str();
}

}  // namespace

absl::StatusOr<std::shared_ptr<const UmBridgeModel>> UmBridgeModel::Read(
    const std::filesystem::path& file, const std::string& name) {
  absl::StatusOr<std::string> json = ReadFile(file);
  absl::StatusOr<UmBridgeDescription> description =
      json.ok() ? ParseUmBridgeDescription(name, *json) : json.status();
  if (!description.ok()) {
    return absl::Status(description.status().code(),
                        absl::StrCat("umbridge ", name, ": ", description.status().message()));
  }
  return std::make_shared<const UmBridgeModel>(*std::move(description));
}

UmBridgeModel::UmBridgeModel(UmBridgeDescription description)
    : description_(std::make_shared<const UmBridgeDescription>(std::move(description))),
      pool_(std::make_shared<EvaluationPool>(description_->servers)) {}

std::unique_ptr<TrajectoryEnsemble> UmBridgeModel::StartEnsemble(
    EnsembleSpecification specification, const InputSignals* inputs) const {
  return std::make_unique<UmBridgeEnsemble>(description_, pool_, std::move(specification), inputs);
}

}  // namespace polyest::internal
