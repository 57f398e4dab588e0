#include "core/external/model_folder.h"

#include <absl/strings/match.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <system_error>
#include <utility>

#include "core/external/clean_text.h"

namespace polyest::internal {
namespace {

bool IsName(std::string_view name) {
  constexpr size_t kLongest = 250;
  return !name.empty() && name.size() <= kLongest && name.front() != '.' &&
         name.find_first_of("/\\") == std::string_view::npos &&
         CleanText(std::string(name)) == name;
}

}  // namespace

absl::StatusOr<ModelFolder> ModelFolder::Open(const std::filesystem::path& folder,
                                              ModelFileKind kind) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::canonical(folder, error);
  if (error || !std::filesystem::is_directory(absolute, error)) {
    return absl::NotFoundError(
        absl::StrFormat("\"%s\" is not a folder that can be read", folder.string()));
  }
  auto state = std::make_shared<State>();
  state->folder = absolute;
  state->kind = std::move(kind);
  return ModelFolder(std::move(state));
}

void ModelFolder::Refresh() const {
  const ModelFileKind& kind = state_->kind;
  std::map<std::string, Entry> entries;
  std::error_code error;
  for (std::filesystem::directory_iterator file(state_->folder, error), end; !error && file != end;
       file.increment(error)) {
    const std::string file_name = file->path().filename().string();
    if (!absl::EndsWith(file_name, kind.suffix)) continue;
    const std::string name = file_name.substr(0, file_name.size() - kind.suffix.size());
    std::error_code unreadable;
    if (!IsName(name) || !file->is_regular_file(unreadable)) continue;
    const auto written = file->last_write_time(unreadable);
    const uintmax_t size = file->file_size(unreadable);
    if (unreadable) continue;
    const auto known = state_->entries.find(name);
    if (known != state_->entries.end() && known->second.written == written &&
        known->second.size == size) {
      entries.emplace(name, known->second);
    } else {
      entries.emplace(name, Entry{written, size, kind.read(file->path(), name)});
    }
  }
  state_->entries = std::move(entries);
}

std::vector<std::shared_ptr<const Model>> ModelFolder::Models() const {
  const std::lock_guard lock(state_->mutex);
  Refresh();
  std::vector<std::shared_ptr<const Model>> models;
  for (const auto& [name, entry] : state_->entries) {
    if (entry.model.ok()) models.push_back(*entry.model);
  }
  return models;
}

std::vector<BrokenModelFile> ModelFolder::Broken() const {
  const std::lock_guard lock(state_->mutex);
  Refresh();
  std::vector<BrokenModelFile> broken;
  for (const auto& [name, entry] : state_->entries) {
    if (!entry.model.ok()) broken.push_back({name, entry.model.status()});
  }
  return broken;
}

absl::StatusOr<std::shared_ptr<const Model>> ModelFolder::Find(std::string_view name) const {
  const ModelFileKind& kind = state_->kind;
  if (!IsName(name)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("\"%s\" must be the name of a file of the %s folder without %s",
                        name.substr(0, 250), kind.noun, kind.suffix));
  }
  const std::lock_guard lock(state_->mutex);
  Refresh();
  const auto found = state_->entries.find(std::string(name));
  if (found != state_->entries.end()) return found->second.model;
  std::vector<std::string> names;
  for (const auto& [known, entry] : state_->entries) names.push_back(known);
  return absl::NotFoundError(absl::StrFormat("there is no %s \"%s\"; there are %s", kind.noun, name,
                                             names.empty() ? "none" : absl::StrJoin(names, ", ")));
}

}  // namespace polyest::internal
