#pragma once

#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Returns order, number of terms and number of points of the expansion that a study has used.
template <typename Study>
v1::ExpansionUsed ToExpansionUsed(const Study& study) {
  v1::ExpansionUsed proto;
  proto.set_order(study.order);
  proto.set_term_count(study.terms);
  proto.set_point_count(study.points);
  return proto;
}

}  // namespace polyest::internal
