// Runs `polyest export` and `polyest import`, which copy a session from one daemon to another.

#include <absl/strings/str_cat.h>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/cli/session_file.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

absl::StatusOr<int64_t> Export(const ExportArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(DraftFile::Check(arguments.file));
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  v1::ExportSessionRequest request;
  request.set_name(absl::StrCat("sessions/", arguments.session));
  std::unique_ptr<SessionFileWriter> writer;
  int64_t batches = 0;
  bool ended = false;
  const auto write = [&](const v1::SessionRecord& record) -> absl::Status {
    if (record.has_batch()) batches = record.batch().sequence();
    ended = record.has_end();
    if (writer == nullptr) {
      POLYEST_ASSIGN_OR_RETURN(writer, SessionFileWriter::Open(arguments.file));
    }
    return writer->Write(record);
  };
  POLYEST_RETURN_IF_ERROR(client.ExportSession(request, write));
  if (!ended) return absl::DataLossError("the daemon's records have no end");
  POLYEST_RETURN_IF_ERROR(writer->Finish());
  return batches;
}

absl::StatusOr<v1::Session> Import(const ImportArguments& arguments) {
  POLYEST_ASSIGN_OR_RETURN(const auto reader, SessionFileReader::Open(arguments.file));
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  auto session = client.ImportSession(arguments.session, [&] { return reader->Read(); });
  if (!absl::IsAlreadyExists(session.status())) return session;
  return absl::AlreadyExistsError(
      absl::StrCat(session.status().message(), "; --session NAME imports it under another name"));
}

}  // namespace

int RunCommand(const ExportArguments& arguments, std::ostream& out, std::ostream& err) {
  const auto batches = Export(arguments);
  if (!batches.ok()) return Report(batches.status(), arguments.place.server, err);
  out << "exported sessions/" << arguments.session << " with " << *batches << " batches to "
      << arguments.file << std::endl;
  return kExitOk;
}

int RunCommand(const ImportArguments& arguments, std::ostream& out, std::ostream& err) {
  const auto session = Import(arguments);
  if (!session.ok()) return Report(session.status(), arguments.place.server, err);
  out << "imported " << session->name() << " with " << session->last_sequence() << " batches and "
      << session->sample_count() << " samples" << std::endl;
  return kExitOk;
}

}  // namespace polyest::internal
