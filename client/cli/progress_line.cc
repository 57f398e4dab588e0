#include "client/cli/progress_line.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "client/cli/screen.h"
#include "core/common/status.h"
#include "core/common/utf8.h"
#include "core/estimator/record/memory_store.h"

namespace polyest::internal {
namespace {

// Delay before the line is shown.
constexpr std::chrono::milliseconds kFirstShown{500};
constexpr std::chrono::milliseconds kInterval{200};
// Returns to the start of the line and clears it.
constexpr char kClear[] = "\r\x1b[K";

void WriteToTerminal(const std::string& text) {
  [[maybe_unused]] const auto written = write(STDERR_FILENO, text.data(), text.size());
}

// Returns the beginning of UTF-8 text that is at most `places` columns wide.
std::string Cut(const std::string& text, int places) {
  size_t end = 0;
  for (size_t i = 0; i < text.size(); end = i) {
    do {
      ++i;
    } while (i < text.size() && ContinuesCharacter(text[i]));
    if (DisplayWidth(absl::string_view(text).substr(0, i)) > places) break;
  }
  return text.substr(0, end);
}

}  // namespace

ProgressLine::ProgressLine(std::function<std::string()> describe) : describe_(std::move(describe)) {
  if (isatty(STDERR_FILENO) != 0) thread_ = std::thread([this] { Run(); });
}

ProgressLine::~ProgressLine() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ends_.notify_all();
  thread_.join();
  Erase();
}

void ProgressLine::Run() {
  std::unique_lock lock(mutex_);
  auto next = start_ + kFirstShown;
  while (!ends_.wait_until(lock, next, [this] { return ending_; })) {
    Draw();
    next = Clock::now() + kInterval;
  }
}

void ProgressLine::Draw() {
  const std::chrono::duration<double> elapsed = Clock::now() - start_;
  const Screen screen = ScreenOf(STDERR_FILENO, ColorChoice::kNever);
  const std::string text = absl::StrFormat("%s · %.0f s", describe_(), elapsed.count());
  // The last column stays free, since some terminals begin a new line after it.
  WriteToTerminal(absl::StrCat(kClear, Cut(text, screen.columns - 1)));
  shown_ = true;
}

void ProgressLine::Erase() {
  if (std::exchange(shown_, false)) WriteToTerminal(kClear);
}

void ProgressLine::Interject(absl::FunctionRef<void()> print) {
  const std::lock_guard lock(mutex_);
  Erase();
  print();
}

std::string EstimationProgress::Describe() const {
  const int64_t rows = rows_;
  const int64_t latest = latest_;
  const int64_t taken = taken_;
  if (latest == 0) return "computing";
  if (latest < taken) return absl::StrCat("re-expanding, row ", latest, " of ", taken);
  if (taken < rows) return absl::StrCat("row ", taken, " of ", rows);
  return absl::StrCat("all ", rows, " rows taken, assessing the posterior");
}

WatchedStore::WatchedStore(std::shared_ptr<EstimationProgress> progress)
    : progress_(std::move(progress)), store_(std::make_unique<MemoryStore>()) {}

absl::Status WatchedStore::Append(const RowBlock& block) {
  POLYEST_RETURN_IF_ERROR(store_->Append(block));
  progress_->rows_ = store_->rows();
  return absl::OkStatus();
}

absl::Status WatchedStore::Read(int64_t first, int64_t count, RowBlock& block) const {
  progress_->latest_ = first + count;
  progress_->taken_ = std::max<int64_t>(progress_->taken_, first + count);
  return store_->Read(first, count, block);
}

}  // namespace polyest::internal
