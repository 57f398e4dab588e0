// Tests that matrices of any shape arrive as they were sent, and that damaged ones are refused.

#include "core/fmu/codec.h"

#include <gtest/gtest.h>

#include <limits>

namespace polyest::internal {
namespace {

TEST(Codec, KeepsTheShapeOfMatrices) {
  for (const auto& [rows, columns] : {std::pair{2, 3}, {40, 0}, {0, 3}, {0, 0}}) {
    Matrix sent = Matrix::Constant(rows, columns, 1.5);
    Encoder encoder;
    encoder(sent);
    Decoder decoder(encoder.TakeBytes());
    Matrix received;
    decoder(received);
    EXPECT_TRUE(decoder.complete());
    EXPECT_EQ(received.rows(), rows);
    EXPECT_EQ(received.cols(), columns);
    EXPECT_EQ(received, sent);
  }
}

TEST(Codec, RefusesMatricesThatTheBytesDoNotHold) {
  const uint64_t most = std::numeric_limits<uint64_t>::max();
  for (auto [rows, columns] :
       {std::pair<uint64_t, uint64_t>{2, 1}, {most, 0}, {most, 2}, {1, most}}) {
    Encoder encoder;
    double value = 0;
    encoder(rows, columns, value);
    Decoder decoder(encoder.TakeBytes());
    Matrix received;
    decoder(received);
    EXPECT_FALSE(decoder.ok()) << rows << " x " << columns;
  }
}

}  // namespace
}  // namespace polyest::internal
