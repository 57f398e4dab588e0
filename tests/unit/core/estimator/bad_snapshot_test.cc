// Checks that snapshots which are cut off, changed, or of something else are refused by name. None
// crashes an estimator or leaves anything in it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <absl/strings/str_cat.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>

#include "core/estimator/problem_fingerprint.h"
#include "core/estimator/snapshot.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/snapshot_session.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

// Tries everything that may be wrong with a snapshot, on a problem made small.
class BadSnapshot : public ::testing::Test {
 protected:
  BadSnapshot() : problem_(OscillatorProblem()), samples_(OscillatorRecord(40)) {
    problem_.integration.samples_between_checkpoints = kInterval;
    Session session(problem_);
    session.Take(samples_);
    good_ = session.last;
    estimate_ = session.Current();
  }

  // Restores an estimator to which the samples have been appended.
  absl::Status Restored(const EstimatorSnapshot& snapshot, const Problem& problem) const {
    const auto estimator = MakeEstimator(problem);
    EXPECT_TRUE(estimator->Append(samples_).ok());
    return estimator->Restore(snapshot);
  }
  absl::Status Restored(const std::string& state) const {
    return Restored({good_.rows, state}, problem_);
  }

  // Appends the correct checksum.
  static std::string Sealed(std::string body) {
    const auto checksum =
        static_cast<uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size()));
    for (int shift = 0; shift < 32; shift += 8) {
      body.push_back(static_cast<char>(checksum >> shift & 0xff));
    }
    return body;
  }
  std::string Body() const { return good_.state.substr(0, good_.state.size() - 4); }

  Problem problem_;
  Samples samples_;
  EstimatorSnapshot good_;
  Estimate estimate_;
};

TEST_F(BadSnapshot, IsRefusedWhenCutOff) {
  ASSERT_TRUE(Restored(Sealed(Body())).ok());
  for (size_t size = 0; size < good_.state.size(); size += 1 + size / 20) {
    EXPECT_TRUE(absl::IsDataLoss(Restored(good_.state.substr(0, size)))) << size;
    // A cut snapshot is also refused when its checksum is correct.
    EXPECT_TRUE(absl::IsDataLoss(Restored(Sealed(Body().substr(0, size))))) << size;
  }
}

TEST_F(BadSnapshot, IsRefusedWithAnyByteChanged) {
  for (size_t i = 0; i < good_.state.size(); i += 1 + i / 20) {
    std::string state = good_.state;
    state[i] = static_cast<char>(state[i] ^ 0x40);
    EXPECT_TRUE(absl::IsDataLoss(Restored(state))) << i;
  }
}

// A changed snapshot with a correct checksum must neither crash nor exhaust the memory. It may hold
// sizes without bounds, indices out of range, and NaN or infinity.
TEST_F(BadSnapshot, CrashesNothingWhenSealedAgain) {
  std::mt19937_64 random(3);
  int refused = 0;
  constexpr int kTrials = 300;
  const size_t size = Body().size();
  for (int trial = 0; trial < kTrials; ++trial) {
    std::string body = Body();
    // The beginning has most of the sizes; the end, most of the counters.
    const size_t near_end = trial % 3 == 0 ? size : std::min<size_t>(size, 600);
    const size_t at = trial % 3 == 2 ? size - 1 - random() % near_end : random() % near_end;
    for (size_t i = at; i < std::min(size, at + 1 + random() % 8); ++i) {
      body[i] = static_cast<char>(trial % 2 == 0 ? 0xff : random());
    }
    const auto estimator = MakeEstimator(problem_);
    ASSERT_TRUE(estimator->Append(samples_).ok());
    const absl::Status status = estimator->Restore({good_.rows, Sealed(body)});
    if (status.ok()) {  // The content may be anything.
      estimator->Process().IgnoreError();
      estimator->CurrentEstimate().status().IgnoreError();
      continue;
    }
    ++refused;
    EXPECT_TRUE(absl::IsDataLoss(status) || absl::IsFailedPrecondition(status)) << status;
    EXPECT_EQ(estimator->rows_processed(), 0);
  }
  EXPECT_GT(refused, kTrials / 5);
}

// Errors of an expansion that cannot be would make every estimate wrong or NaN.
TEST_F(BadSnapshot, HasErrorsThatCannotBe) {
  const uint32_t fingerprint = FingerprintOf(problem_);
  const auto changed = [&](double AbsorbedRows::*error, double value) {
    EstimatorState state = DecodeState(good_.state, good_.rows, fingerprint).value();
    state.mixture.components.front().expansion.absorbed.*error = value;
    return Restored(EncodeState(state, good_.rows, fingerprint));
  };
  for (const auto error :
       {&AbsorbedRows::own_error, &AbsorbedRows::carried_error, &AbsorbedRows::carried_rate}) {
    EXPECT_TRUE(changed(error, 0.01).ok());
    for (const double value : {-0.01, kInfinity, std::nan("")}) {
      EXPECT_TRUE(absl::IsDataLoss(changed(error, value))) << value;
    }
  }
}

TEST_F(BadSnapshot, LeavesTheEstimatorToProcessTheRowsItself) {
  const auto estimator = MakeEstimator(problem_);
  ASSERT_TRUE(estimator->Append(samples_).ok());
  ASSERT_FALSE(estimator->Restore({good_.rows, "anything"}).ok());
  ASSERT_TRUE(estimator->Process().ok());
  ExpectSame(estimator->CurrentEstimate().value(), estimate_);
}

TEST_F(BadSnapshot, IsOneOfAnotherProblem) {
  const auto refused = [&](const auto& change) {
    Problem problem = problem_;
    change(problem);
    const absl::Status status = Restored(good_, problem);
    return absl::IsFailedPrecondition(status) &&
           status.message() == "the snapshot is of another problem";
  };
  EXPECT_FALSE(refused([](Problem&) {}));
  EXPECT_TRUE(refused([](Problem& p) { p.fixed["c"] = 0.11; }));
  EXPECT_TRUE(refused([](Problem& p) { p.uncertain[0].scale *= 1.01; }));
  EXPECT_TRUE(refused([](Problem& p) { p.measured[0].noise.absolute = 0.021; }));
  EXPECT_TRUE(refused([](Problem& p) { p.inputs = {{"force", ConstantInput{0}}}; }));
  EXPECT_TRUE(refused([](Problem& p) { p.expansion.order = 4; }));
  EXPECT_TRUE(refused([](Problem& p) { p.regularization = 2; }));
  EXPECT_TRUE(refused([](Problem& p) { p.integration.relative_tolerance = 1e-6; }));
  EXPECT_TRUE(refused([](Problem& p) { p.integration.samples_between_checkpoints = 31; }));
  EXPECT_TRUE(refused([](Problem& p) { p.derived = {{"v0", "0 * k"}}; }));
}

// What a snapshot says of the record's beginning is computed with: times that go back would end it.
TEST_F(BadSnapshot, BeginsAtOtherTimesThanTheRows) {
  const uint32_t fingerprint = FingerprintOf(problem_);
  Samples stretched = samples_;
  for (double& time_s : stretched.time_s) time_s *= 1.5;
  Session session(problem_);
  session.Take(stretched);
  EstimatorState state = DecodeState(good_.state, good_.rows, fingerprint).value();
  const EstimatorState other =
      DecodeState(session.last.state, session.last.rows, fingerprint).value();
  ASSERT_EQ(session.last.rows, good_.rows);
  state.mixture.components.front().summary = other.mixture.components.front().summary;
  const absl::Status status = Restored(EncodeState(state, good_.rows, fingerprint));
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(status.message(), HasSubstr("not those of the snapshot"));
}

// The rows up to the next look are caught up with one look at a time.
TEST_F(BadSnapshot, LooksForABetterMinimumAtRowsThatCannotBe) {
  const uint32_t fingerprint = FingerprintOf(problem_);
  const auto restored = [&](int64_t SecondSearch::State::*row, int64_t value) {
    EstimatorState state = DecodeState(good_.state, good_.rows, fingerprint).value();
    state.search.*row = value;
    return Restored(EncodeState(state, good_.rows, fingerprint));
  };
  EXPECT_TRUE(restored(&SecondSearch::State::row, good_.rows + 1).ok());
  EXPECT_TRUE(restored(&SecondSearch::State::tried_row, good_.rows).ok());
  constexpr int64_t kFar = int64_t{1} << 62;
  for (const int64_t row : {-kFar, good_.rows, 2 * good_.rows, kFar}) {
    EXPECT_TRUE(absl::IsDataLoss(restored(&SecondSearch::State::row, row))) << row;
  }
  for (const int64_t row : {-kFar, good_.rows + 1}) {
    EXPECT_TRUE(absl::IsDataLoss(restored(&SecondSearch::State::tried_row, row))) << row;
  }
}

// The description of a model, with another identity.
class OtherFile final : public Model {
 public:
  explicit OtherFile(const ModelDescription& description) : description_(description) {
    description_.identity = "another file";
  }
  const ModelDescription& description() const override { return description_; }

 private:
  ModelDescription description_;
};

TEST_F(BadSnapshot, IsOneOfAModelFromAnotherFile) {
  Problem problem = problem_;
  problem.model = std::make_shared<OtherFile>(problem_.model->description());
  EXPECT_NE(FingerprintOf(problem), FingerprintOf(problem_));
}

TEST_F(BadSnapshot, IsOneOfAnotherVersion) {
  std::string body = Body();
  // The version follows cereal's mark of endianness, the size of the name and the name.
  const size_t version = 1 + 8 + std::string("polyest estimator").size();
  ASSERT_EQ(body[version], static_cast<char>(kSnapshotVersion));
  body[version] = static_cast<char>(kSnapshotVersion + 1);
  const absl::Status status = Restored(Sealed(body));
  EXPECT_TRUE(absl::IsFailedPrecondition(status));
  EXPECT_THAT(std::string(status.message()),
              HasSubstr(absl::StrCat("version ", kSnapshotVersion + 1)));
}

TEST_F(BadSnapshot, IsOneOfOtherRows) {
  EXPECT_TRUE(absl::IsDataLoss(Restored({good_.rows - 1, good_.state}, problem_)));
  Samples later = samples_;
  for (double& t : later.time_s) t += 0.01;
  const auto estimator = MakeEstimator(problem_);
  ASSERT_TRUE(estimator->Append(later).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(estimator->Restore(good_)));
}

TEST_F(BadSnapshot, IsOneForWhichTheRowsAreNotThereOrTaken) {
  const auto estimator = MakeEstimator(problem_);
  ASSERT_TRUE(estimator->Append(testing::Rows(samples_, 0, 20)).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(estimator->Restore(good_)));
  ASSERT_TRUE(estimator->Append(testing::Rows(samples_, 20, 20)).ok());
  ASSERT_TRUE(estimator->Process().ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(estimator->Restore(good_)));
}

}  // namespace
}  // namespace polyest::internal
