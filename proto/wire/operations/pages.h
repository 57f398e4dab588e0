#pragma once

// Rules of paging that all lists share.

#include <absl/status/statusor.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <cstddef>

#include "proto/wire/convert/annotate.h"

namespace polyest::internal {

inline constexpr int kDefaultPageSize = 50;
inline constexpr int kMaxPageSize = 200;

// Returns the number of entries that a page may have: `requested`, but at most kMaxPageSize;
// kDefaultPageSize for 0. Refuses a negative number with INVALID_ARGUMENT.
inline absl::StatusOr<size_t> PageSize(int requested) {
  if (requested < 0) {
    return InvalidField("pageSize", absl::StrCat(requested, " must not be negative"));
  }
  if (requested == 0) return static_cast<size_t>(kDefaultPageSize);
  return static_cast<size_t>(std::min(requested, kMaxPageSize));
}

// Returns the error for a token that does not belong to a page.
inline absl::Status UnknownPageToken(absl::string_view token) {
  return InvalidField("pageToken", absl::StrCat("\"", absl::Utf8SafeCEscape(token),
                                                "\" is not the nextPageToken of a page"));
}

}  // namespace polyest::internal
