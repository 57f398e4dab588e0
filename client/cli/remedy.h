#pragma once

// Changes of a problem that make room for residuals which contradict a perfect model with white
// noise: correlated or larger noise of the sensors, process noise, a drifting parameter.
//
// Sizes that no prior states come from the record. With the spread s of a state (the standard
// deviation of its trajectory about its mean), the standard deviation d of a parameter's prior and
// the duration T of the record, they are
//   10⁻⁴, 10⁻² and 1 times s²/T for a spectral density,
//   10⁻², 10⁻¹ and 1 times d/√T for the rate of a drift,
// rounded to one digit. Noise that is larger than stated has the size of the residuals. A size that
// is estimated lies between bounds around one of these, which reach to its neighbours and beyond.

#include <string>
#include <vector>

#include "polyest/v1/estimate.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// How far a state moves during a record.
struct StateSpread {
  std::string state;
  bool is_velocity = false;
  double spread = 0;  // in the state's unit, > 0
};

struct Remedy {
  enum class Kind { kCorrelatedNoise, kLargerNoise, kProcessNoise, kDrift };
  Kind kind = Kind::kCorrelatedNoise;
  // The outputs with the noise, or the state or parameter.
  std::vector<std::string> names;
  // The sizes to try: the middle one, the largest and the smallest. The two kinds of noise have one
  // size for each output instead, 0 for correlated noise of the size stated.
  std::vector<double> sizes;
};

// Returns the remedies that the problem leaves room for, the likelier ones first. The program that
// computes may refuse them.
std::vector<Remedy> ListRemedies(const v1::Problem& problem, const v1::Estimate& estimate,
                                 const std::vector<StateSpread>& states, double duration_s);

// Returns whether the remedy has one size, which is tried at each of its values.
bool HasSize(const Remedy& remedy);

// Returns the problem with the remedy. `size`: that of HasSize, else not used.
v1::Problem WithKnownSize(v1::Problem problem, const Remedy& remedy, double size);
// Returns the problem with the remedy, whose size is estimated between bounds around `size`.
v1::Problem WithUnknownSize(v1::Problem problem, const Remedy& remedy, double size);

// Returns the remedy in words: "process noise on v".
std::string RemedyText(const Remedy& remedy);

// Returns the fields of a problem with the remedy that the remedy has changed, as JSON, one in a
// line.
std::vector<std::string> RemedyJson(const v1::Problem& remedied, const Remedy& remedy);

}  // namespace polyest::internal
