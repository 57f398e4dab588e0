#include "proto/wire/transport/file_text.h"

#include <absl/strings/str_cat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace polyest::internal {

absl::StatusOr<std::string> ReadFileText(const std::string& file) {
  constexpr size_t kLongest = size_t{16} << 20;
  const auto fail = [&](const char* why) {
    return absl::NotFoundError(absl::StrCat(file, ": cannot be read: ", why));
  };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(file.c_str(), "rbe"),
                                                           &std::fclose);
  if (in == nullptr) return fail(std::strerror(errno));
  std::string text;
  char buffer[4096];
  while (const size_t count = std::fread(buffer, 1, sizeof buffer, in.get())) {
    text.append(buffer, count);
    if (text.size() > kLongest) return fail("it is longer than 16 MiB");
  }
  if (std::ferror(in.get()) != 0) return fail(std::strerror(errno));
  return text;
}

}  // namespace polyest::internal
