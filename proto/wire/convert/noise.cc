#include "proto/wire/convert/noise.h"

#include "core/common/status.h"
#include "proto/wire/convert/annotate.h"

namespace polyest::internal {

absl::StatusOr<OutlierHandling> ToOutlierHandling(const v1::MeasuredOutput::Noise& noise) {
  switch (noise.outliers()) {
    case v1::MeasuredOutput::Noise::OUTLIERS_UNSPECIFIED:
    case v1::MeasuredOutput::Noise::NONE:
      return OutlierHandling::kNone;
    case v1::MeasuredOutput::Noise::STUDENT_T:
      return OutlierHandling::kStudentT;
    case v1::MeasuredOutput::Noise::HUBER:
      return OutlierHandling::kHuber;
    default:
      return UnknownEnumerator("outliers", noise.outliers());
  }
}

absl::StatusOr<NoiseModel> ToNoise(const v1::MeasuredOutput::Noise& given) {
  NoiseModel noise{given.absolute(), given.relative(), given.relative_to_max(), given.unknown()};
  noise.full_scale = given.full_scale();
  const auto& correlation = given.correlation();
  noise.white_share = correlation.white_share();
  if (correlation.has_time_constant_s()) {
    noise.correlation = NoiseCorrelation::kKnown;
    noise.time_constant_s = correlation.time_constant_s();
  } else if (correlation.auto_()) {
    noise.correlation = NoiseCorrelation::kUnknown;
  }
  POLYEST_ASSIGN_OR_RETURN(noise.outliers, ToOutlierHandling(given));
  return noise;
}

}  // namespace polyest::internal
