#pragma once

// What earlier re-expansions (reexpansion.h) have found, so that nothing is tried again that failed
// before and must fail again.
//
// A re-expansion leaves particles of the posterior and their costs. As long as these particles,
// reweighted to the present cost, keep nine tenths of their number as effective size, the posterior
// has hardly moved, and what they say of the region is what new ones would say. Where they neither
// lean on an edge nor would fit into a region of half the volume, no new ones are drawn. That holds
// in up to three dimensions, where elements find the pieces of a posterior that particles overlook.
//
// If a higher order did not follow the model, its error and the region of that trial are kept. Over
// a region that contains this one the error is no smaller. The order is not tried again before the
// region has left it, the noise has grown to where the error would be accepted, or the record has
// doubled.

#include <cstdint>

#include "core/bayes/cost.h"
#include "core/bayes/region.h"
#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/record/learned_noise.h"

namespace polyest::internal {

// A higher order of which no expansion followed the model.
struct OrderInVain {
  int order = 0;          // 0: none has been tried in vain
  double error = 0;       // mean square, in units of the noise's
  Vector centre;          // of the region (n), germ coordinates
  Matrix axes;            // of the region (n × n)
  int64_t rows = 0;       // that the expansion absorbed
  Vector noise_variance;  // m, as a factor of the stated one
};

// When the expansion returned to the whole prior (return_to_prior.h), in rows of the record; 0 is
// never.
struct PriorTried {
  int64_t stays_from = 0;  // the last return, or the last move away that did not serve
  int64_t tried = 0;       // the last trial of an expansion there
  bool in_vain = false;    // whether it has led to nothing
};

struct ReexpansionMemory {
  // The negative log density from which the particles were drawn, up to a constant; empty if it is
  // unknown.
  Vector costs;
  OrderInVain order;
  PriorTried prior;
};

// Returns what to keep of an order that was tried over `region` and had this error.
OrderInVain TriedInVain(int order, double error, const Region& region, int64_t rows,
                        const LearnedNoise& noise);

// Whether an expansion of a higher order over `region` cannot be expected to have at most the mean
// square error `accepted`, after what has been tried in vain.
bool IsRaisingInVain(const OrderInVain& tried, double accepted, const Region& region, int64_t rows,
                     const LearnedNoise& noise);

// Returns the particles (W × n, germ coordinates, drawn with these costs) reweighted to the present
// cost, equally weighted, in local coordinates of the design. Returns no rows if their effective
// size is below nine tenths of their number.
Matrix Reweighted(const Matrix& particles, const Vector& costs, const Cost& present,
                  const ExpansionDesign& design);

}  // namespace polyest::internal
