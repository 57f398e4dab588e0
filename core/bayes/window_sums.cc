#include "core/bayes/window_sums.h"

#include <algorithm>
#include <cmath>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr int kMaxWindows = 64;
constexpr int kMinWindows = 16;
// Maximum of numbers kept in all copies together, 4 MB, unless kMinWindows need more.
constexpr int64_t kMaxNumbers = int64_t{1} << 19;

size_t Groups(const std::vector<ChannelSums>& sums) {
  const auto learned = std::ranges::count_if(sums, &ChannelSums::scale_unknown);
  return static_cast<size_t>(learned) + (learned < std::ssize(sums) ? 1 : 0);
}

Eigen::Index PackedSize(Eigen::Index terms) { return terms * (terms + 1) / 2; }

// Returns the lower triangle by columns, of the mean of both.
Vector Pack(const Matrix& g) {
  Vector packed(PackedSize(g.rows()));
  Eigen::Index first = 0;
  for (Eigen::Index j = 0; j < g.rows(); ++j) {
    const Eigen::Index count = g.rows() - j;
    packed.segment(first, count) = 0.5 * (g.col(j).tail(count) + g.row(j).tail(count).transpose());
    first += count;
  }
  return packed;
}

void AddPacked(const MismatchSums& sums, WindowSums::Totals& totals) {
  const Eigen::Index terms = sums.terms();
  Eigen::Index first = 0;
  for (Eigen::Index j = 0; j < terms; ++j) {
    totals.g.segment(first, terms - j) += sums.G().col(j).tail(terms - j);
    first += terms - j;
  }
  totals.b += sums.b();
}

// Writes the present sums into `totals`, which keeps its memory.
void Copy(const std::vector<ChannelSums>& sums, std::vector<WindowSums::Totals>& totals) {
  totals.resize(Groups(sums));
  for (WindowSums::Totals& group : totals) {
    const Eigen::Index terms = sums.front().samples.terms();
    group.g.setZero(PackedSize(terms));
    group.b.setZero(terms);
  }
  size_t next = std::ranges::all_of(sums, &ChannelSums::scale_unknown) ? 0 : 1;
  for (const ChannelSums& channel : sums) {
    WindowSums::Totals& group = totals[channel.scale_unknown ? next++ : 0];
    AddPacked(channel.samples, group);
    if (channel.log_variance.size() > 0) group.b -= channel.log_variance;
  }
}

// Returns whether the totals can be sums of c cᵀ/R: by Cauchy and Schwarz, g_ij² ≤ g_ii g_jj.
bool IsSumOfSquares(const WindowSums::Totals& group, Eigen::Index terms) {
  constexpr double kRounding = 1 + 1e-6;
  if (group.g.size() != PackedSize(terms) || group.b.size() != terms) return false;
  if (!group.g.allFinite() || !group.b.allFinite()) return false;
  Vector root(terms);
  for (Eigen::Index j = 0, first = 0; j < terms; first += terms - j++) {
    if (group.g[first] < 0) return false;
    root[j] = std::sqrt(group.g[first]);
  }
  for (Eigen::Index j = 0, first = 0; j < terms; first += terms - j++) {
    const auto column = group.g.segment(first, terms - j).array().abs();
    if ((column > kRounding * root[j] * root.tail(terms - j).array()).any()) return false;
  }
  return true;
}

bool AreTotals(const std::vector<WindowSums::Totals>& totals,
               const std::vector<ChannelSums>& sums) {
  const Eigen::Index terms = sums.front().samples.terms();
  return totals.size() == Groups(sums) && std::ranges::all_of(totals, [&](const auto& group) {
           return IsSumOfSquares(group, terms);
         });
}

bool IsSpan(const WindowSpan& span) {
  return std::isfinite(span.start_s) && std::isfinite(span.end_s) && span.first_run >= 0 &&
         span.last_run >= span.first_run;
}

}  // namespace

int WindowSums::Capacity(const std::vector<ChannelSums>& sums) {
  const int64_t numbers = static_cast<int64_t>(Groups(sums)) *
                          std::max<int64_t>(1, PackedSize(sums.front().samples.terms()));
  const int64_t room = std::clamp<int64_t>(kMaxNumbers / numbers, kMinWindows, kMaxWindows);
  return static_cast<int>(room / 2 * 2);
}

void WindowSums::EndRow(const std::vector<ChannelSums>& sums, int run, double start_s,
                        double end_s) {
  if (open_.rows == 0) {
    open_.first_run = run;
    open_.start_s = start_s;
  }
  open_.last_run = run;
  open_.end_s = end_s;
  if (++open_.rows < length_) return;
  if (static_cast<int>(closed_) == Capacity(sums)) {
    MergeNeighbours();
    return;
  }
  if (closed_ == windows_.size()) windows_.emplace_back();
  Window& window = windows_[closed_++];
  window.span = open_;
  Copy(sums, window.totals);
  open_ = {};
}

// The present window, so far as long as the others were, continues up to the new length.
void WindowSums::MergeNeighbours() {
  closed_ /= 2;
  for (size_t i = 0; i < closed_; ++i) {
    const WindowSpan first = windows_[2 * i].span;
    std::swap(windows_[i], windows_[2 * i + 1]);
    windows_[i].span.rows += first.rows;
    windows_[i].span.first_run = first.first_run;
    windows_[i].span.start_s = first.start_s;
  }
  length_ *= 2;
}

void WindowSums::Substitute(const ConstMatrixRef& t, const ConstVectorRef& shift) {
  for (size_t i = 0; i < closed_; ++i) {
    for (Totals& group : windows_[i].totals) {
      const Matrix g = Unpack(group.g, static_cast<int>(shift.size()));
      // G′ = T G Tᵀ,  b′ = T (b − G δ)
      group.b = t * (group.b - g * shift);
      group.g = Pack(t * g * t.transpose());
    }
  }
  windows_.resize(closed_);
}

void WindowSums::Divide(const Vector& factors, const std::vector<ChannelSums>& sums) {
  size_t group = std::ranges::all_of(sums, &ChannelSums::scale_unknown) ? 0 : 1;
  for (size_t c = 0; c < sums.size(); ++c) {
    if (!sums[c].scale_unknown) continue;
    for (size_t i = 0; i < closed_; ++i) {
      windows_[i].totals[group].g /= factors[static_cast<Eigen::Index>(c)];
      windows_[i].totals[group].b /= factors[static_cast<Eigen::Index>(c)];
    }
    ++group;
  }
}

const WindowSpan& WindowSums::span(int window) const {
  POLYEST_CHECK(window >= 0 && window < count());
  const auto i = static_cast<size_t>(window);
  return i < closed_ ? windows_[i].span : open_;
}

std::vector<WindowSums::Totals> WindowSums::TotalsAt(int window,
                                                     const std::vector<ChannelSums>& sums) const {
  POLYEST_CHECK(window >= 0 && window < count());
  const auto i = static_cast<size_t>(window);
  if (i < closed_) return windows_[i].totals;
  std::vector<Totals> totals;
  Copy(sums, totals);
  return totals;
}

bool WindowSums::Suits(const std::vector<ChannelSums>& sums, int64_t rows) const {
  if (length_ < 1 || length_ > std::max<int64_t>(1, rows) || open_.rows < 0 ||
      open_.rows >= length_ || !IsSpan(open_) || static_cast<int>(closed_) > Capacity(sums)) {
    return false;
  }
  for (size_t i = 0; i < closed_; ++i) {
    const Window& window = windows_[i];
    if (window.span.rows != length_ || !IsSpan(window.span)) return false;
    if (!AreTotals(window.totals, sums)) return false;
  }
  return static_cast<int64_t>(closed_) * length_ + open_.rows == rows;
}

Matrix WindowSums::Unpack(const Vector& packed, int terms) {
  POLYEST_CHECK(packed.size() == PackedSize(terms));
  Matrix full(terms, terms);
  Eigen::Index first = 0;
  for (Eigen::Index j = 0; j < terms; ++j) {
    full.col(j).tail(terms - j) = packed.segment(first, terms - j);
    full.row(j).tail(terms - j) = full.col(j).tail(terms - j).transpose();
    first += terms - j;
  }
  return full;
}

}  // namespace polyest::internal
