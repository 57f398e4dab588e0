#pragma once

// The rules of paging that every list shares.

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <cstddef>

#include "proto/wire/convert/annotate.h"

namespace polyest::internal {

inline constexpr int kDefaultPageSize = 50;
inline constexpr int kLargestPageSize = 200;

// The number of entries that a page may have, at least 1.
inline absl::StatusOr<size_t> PageSize(int requested) {
  if (requested < 0) {
    return InvalidField("pageSize", absl::StrCat(requested, " must not be negative"));
  }
  if (requested == 0) return static_cast<size_t>(kDefaultPageSize);
  return static_cast<size_t>(std::min(requested, kLargestPageSize));
}

inline absl::Status UnknownPageToken(absl::string_view token) {
  return InvalidField("pageToken",
                      absl::StrCat("\"", token, "\" is not the nextPageToken of a page"));
}

}  // namespace polyest::internal
