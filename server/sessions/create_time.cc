#include "server/sessions/create_time.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>

namespace polyest::internal {
namespace {

using google::protobuf::util::TimeUtil;

constexpr int32_t kMaxNanos = 999'999'999;

}  // namespace

bool HasJsonForm(const google::protobuf::Timestamp& time) {
  return time.seconds() >= TimeUtil::kTimestampMinSeconds &&
         time.seconds() <= TimeUtil::kTimestampMaxSeconds && time.nanos() >= 0 &&
         time.nanos() <= kMaxNanos;
}

google::protobuf::Timestamp NearestWithJsonForm(google::protobuf::Timestamp time) {
  // A time before or after all others is not moved by its part of a second.
  if (time.seconds() < TimeUtil::kTimestampMinSeconds) time.set_nanos(0);
  if (time.seconds() > TimeUtil::kTimestampMaxSeconds) time.set_nanos(kMaxNanos);
  time.set_seconds(std::clamp<int64_t>(time.seconds(), TimeUtil::kTimestampMinSeconds,
                                       TimeUtil::kTimestampMaxSeconds));
  time.set_nanos(std::clamp(time.nanos(), 0, kMaxNanos));
  return time;
}

}  // namespace polyest::internal
