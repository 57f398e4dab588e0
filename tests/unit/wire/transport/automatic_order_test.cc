#include "proto/wire/transport/automatic_order.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(AutomaticOrder, IsNullInPlaceOfItsWordAndNothingElseMoves) {
  EXPECT_EQ(WithoutAutomaticOrder(R"({"expansion": {"order": "AUTO", "points": "HALTON"}})"),
            R"({"expansion": {"order": null  , "points": "HALTON"}})");
  EXPECT_EQ(WithoutAutomaticOrder(R"({"fixed": {"m": 1}, "inputs": [{"name": "u"}],
    "expansion" : { "points": "HALTON", "order"
      :"AUTO"}})"),
            R"({"fixed": {"m": 1}, "inputs": [{"name": "u"}],
    "expansion" : { "points": "HALTON", "order"
      :null  }})");
}

TEST(AutomaticOrder, LeavesEverythingElseAlone) {
  for (const char* json : {
           R"({"expansion": {"order": 3}})",
           R"({"expansion": {"order": "auto"}})",
           R"({"expansion": {"points": "AUTO"}})",
           R"({"order": "AUTO"})",
           R"({"integration": {"method": "AUTO"}})",
           R"({"expansion": [{"order": "AUTO"}]})",
           R"({"expansion": {"inner": {"order": "AUTO"}}})",
           R"({"a": "\"expansion\": {\"order\": \"AUTO\"}"})",
           R"({"\"expansion": {"order": "AUTO"}})",
           R"({"expansion": {"order": ["AUTO"]}})",
           R"({"expansion": {"order": "AU)",
           R"("AUTO")",
           R"(}}]] "order": "AUTO")",
           "",
       }) {
    EXPECT_EQ(WithoutAutomaticOrder(json), json);
  }
}

TEST(AutomaticOrder, IsFoundInTheProblemsOfARequestWhereverTheyAre) {
  EXPECT_EQ(WithoutAutomaticOrders(R"({"subject": {"problem": {"expansion": {"order": "AUTO"}}},
    "session": {"problem": {"expansion": {"points": "HALTON", "order":"AUTO"}}}})"),
            R"({"subject": {"problem": {"expansion": {"order": null  }}},
    "session": {"problem": {"expansion": {"points": "HALTON", "order":null  }}}})");
  for (const char* json : {R"({"a": {"order": "AUTO"}})", R"({"expansion": [{"order": "AUTO"}]})",
                           R"({"a": {"expansion": {"inner": {"order": "AUTO"}}}})"}) {
    EXPECT_EQ(WithoutAutomaticOrders(json), json);
  }
}

TEST(AutomaticOrder, IsNotLookedForInTextThatNestsWithoutEnd) {
  const std::string deep = std::string(1'000'000, '[') + R"({"expansion": {"order": "AUTO"}})";
  EXPECT_EQ(WithoutAutomaticOrders(deep), deep);
}

}  // namespace
}  // namespace polyest::internal
