#include "proto/wire/refusal/refusal.h"

#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// Names of the status's payloads.
constexpr char kReason[] = "polyest/reason";
constexpr char kLimit[] = "polyest/limit";
constexpr char kOwner[] = "polyest/owner";
constexpr char kRetryDelayMs[] = "polyest/retry-delay-ms";

std::string Text(const absl::Status& status, const char* name) {
  const auto payload = status.GetPayload(name);
  return payload ? std::string(*payload) : "";
}

}  // namespace

absl::Status Refuse(absl::StatusCode code, absl::string_view message, const Refusal& refusal) {
  POLYEST_CHECK(code != absl::StatusCode::kOk && !refusal.reason.empty());
  absl::Status status(code, message);
  status.SetPayload(kReason, absl::Cord(refusal.reason));
  if (!refusal.limit.empty()) status.SetPayload(kLimit, absl::Cord(refusal.limit));
  if (!refusal.owner.empty()) status.SetPayload(kOwner, absl::Cord(refusal.owner));
  if (refusal.retry_delay) {
    status.SetPayload(kRetryDelayMs, absl::Cord(absl::StrCat(refusal.retry_delay->count())));
  }
  return status;
}

absl::Status LimitExceeded(absl::string_view limit, absl::string_view message) {
  return Refuse(absl::StatusCode::kResourceExhausted, message,
                {.reason = kLimitExceeded, .limit = std::string(limit)});
}

std::optional<Refusal> RefusalOf(const absl::Status& status) {
  Refusal refusal{.reason = Text(status, kReason), .limit = Text(status, kLimit)};
  if (refusal.reason.empty()) return std::nullopt;
  refusal.owner = Text(status, kOwner);
  int64_t delay_ms = 0;
  if (absl::SimpleAtoi(Text(status, kRetryDelayMs), &delay_ms)) {
    refusal.retry_delay = std::chrono::milliseconds(delay_ms);
  }
  return refusal;
}

}  // namespace polyest::internal
