// Serves BackupService: sends a backup of the journal, read from its file as fast as the client
// takes it.

#include <absl/strings/str_cat.h>
#include <openssl/evp.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "polyest/v1/backup_service.grpc.pb.h"
#include "server/service/record_flow.h"
#include "server/service/services.h"
#include "server/service/stream_admission.h"

namespace polyest::internal {
namespace {

constexpr size_t kChunkBytes = 256 << 10;

using BackupFlow = RecordFlow<v1::DownloadBackupResponse>;

// Makes a backup and returns its parts.
class BackupParts {
 public:
  explicit BackupParts(const ServiceContext& context)
      : context_(context), digest_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    POLYEST_CHECK(digest_ != nullptr && EVP_DigestInit_ex(digest_.get(), EVP_sha256(), nullptr));
  }

  absl::StatusOr<std::vector<v1::DownloadBackupResponse>> Next(const Stop& stop) {
    std::vector<v1::DownloadBackupResponse> parts(1);
    if (backup_ == nullptr) {
      POLYEST_ASSIGN_OR_RETURN(*parts.front().mutable_summary(), Begin(stop));
    } else if (sent_ < backup_->bytes()) {
      POLYEST_ASSIGN_OR_RETURN(std::string bytes, backup_->Read(sent_, kChunkBytes));
      sent_ += static_cast<int64_t>(bytes.size());
      POLYEST_CHECK(EVP_DigestUpdate(digest_.get(), bytes.data(), bytes.size()));
      parts.front().set_chunk(std::move(bytes));
    } else if (!std::exchange(ended_, true)) {
      std::string& sha256 = *parts.front().mutable_end()->mutable_sha256();
      sha256.resize(EVP_MD_size(EVP_sha256()));
      POLYEST_CHECK(EVP_DigestFinal_ex(digest_.get(),
                                       reinterpret_cast<unsigned char*>(sha256.data()), nullptr));
    } else {
      parts.clear();
    }
    return parts;
  }

 private:
  absl::StatusOr<v1::BackupSummary> Begin(const Stop& stop) {
    v1::BackupSummary summary;
    *summary.mutable_create_time() = context_.wall_clock();
    POLYEST_ASSIGN_OR_RETURN(backup_, context_.sessions.services().journal.BackUp(stop));
    summary.set_size_bytes(backup_->bytes());
    const JournalContents& contents = backup_->contents();
    summary.set_session_count(contents.sessions);
    summary.set_batch_count(contents.batches);
    // A message has room for so many.
    constexpr size_t kToldDamage = 1'000;
    for (const std::string& damage : contents.damage) {
      if (summary.damage_size() < static_cast<int>(kToldDamage)) summary.add_damage(damage);
    }
    return summary;
  }

  const ServiceContext& context_;
  std::unique_ptr<JournalBackup> backup_;
  int64_t sent_ = 0;
  bool ended_ = false;
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> digest_;
};

class BackupCall final : public grpc::ServerWriteReactor<v1::DownloadBackupResponse> {
 public:
  BackupCall(const ServiceContext& context, const grpc::CallbackServerContext& call)
      : flow_(std::make_shared<BackupFlow>(context.executor, context.calls.memory())) {
    const absl::StatusOr<Caller> admitted =
        AdmitStream(context, call, "DownloadBackup", OpenCalls::Kind::kWatcher, flow_, ticket_);
    if (!admitted.ok()) {
      flow_->OnStart(this, "", admitted.status());
      return;
    }
    const auto parts = std::make_shared<BackupParts>(context);
    flow_->OnStart(this, admitted->tenant, [parts](const Stop& stop) { return parts->Next(stop); });
  }

  void OnWriteDone(bool ok) override { flow_->OnWritten(ok); }
  void OnCancel() override { flow_->OnCancelled(); }
  void OnDone() override {
    flow_->OnDone();
    delete this;
  }

 private:
  std::shared_ptr<BackupFlow> flow_;
  std::unique_ptr<OpenCalls::Ticket> ticket_;
};

class BackupService final : public v1::BackupService::CallbackService {
 public:
  explicit BackupService(const ServiceContext& context) : context_(context) {}

  grpc::ServerWriteReactor<v1::DownloadBackupResponse>* DownloadBackup(
      grpc::CallbackServerContext* call, const v1::DownloadBackupRequest*) override {
    return new BackupCall(context_, *call);
  }

 private:
  const ServiceContext context_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeBackupService(const ServiceContext& context) {
  return std::make_unique<BackupService>(context);
}

}  // namespace polyest::internal
