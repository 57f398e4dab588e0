#pragma once

// Oscillators that a random force drives, for tests of filters.

#include <utility>
#include <vector>

#include "tests/unit/core/propagation/ensemble.h"

namespace polyest::internal {

// One member's parameters: x″ = −k x − c v + w, w of spectral density q.
struct DrivenOscillator {
  double k, c, x0, v0, q;
};

// Returns an ensemble with one point for each oscillator.
inline Ensemble DrivenOscillatorEnsemble(const std::vector<DrivenOscillator>& oscillators,
                                         std::vector<const char*> outputs) {
  Ensemble ensemble("mass_spring_damper", static_cast<int>(oscillators.size()), std::move(outputs));
  ensemble.specification.integration.relative_tolerance = 1e-10;
  ensemble.specification.process_noise.setZero(ensemble.points(), 2);
  for (int i = 0; i < ensemble.points(); ++i) {
    const DrivenOscillator& oscillator = oscillators[static_cast<size_t>(i)];
    ensemble.Set("m", i, 1);
    ensemble.Set("k", i, oscillator.k);
    ensemble.Set("c", i, oscillator.c);
    ensemble.Set("x0", i, oscillator.x0);
    ensemble.Set("v0", i, oscillator.v0);
    ensemble.specification.process_noise(i, 1) = oscillator.q;
  }
  return ensemble;
}

}  // namespace polyest::internal
