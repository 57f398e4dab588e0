#pragma once

// How an estimate compares with the exact posterior.

#include <string>

#include "polyest/estimate.h"
#include "tests/properties/reference.h"

namespace polyest::internal::properties {

enum class Judgement {
  kRight,  // every mean within 0.25 exact standard deviations, every standard deviation within 25 %
  kHonest,  // not right, but the answer admits it: every 95 % interval reaches to within a standard
            // deviation of the exact mean and no standard deviation is below a quarter of the exact
            // one, or a diagnostic says that the numbers are not to be believed
  kSilent,  // wrong, and believed
  kCrash,   // no answer
  kSkipped,  // the exact posterior could not be computed well enough
};
const char* NameOf(Judgement judgement);

struct Verdict {
  Judgement judgement = Judgement::kCrash;
  std::string note;  // in one line
};

Verdict Judge(const Estimate& estimate, const Moments& exact);

// Returns the diagnostics' codes as a list.
std::string CodesOf(const Estimate& estimate);

}  // namespace polyest::internal::properties
