#include "core/propagation/output_quadrature.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/propagation/heavy_tail.h"

namespace polyest::internal {
namespace {

constexpr double kFirstReach = 6;  // of the first nodes, in standard deviations
constexpr double kIntegrandDepth =
    14;  // of the integrand below its top where it still counts, in nats
constexpr double kCurvatureDepth = 7;  // where its curvature still counts
constexpr double kMaxCurvature = 1;    // of its logarithm over one step
constexpr int kMaxPanels = 16;
constexpr int kMaxRounds = 64;
constexpr double kCloser = 0.8;  // part of the width that is left where closing in still helps
constexpr double kNowhere = -std::numeric_limits<double>::infinity();

}  // namespace

OutputQuadrature::OutputQuadrature(Eigen::Index members)
    : squared_scales_(members),
      shifts_(members),
      nodes_(members, kNodes),
      values_(members, kNodes),
      logs_(kNodes),
      lines_(static_cast<size_t>(members)) {}

void OutputQuadrature::Begin(double z, double stated, bool tailed,
                             const Eigen::ArrayXd& squared_scales, const Eigen::ArrayXd& shifts,
                             const std::vector<bool>& used) {
  z_ = z;
  stated_ = stated;
  tailed_ = tailed;
  rounds_ = 0;
  squared_scales_ = squared_scales;
  shifts_ = shifts;
  for (size_t i = 0; i < lines_.size(); ++i) {
    lines_[i] = {.first = -kFirstReach, .step = 2 * kFirstReach / (kNodes - 1), .done = !used[i]};
  }
  PlaceNodes();
}

void OutputQuadrature::PlaceNodes() {
  for (Eigen::Index i = 0; i < nodes_.rows(); ++i) {
    const Line& line = lines_[static_cast<size_t>(i)];
    const double first = line.first + line.step * static_cast<double>(line.panel * kNodes);
    for (Eigen::Index k = 0; k < kNodes; ++k) {
      nodes_(i, k) = first + line.step * static_cast<double>(k);
    }
  }
}

bool OutputQuadrature::Refine() {
  bool open = false;
  for (Eigen::Index i = 0; i < nodes_.rows(); ++i) {
    Line& line = lines_[static_cast<size_t>(i)];
    if (line.done) continue;
    if (rounds_ == 0) DescribeOutput(i);
    Advance(i);
    open = open || !line.done;
  }
  if (++rounds_ == kMaxRounds) open = false;
  if (open) PlaceNodes();
  return open;
}

// Takes the moments of h from the first nodes.
void OutputQuadrature::DescribeOutput(Eigen::Index i) {
  double sum = 0, first = 0, second = 0;
  for (Eigen::Index k = 0; k < kNodes; ++k) {
    if (!std::isfinite(values_(i, k))) continue;
    const double weight = std::exp(-0.5 * nodes_(i, k) * nodes_(i, k));
    const double share = weight / (sum += weight);
    const double away = values_(i, k) - first;
    first += share * away;
    second += share * ((1 - share) * away * away - second);
  }
  Line& line = lines_[static_cast<size_t>(i)];
  line.output_mean = first + shifts_[i];
  line.output_variance = second;
}

// log(p_e(error)/p_0)
double OutputQuadrature::LogDensity(double error, double squared_scale) const {
  const double square = error * error / squared_scale;
  const double wider = 0.5 * std::log(squared_scale / (stated_ * stated_));
  if (!tailed_) return -0.5 * square - wider;
  constexpr double nu = kTailDegreesOfFreedom;
  return -0.5 * (nu + 1) * std::log1p(square / nu) - wider;
}

void OutputQuadrature::TakeLogs(Eigen::Index i) {
  for (Eigen::Index k = 0; k < kNodes; ++k) {
    const double s = nodes_(i, k);
    const double log =
        LogDensity(z_ - shifts_[i] - values_(i, k), squared_scales_[i]) - 0.5 * s * s;
    logs_[k] = std::isnan(log) ? kNowhere : log;
  }
}

// Takes the present panel of nodes, and chooses other nodes unless they resolve the integrand.
void OutputQuadrature::Advance(Eigen::Index i) {
  Line& line = lines_[static_cast<size_t>(i)];
  TakeLogs(i);
  if (line.panels == 1 && CloseIn(i)) return;
  if (const double top = logs_.maxCoeff(); top > line.top) {
    // A higher peak between the nodes before.
    const double factor = std::exp(line.top - top);
    line.sum *= factor;
    line.square *= factor;
    line.top = top;
  }
  AddCurvature(line);
  Add(i);
  if (++line.panel < line.panels) return;
  if (line.curvature > kMaxCurvature && line.panels < kMaxPanels) {
    Divide(line, 2 * line.panels);
    return;
  }
  line.done = line.found = true;
  line.variance = line.square / line.sum;
  const double integral = line.sum * line.step / std::sqrt(2 * std::numbers::pi);
  line.deviance = -2 * (line.top + std::log(integral));
}

// Divides the line into so many panels, none of them taken.
void OutputQuadrature::Divide(Line& line, int panels) {
  const double width = line.step * static_cast<double>(line.panels * kNodes - 1);
  line.step = width / static_cast<double>(panels * kNodes - 1);
  line.panels = panels;
  line.panel = 0;
  line.curvature = line.sum = line.square = line.mean = 0;
}

// Moves the nodes to where the integrand is. Returns false where they are there.
bool OutputQuadrature::CloseIn(Eigen::Index i) {
  Line& line = lines_[static_cast<size_t>(i)];
  line.top = logs_.maxCoeff();
  line.done = line.top == kNowhere;
  if (line.done) return true;
  const double width = line.step * (kNodes - 1);
  const bool below = logs_[0] > line.top - kIntegrandDepth;
  const bool above = logs_[kNodes - 1] > line.top - kIntegrandDepth;
  if (below || above) {
    // The sample is farther off than the nodes reach.
    if (below) line.first -= width;
    line.step *= below && above ? 3 : 2;
    return true;
  }
  line.curvature = 0;
  AddCurvature(line);
  if (line.curvature <= kMaxCurvature) return false;
  Eigen::Index begin = 0, end = kNodes - 1;
  while (logs_[begin] < line.top - kIntegrandDepth) ++begin;
  while (logs_[end] < line.top - kIntegrandDepth) --end;
  const double first = nodes_(i, std::max<Eigen::Index>(begin - 1, 0));
  const double last = nodes_(i, std::min<Eigen::Index>(end + 1, kNodes - 1));
  if (last - first > kCloser * width) return false;
  line.first = first;
  line.step = (last - first) / (kNodes - 1);
  return true;
}

void OutputQuadrature::AddCurvature(Line& line) const {
  for (Eigen::Index k = 1; k + 1 < kNodes; ++k) {
    if (!(logs_[k] > line.top - kCurvatureDepth)) continue;
    line.curvature = std::max(line.curvature, 2 * logs_[k] - logs_[k - 1] - logs_[k + 1]);
  }
}

// Adds the panel's nodes to the sums, about their mean so far.
void OutputQuadrature::Add(Eigen::Index i) {
  Line& line = lines_[static_cast<size_t>(i)];
  for (Eigen::Index k = 0; k < kNodes; ++k) {
    const double weight = std::exp(logs_[k] - line.top);
    if (!(weight > 0)) continue;
    const double away = nodes_(i, k) - line.mean;
    line.sum += weight;
    line.mean += weight / line.sum * away;
    line.square += weight * away * (nodes_(i, k) - line.mean);
  }
}

}  // namespace polyest::internal
