#include "client/cli/stream_progress.h"

#include <absl/strings/str_cat.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "client/cli/number_format.h"

namespace polyest::internal {

void StreamProgress::CountRowsOf(int descriptor) {
  struct stat file = {};
  if (fstat(descriptor, &file) != 0 || !S_ISREG(file.st_mode)) return;
  std::vector<char> buffer(1 << 20);
  int64_t lines = 0;
  char last = '\n';
  off_t place = 0;
  ssize_t count = 0;
  // pread() does not change the position from which the data will be read.
  while ((count = pread(descriptor, buffer.data(), buffer.size(), place)) > 0) {
    lines += std::count(buffer.begin(), buffer.begin() + count, '\n');
    last = buffer[static_cast<size_t>(count) - 1];
    place += count;
  }
  if (last != '\n') ++lines;
  rows_of_file_ = std::max<int64_t>(0, lines - 1);  // without the header
}

std::string StreamProgress::Describe() const {
  const int64_t rows = rows_;
  const int64_t total = rows_of_file_;
  if (rows == 0) return "waiting for data";
  std::string text = absl::StrCat("row ", rows);
  // The total includes blank lines, which are not rows.
  if (total > 0) absl::StrAppend(&text, " of ", std::max(rows, total));
  absl::StrAppend(&text, " sent");
  if (estimated_)
    absl::StrAppend(&text, ", estimate up to t = ", FormatNumber(estimate_time_s_, 6), " s");
  return text;
}

}  // namespace polyest::internal
