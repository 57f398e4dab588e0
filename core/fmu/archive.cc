#include "core/fmu/archive.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>
#include <sys/stat.h>
#include <zip.h>
#include <zlib.h>

#include <array>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/external/clean_text.h"

namespace polyest::internal {
namespace {

constexpr size_t kLongestName = 1024;

struct CloseEntry {
  void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};
using OpenEntry = std::unique_ptr<zip_file_t, CloseEntry>;

// Calls write(data, size) for each piece of the entry until it returns an error.
template <class Write>
absl::Status ForEachPiece(zip_t* archive, uint64_t index, const std::string& name, Write write) {
  const OpenEntry entry(zip_fopen_index(archive, index, 0));
  if (entry == nullptr) {
    return absl::FailedPreconditionError(
        absl::StrFormat("the archive's %s cannot be read: %s", name, zip_strerror(archive)));
  }
  std::array<char, 65536> piece;
  for (;;) {
    const zip_int64_t size = zip_fread(entry.get(), piece.data(), piece.size());
    if (size == 0) return absl::OkStatus();
    if (size < 0) {
      return absl::FailedPreconditionError(
          absl::StrFormat("the archive's %s is damaged: %s", name, zip_file_strerror(entry.get())));
    }
    POLYEST_RETURN_IF_ERROR(write(piece.data(), static_cast<size_t>(size)));
  }
}

absl::Status CheckName(const std::string& name) {
  const auto refuse = [&name](const char* rule) {
    return absl::FailedPreconditionError(
        absl::StrFormat("the archive's entry \"%s\" %s", CleanText(name, kLongestName), rule));
  };
  if (name.empty() || name.size() > kLongestName) return refuse("must have 1 to 1024 characters");
  if (name.front() == '/') return refuse("must not be an absolute path");
  if (name.find('\\') != std::string::npos) return refuse("must not have a backslash");
  for (const absl::string_view part : absl::StrSplit(name, '/')) {
    if (part == "..") return refuse("must not leave the folder");
  }
  return absl::OkStatus();
}

bool IsSymbolicLink(zip_t* archive, uint64_t index) {
  zip_uint8_t system = 0;
  zip_uint32_t attributes = 0;
  return zip_file_get_external_attributes(archive, index, 0, &system, &attributes) == 0 &&
         system == ZIP_OPSYS_UNIX && S_ISLNK(attributes >> 16);
}

}  // namespace

void Archive::Discard::operator()(zip* archive) const { zip_discard(archive); }

absl::StatusOr<Archive> Archive::Open(const std::filesystem::path& file,
                                      const ArchiveLimits& limits) {
  int code = 0;
  std::unique_ptr<zip, Discard> opened(zip_open(file.c_str(), ZIP_RDONLY, &code));
  if (opened == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string reason = zip_error_strerror(&error);
    zip_error_fini(&error);
    return absl::FailedPreconditionError(
        absl::StrFormat("the file cannot be opened as a zip archive: %s", reason));
  }
  Archive archive(std::move(opened), limits);
  POLYEST_RETURN_IF_ERROR(archive.CheckEntries());
  return archive;
}

absl::Status Archive::CheckEntries() const {
  const zip_int64_t entries = zip_get_num_entries(archive_.get(), 0);
  if (entries > limits_.max_entries) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "the archive has %d entries; the limit is %d", entries, limits_.max_entries));
  }
  for (zip_uint64_t i = 0; i < static_cast<zip_uint64_t>(entries); ++i) {
    const char* const name = zip_get_name(archive_.get(), i, 0);
    POLYEST_RETURN_IF_ERROR(CheckName(name == nullptr ? "" : name));
    if (IsSymbolicLink(archive_.get(), i)) {
      return absl::FailedPreconditionError(
          absl::StrFormat("the archive's entry \"%s\" must not be a symbolic link", name));
    }
  }
  return absl::OkStatus();
}

bool Archive::Contains(const std::string& entry) const {
  return zip_name_locate(archive_.get(), entry.c_str(), 0) >= 0;
}

uint32_t Archive::Checksum() const {
  const auto entries = static_cast<zip_uint64_t>(zip_get_num_entries(archive_.get(), 0));
  uLong checksum = 0;
  for (zip_uint64_t i = 0; i < entries; ++i) {
    zip_stat_t entry;
    zip_stat_init(&entry);
    zip_stat_index(archive_.get(), i, 0, &entry);
    const std::string text = absl::StrFormat("%s %d %d\n", entry.name == nullptr ? "" : entry.name,
                                             entry.size, entry.crc);
    checksum = crc32_z(checksum, reinterpret_cast<const Bytef*>(text.data()), text.size());
  }
  return static_cast<uint32_t>(checksum);
}

absl::StatusOr<std::string> Archive::Read(const std::string& entry, int64_t max_bytes) const {
  const zip_int64_t index = zip_name_locate(archive_.get(), entry.c_str(), 0);
  if (index < 0) {
    return absl::FailedPreconditionError(absl::StrFormat("the archive has no %s", entry));
  }
  std::string text;
  const auto append = [&](const char* data, size_t size) {
    text.append(data, size);
    if (static_cast<int64_t>(text.size()) <= max_bytes) return absl::OkStatus();
    return absl::FailedPreconditionError(
        absl::StrFormat("the archive's %s has more than %d bytes", entry, max_bytes));
  };
  POLYEST_RETURN_IF_ERROR(
      ForEachPiece(archive_.get(), static_cast<uint64_t>(index), entry, append));
  return text;
}

absl::Status Archive::Unpack(const std::filesystem::path& folder) const {
  int64_t bytes_left = limits_.max_bytes;
  const auto entries = static_cast<uint64_t>(zip_get_num_entries(archive_.get(), 0));
  for (uint64_t i = 0; i < entries; ++i) {
    POLYEST_RETURN_IF_ERROR(UnpackEntry(i, folder, bytes_left));
  }
  return absl::OkStatus();
}

absl::Status Archive::UnpackEntry(uint64_t index, const std::filesystem::path& folder,
                                  int64_t& bytes_left) const {
  const std::string name = zip_get_name(archive_.get(), index, 0);
  const std::filesystem::path path = folder / name;
  const auto cannot_write = [&name] {
    return absl::ResourceExhaustedError(
        absl::StrFormat("the archive's %s cannot be written to the temporary folder", name));
  };
  std::error_code error;
  if (name.ends_with('/')) {
    std::filesystem::create_directories(path, error);
    return error ? cannot_write() : absl::OkStatus();
  }
  std::filesystem::create_directories(path.parent_path(), error);
  std::ofstream file(path, std::ios::binary);
  const auto write = [&](const char* data, size_t size) {
    bytes_left -= static_cast<int64_t>(size);
    if (bytes_left < 0) {
      return absl::FailedPreconditionError(absl::StrFormat(
          "the archive unpacks to more than the limit of %d bytes", limits_.max_bytes));
    }
    file.write(data, static_cast<std::streamsize>(size));
    return file ? absl::OkStatus() : cannot_write();
  };
  POLYEST_RETURN_IF_ERROR(ForEachPiece(archive_.get(), index, name, write));
  file.close();
  return file ? absl::OkStatus() : cannot_write();
}

}  // namespace polyest::internal
