#pragma once

// The JSON schema of problem files, for editors: made from problem.proto when polyest is built.

namespace polyest::internal {

// JSON Schema draft-07, the one that editors know best.
extern const char kProblemSchema[];

}  // namespace polyest::internal
