#include "server/sessions/batch_sequence.h"

#include <gtest/gtest.h>

namespace polyest {
namespace {

v1::Measurements BatchAt(double time) {
  v1::Measurements batch;
  batch.add_time(time);
  return batch;
}

TEST(BatchSequence, StartsAtOneAndGoesUpByOne) {
  BatchSequence sequence;
  EXPECT_EQ(sequence.last(), 0);
  EXPECT_EQ(*sequence.Check(1, BatchAt(1)), BatchSequence::Place::kNext);
  sequence.Accept(BatchAt(1));
  EXPECT_EQ(sequence.last(), 1);
  EXPECT_EQ(*sequence.Check(2, BatchAt(2)), BatchSequence::Place::kNext);
}

TEST(BatchSequence, KnowsARepeatOfTheLastBatchByItsContent) {
  BatchSequence sequence;
  sequence.Accept(BatchAt(1));
  EXPECT_EQ(*sequence.Check(1, BatchAt(1)), BatchSequence::Place::kRepeat);
  EXPECT_EQ(sequence.Check(1, BatchAt(2)).status().message(),
            "sequence: 1 was acknowledged with other measurements; the next batch must be 2");
}

TEST(BatchSequence, RefusesGapsAndThePastNamingTheNumberExpected) {
  BatchSequence sequence;
  for (const int64_t wrong : {-1, 0, 2}) {
    const auto status = sequence.Check(wrong, BatchAt(1)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(status.message(), "sequence: " + std::to_string(wrong) +
                                    " must be 1, one more than the last batch acknowledged");
  }
  for (const double time : {1, 2, 3}) sequence.Accept(BatchAt(time));
  for (const int64_t wrong : {0, 1, 2, 5}) EXPECT_FALSE(sequence.Check(wrong, BatchAt(2)).ok());
}

}  // namespace
}  // namespace polyest
