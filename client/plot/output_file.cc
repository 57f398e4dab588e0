#include "client/plot/output_file.h"

#include <absl/strings/str_cat.h>

#include "client/plot/draft_file.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr mode_t kAnybody = 0666;

absl::Status WithOption(absl::string_view option, const absl::Status& status) {
  return status.ok() ? status : absl::UnknownError(absl::StrCat(option, ": ", status.message()));
}

absl::Status WriteDraft(const std::string& file, absl::string_view text) {
  POLYEST_ASSIGN_OR_RETURN(const auto draft, DraftFile::Open(file, kAnybody));
  POLYEST_RETURN_IF_ERROR(draft->Write(text));
  return draft->Replace();
}

}  // namespace

absl::Status CheckOutputFile(absl::string_view option, const std::string& file) {
  return WithOption(option, DraftFile::Check(file));
}

absl::Status WriteOutputFile(absl::string_view option, const std::string& file,
                             absl::string_view text) {
  return WithOption(option, WriteDraft(file, text));
}

}  // namespace polyest::internal
