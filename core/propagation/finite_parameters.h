#pragma once

// A point whose parameters are not numbers, because an expression for one of them is none there. It
// has failed, as if its outputs were not finite. Models that are programs of others (FMUs,
// UM-Bridge) are not called for it: nobody knows what they would do.

namespace polyest::internal {

// Why such a point has failed.
inline constexpr char kParametersNotFinite[] =
    "a parameter or an input is not finite; the model is not called";

}  // namespace polyest::internal
