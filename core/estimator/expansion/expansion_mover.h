#pragma once

// Moves the expansion to other regions within one re-expansion (reexpansion.h). Where the record is
// long and the present expansion is accurate, its sums are carried over (carry_over.h); elsewhere
// the record is propagated again, if the allowance permits (replay_allowance.h).

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {

// Where an expansion is wanted, and of which order.
struct MoveTarget {
  Region region;
  Truncation truncation;
  // A wider region, for the case that the record must be propagated again; the expansion is not
  // made there if more trajectories fail in it than in the present one.
  std::optional<Region> wider;
};

// Particles of the posterior, by germ coordinates, and the negative logarithms of their density.
struct DrawnPoints {
  Matrix xis;  // W × n
  Vector costs;
};

class ExpansionMover {
 public:
  // All arguments must outlive the object.
  ExpansionMover(const RegionalExpansion& present, const ReexpansionRequest& request,
                 const Stop& stop);

  // Returns the expansion reached so far: the present one before the first move.
  const RegionalExpansion& expansion() const {
    return moves_.expansion ? *moves_.expansion : present_;
  }
  bool has_moved() const { return moves_.expansion != nullptr; }
  const Truncation& truncation() const { return expansion().design().basis->truncation(); }

  // Moves the expansion; the first of the drawn points become its check points. Returns false when
  // no expansion can be built, or none is allowed: the one reached so far then stays.
  absl::StatusOr<bool> Move(const MoveTarget& target, const DrawnPoints& drawn);
  // Takes an expansion that has been made elsewhere from the same rows.
  void Adopt(std::unique_ptr<RegionalExpansion> expansion);
  // Returns to the expansion that was there before the first move.
  void GoBack();

  // Whether the allowance forbids to propagate the record from its beginning.
  bool Withheld() const { return !moves_.allowance.AllowsRecord(request_.rows); }
  // The same; if so, the move that the caller wanted counts as postponed.
  bool PostponedIfWithheld();
  ReplayAllowance& allowance() { return moves_.allowance; }
  // Counts trajectories × rows that were propagated for expansions that nobody keeps.
  void CountPropagated(int64_t rows) { moves_.propagated_rows += rows; }

  ExpansionMoves TakeMoves() && { return std::move(moves_); }

 private:
  using MadeExpansion = absl::StatusOr<std::unique_ptr<RegionalExpansion>>;

  ExpansionDesign DesignOn(Region region, const Truncation& truncation,
                           const DrawnPoints& drawn) const;
  MadeExpansion Carried(const MoveTarget& target, const DrawnPoints& drawn);
  MadeExpansion Replayed(const Region& region, const Truncation& truncation,
                         const DrawnPoints& drawn);
  MadeExpansion ReplayedWhereFewFail(const MoveTarget& target, const DrawnPoints& drawn);

  const RegionalExpansion& present_;
  const ReexpansionRequest& request_;
  const Stop& stop_;
  ExpansionMoves moves_;
};

}  // namespace polyest::internal
