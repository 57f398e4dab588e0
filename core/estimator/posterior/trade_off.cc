#include "core/estimator/posterior/trade_off.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace polyest::internal {
namespace {

constexpr double kTold = 0.1;  // maximum ratio to the standard deviation of either alone

struct Moments {
  double mean = 0;
  double std_dev = 0;
  double Relative() const { return std_dev / std::abs(mean); }
};

Moments MomentsOf(const Eigen::ArrayXd& values, const Vector& weights) {
  const double mean = (weights.array() * values).sum();
  return {mean, std::sqrt((weights.array() * (values - mean).square()).sum())};
}

struct Power {
  double exponent;
  const char* before;  // text between the two names, and after them
  const char* after;
};
constexpr std::array<Power, 6> kPowers = {{{-1, "/", ""},
                                           {1, "·", ""},
                                           {-2, "/", "²"},
                                           {2, "·", "²"},
                                           {-0.5, "/√", ""},
                                           {0.5, "·√", ""}}};

struct Candidate {
  TradeOff trade_off;
  double ratio = kTold;  // to the smaller of the two standard deviations alone
};

class Search {
 public:
  Search(const Matrix& thetas, const Vector& weights, const std::vector<std::string>& names,
         const std::vector<std::string>& units)
      : thetas_(thetas), weights_(weights), names_(names), units_(units) {}

  Candidate BestOf(int i, int j) const {
    Candidate best;
    const Eigen::ArrayXd a = thetas_.col(i), b = thetas_.col(j);
    best.trade_off.first = i;
    best.trade_off.second = j;
    best.trade_off.first_alone = MomentsOf(a, weights_).Relative();
    best.trade_off.second_alone = MomentsOf(b, weights_).Relative();
    if ((a > 0).all() && (b > 0).all()) {
      const Eigen::ArrayXd log_a = a.log(), log_b = b.log();
      const double alone_a = MomentsOf(log_a, weights_).std_dev;
      const double alone_b = MomentsOf(log_b, weights_).std_dev;
      for (const Power& power : kPowers) {
        // In the units of either parameter: log θ_i + q log θ_j, and this divided by |q|.
        const double known = MomentsOf(log_a + power.exponent * log_b, weights_).std_dev;
        const double ratio = std::max(known / alone_a, known / std::abs(power.exponent) / alone_b);
        if (ratio >= best.ratio) continue;
        best.ratio = ratio;
        best.trade_off.combination = absl::StrCat(Name(i), power.before, Name(j), power.after);
        best.trade_off.relative_std_dev = known;
      }
    }
    if (units_[static_cast<size_t>(i)] != units_[static_cast<size_t>(j)]) return best;
    const double alone = std::min(MomentsOf(a, weights_).std_dev, MomentsOf(b, weights_).std_dev);
    for (const double sign : {1.0, -1.0}) {
      const Moments known = MomentsOf(a + sign * b, weights_);
      if (known.std_dev / alone >= best.ratio) continue;
      best.ratio = known.std_dev / alone;
      best.trade_off.combination = absl::StrCat(Name(i), sign > 0 ? " + " : " − ", Name(j));
      best.trade_off.relative_std_dev = known.Relative();
    }
    return best;
  }

 private:
  const std::string& Name(int i) const { return names_[static_cast<size_t>(i)]; }

  const Matrix& thetas_;
  const Vector& weights_;
  const std::vector<std::string>& names_;
  const std::vector<std::string>& units_;
};

}  // namespace

std::vector<TradeOff> FindTradeOffs(const Matrix& thetas, const Vector& weights,
                                    const std::vector<std::string>& names,
                                    const std::vector<std::string>& units,
                                    const std::vector<Verdict>& verdicts) {
  const Search search(thetas, weights, names, units);
  std::vector<Candidate> candidates;
  for (int i = 0; i < thetas.cols(); ++i) {
    for (int j = i + 1; j < thetas.cols(); ++j) {
      if (verdicts[static_cast<size_t>(i)] == Verdict::kIdentified &&
          verdicts[static_cast<size_t>(j)] == Verdict::kIdentified) {
        continue;
      }
      Candidate candidate = search.BestOf(i, j);
      if (!candidate.trade_off.combination.empty()) candidates.push_back(std::move(candidate));
    }
  }
  std::ranges::stable_sort(candidates, {}, &Candidate::ratio);
  std::vector<TradeOff> told;
  std::vector<bool> used(names.size(), false);
  for (const Candidate& candidate : candidates) {
    const auto i = static_cast<size_t>(candidate.trade_off.first);
    const auto j = static_cast<size_t>(candidate.trade_off.second);
    if (used[i] || used[j]) continue;
    used[i] = used[j] = true;
    told.push_back(candidate.trade_off);
  }
  return told;
}

}  // namespace polyest::internal
