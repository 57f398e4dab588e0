#pragma once

// Converts recorded values into a model's unit.
//
// A recorded unit is written as in core/model/units.h, or as files of measurements write it: "-"
// for a plain number, "sec", "inch", "Grad", "U/min"; "g" is standard gravity where the model has
// an acceleration, and "1/min" is rpm where the model has an angular velocity. "°C", "deg C" and
// "degC" are temperatures, 273.15 K above those in K.

#include <absl/status/statusor.h>

#include <string_view>

namespace polyest::internal {

// value in the model's unit = recorded value · multiplier / divisor + offset. The multiplier or the
// divisor is 1. A divisor is a whole number, so that 12 mm become the double nearest to 0.012 m.
// Only temperatures have an offset.
struct UnitConversion {
  double multiplier = 1;
  double divisor = 1;
  double offset = 0;

  bool IsIdentity() const { return multiplier == 1 && divisor == 1 && offset == 0; }
  double operator()(double recorded) const { return recorded * multiplier / divisor + offset; }
};

// Checks that text is a unit that files of measurements write. InvalidArgument states the error.
absl::Status CheckRecordedUnit(std::string_view recorded);

// Returns the conversion from a recorded unit to the model's. InvalidArgument when one of them
// cannot be read, when their dimensions differ, or when one counts cycles (Hz) and the other angles
// (rad, deg, rpm): they have the same dimension, and whether 2π belongs between them is not known.
absl::StatusOr<UnitConversion> ConvertUnit(std::string_view recorded, std::string_view model);

}  // namespace polyest::internal
