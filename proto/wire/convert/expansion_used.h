#pragma once

#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// The expansion that a study of the core says it has used.
template <typename Study>
v1::ExpansionUsed ToExpansionUsed(const Study& study) {
  v1::ExpansionUsed proto;
  proto.set_order(study.order);
  proto.set_term_count(study.terms);
  proto.set_point_count(study.points);
  return proto;
}

}  // namespace polyest::internal
