#include "server/service/status_mapping.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <google/protobuf/util/time_util.h>
#include <grpcpp/support/error_details.h>

#include <chrono>
#include <optional>
#include <string>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/utf8.h"
#include "polyest/rpc/error_details.pb.h"
#include "proto/wire/convert/wire_fields.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

// Both libraries give the same codes the same numbers.
static_assert(static_cast<int>(absl::StatusCode::kCancelled) == grpc::StatusCode::CANCELLED);
static_assert(static_cast<int>(absl::StatusCode::kAborted) == grpc::StatusCode::ABORTED);
static_assert(static_cast<int>(absl::StatusCode::kUnauthenticated) ==
              grpc::StatusCode::UNAUTHENTICATED);
grpc::StatusCode ToGrpc(absl::StatusCode code) { return static_cast<grpc::StatusCode>(code); }

// The trailers of a call have room for 8 KiB. A byte of the message takes at most three bytes
// there, and again one and a third in the details.
constexpr size_t kLongestMessage = 1'400;
constexpr size_t kLongestDescription = 200;

std::string Shortened(absl::string_view text, size_t longest) {
  if (text.size() <= longest) return std::string(text);
  return absl::StrCat(CutAt(text, longest), "…");
}

template <typename Detail>
void AddDetail(const Detail& detail, rpc::Status& status) {
  google::protobuf::Any& any = *status.add_details();
  any.set_type_url("type.googleapis.com/google.rpc." + detail.GetDescriptor()->name());
  detail.SerializeToString(any.mutable_value());
}

void AddBadRequest(const std::string& field, absl::string_view sentence, rpc::Status& status) {
  rpc::BadRequest bad;
  auto& violation = *bad.add_field_violations();
  violation.set_field(Shortened(field, kLongestDescription));
  violation.set_description(Shortened(sentence, kLongestDescription));
  AddDetail(bad, status);
}

void AddQuotaFailure(absl::string_view subject, rpc::Status& status) {
  rpc::QuotaFailure failure;
  auto& violation = *failure.add_violations();
  violation.set_subject(std::string(subject));
  violation.set_description(Shortened(status.message(), kLongestDescription));
  AddDetail(failure, status);
}

void AddErrorInfo(const Refusal& refusal, rpc::Status& status) {
  rpc::ErrorInfo info;
  info.set_reason(refusal.reason);
  info.set_domain("polyest");
  if (!refusal.limit.empty()) (*info.mutable_metadata())["limit"] = refusal.limit;
  if (!refusal.owner.empty()) (*info.mutable_metadata())["owner"] = refusal.owner;
  AddDetail(info, status);
}

void AddRetryInfo(std::chrono::milliseconds delay, rpc::Status& status) {
  rpc::RetryInfo retry;
  *retry.mutable_retry_delay() =
      google::protobuf::util::TimeUtil::MillisecondsToDuration(delay.count());
  AddDetail(retry, status);
}

}  // namespace

rpc::Status ToRpcStatus(const absl::Status& given) {
  const absl::Status status = WireFields(given);
  rpc::Status detailed;
  detailed.set_code(ToGrpc(status.code()));
  detailed.set_message(Shortened(status.message(), kLongestMessage));
  const std::optional<Refusal> refusal = RefusalOf(status);
  const std::string field = FieldOf(status).value_or(FieldPath()).ToString();
  if (absl::IsInvalidArgument(status) && !field.empty()) {
    AddBadRequest(field, SentenceOf(status), detailed);
  }
  if (absl::IsResourceExhausted(status)) {
    const std::string& subject = refusal && !refusal->limit.empty() ? refusal->limit : field;
    if (!subject.empty()) AddQuotaFailure(subject, detailed);
  }
  if (refusal) AddErrorInfo(*refusal, detailed);
  if (refusal && refusal->retry_delay) AddRetryInfo(*refusal->retry_delay, detailed);
  return detailed;
}

grpc::Status ToGrpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const rpc::Status detailed = ToRpcStatus(status);
  if (detailed.details().empty()) return grpc::Status(ToGrpc(status.code()), detailed.message());
  grpc::Status result;
  POLYEST_CHECK(grpc::SetErrorDetails(detailed, &result).ok());
  return result;
}

}  // namespace polyest::internal
