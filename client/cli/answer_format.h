#pragma once

namespace polyest::internal {

// How a command prints its answer.
enum class Format { kTable, kJson, kJsonLines, kCsv };

}  // namespace polyest::internal
