#include "server/web/json_cache.h"

#include <functional>

#include "server/web/transcode.h"

namespace polyest::internal {
namespace {

// Larger messages are not estimates, and would take much memory.
constexpr size_t kLargest = size_t{64} << 10;

}  // namespace

JsonCache::Text JsonCache::ToJson(const std::string& bytes,
                                  const google::protobuf::Descriptor& type) {
  if (bytes.size() > kLargest) return std::make_shared<const std::string>(ToJsonText(bytes, type));
  const std::shared_ptr<Entry> entry = Find(bytes, type);
  std::call_once(entry->once, [&] {
    entry->text = std::make_shared<const std::string>(ToJsonText(bytes, type));
  });
  return entry->text;
}

std::shared_ptr<JsonCache::Entry> JsonCache::Find(const std::string& bytes,
                                                  const google::protobuf::Descriptor& type) {
  const size_t place = std::hash<std::string>()(bytes) % entries_.size();
  const std::lock_guard lock(mutex_);
  std::shared_ptr<Entry>& entry = entries_[place];
  if (entry == nullptr || &entry->type != &type || entry->bytes != bytes) {
    entry = std::make_shared<Entry>(bytes, type);
  }
  return entry;
}

}  // namespace polyest::internal
