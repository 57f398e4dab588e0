#include "server/web/json_cache.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "polyest/v1/session_service.pb.h"
#include "server/web/transcode.h"

namespace polyest::internal {
namespace {

std::string Message(int64_t sequence) {
  v1::WatchSessionResponse response;
  response.mutable_estimate()->set_sequence(sequence);
  return response.SerializeAsString();
}

TEST(JsonCache, MakesTheTextOfAMessageOnce) {
  const auto& type = *v1::WatchSessionResponse::descriptor();
  JsonCache cache;
  std::vector<JsonCache::Text> texts(8);
  std::vector<std::thread> threads;
  for (JsonCache::Text& text : texts) {
    threads.emplace_back([&] { text = cache.ToJson(Message(1), type); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const JsonCache::Text& text : texts) {
    EXPECT_EQ(text, texts.front());  // the same object
    EXPECT_EQ(*text, ToJsonText(Message(1), type));
  }
}

TEST(JsonCache, TellsMessagesApartWhereverTheyArePut) {
  const auto& type = *v1::WatchSessionResponse::descriptor();
  JsonCache cache;
  for (int round = 0; round < 2; ++round) {
    for (int64_t sequence = 1; sequence <= 200; ++sequence) {
      EXPECT_EQ(*cache.ToJson(Message(sequence), type), ToJsonText(Message(sequence), type));
    }
  }
  // The same bytes mean something else as another type.
  const auto& other = *v1::GetSessionRequest::descriptor();
  EXPECT_EQ(*cache.ToJson("", type), ToJsonText("", type));
  EXPECT_EQ(*cache.ToJson("", other), ToJsonText("", other));
}

}  // namespace
}  // namespace polyest::internal
