#pragma once

// Fills a daemon's disk.

#include <gtest/gtest.h>

#include "polyest/client.h"

namespace polyest::internal {

// A session whose rows fill the daemon's disk.
class Ballast {
 public:
  Ballast(Client& client, const v1::Problem& problem) : client_(client) {
    v1::CreateSessionRequest create;
    *create.mutable_session()->mutable_problem() = problem;
    create.set_session_id("ballast");
    EXPECT_TRUE(client_.CreateSession(create).ok());
  }

  // Adds rows until there is no room for another one.
  void Fill() {
    for (int rows = 4096; rows > 0; rows /= 2) {
      absl::Status added;
      while (added.ok()) added = Add(rows);
      ASSERT_TRUE(absl::IsResourceExhausted(added)) << added;
    }
  }

 private:
  absl::Status Add(int rows) {
    v1::AddMeasurementsRequest add;
    add.set_session("sessions/ballast");
    auto& x = *add.mutable_measurements()->add_channels();
    x.set_name("x");
    for (int i = 0; i < rows; ++i) {
      add.mutable_measurements()->add_time_s(0.001 * static_cast<double>(rows_ + i));
      x.add_values(0.1);
      x.add_missing(i);  // rows without samples are not worth computing
    }
    add.set_sequence(sequence_ + 1);
    absl::Status added = client_.AddMeasurements(add).status();
    if (!added.ok()) return added;
    ++sequence_;
    rows_ += rows;
    return added;
  }

  Client& client_;
  int64_t sequence_ = 0, rows_ = 0;
};

}  // namespace polyest::internal
