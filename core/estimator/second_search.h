#pragma once

// Looks for a better minimum where residuals contradict the noise by far.
//
// A region that has moved to a false minimum stays there: the posterior on its expansion says
// nothing of places far away. Such residuals are therefore first suspected of being that. A second
// mixture begins at the prior, with the likelihood tempered by the misfit until it has taken the
// rows so far, so that nothing contracts about a wrong place, and with the tempering then withdrawn
// step by step. It replaces the first one if its misfit is clearly smaller. If it does not, and the
// parameters are few, a further one begins on an expansion over the prior's tails, where the
// prior's own polynomials follow no model. Only what remains is MODEL_MISFIT.
//
// The looks are at rows that are a function of the record alone. After a search that found nothing,
// the next one waits until the record is four times as long or the misfit four times as large, so
// that all searches together cost at most a third more than the record. Where the rows that an
// update propagates again are limited, only the first tenth of so many rows is searched again.

#include <absl/status/status.h>

#include <memory>

#include "core/estimator/component_mixture.h"

namespace polyest::internal {

class SecondSearch {
 public:
  // Returns the row of the next look.
  int64_t row() const { return state_.row; }

  // Looks at the mixture, which has taken the rows up to row(), and replaces it if another one is
  // better. On a stop request returns its status; the next call continues.
  absl::Status Look(const ResolvedProblem& problem, const SampleStore* store, int threads,
                    const Stop& stop, std::unique_ptr<ComponentMixture>& mixture);

  struct State {
    int64_t row = kFirstRow;  // of the next look
    int64_t tried_row = 0;    // of the last search that found nothing
    double tried_misfit = 0;  // there

    template <class Archive>
    void serialize(Archive& archive) {
      archive(row, tried_row, tried_misfit);
    }
  };
  const State& state() const { return state_; }
  // Returns about how many bytes of memory a search under way holds.
  int64_t memory_bytes() const;
  // Returns DATA_LOSS if no search can have this state after so many rows.
  static absl::Status CheckState(const State& state, int64_t rows);
  void Restore(const State& state) { state_ = state; }

 private:
  static constexpr int64_t kFirstRow = 4;

  bool IsDue(const Problem& problem, double misfit) const;
  // Searches once, and returns whether the mixture was replaced.
  absl::StatusOr<bool> Search(const ResolvedProblem& problem, const SampleStore* store, int threads,
                              const Stop& stop, std::unique_ptr<ComponentMixture>& mixture);

  State state_;
  std::unique_ptr<ComponentMixture> second_;  // during a search
  bool in_tails_ = false;                     // whether it is over the prior's tails
};

}  // namespace polyest::internal
