#pragma once

// What a journal that daemons share can do besides, as far as sessions need it. A test overrides
// what it is about.

#include <optional>
#include <string>
#include <vector>

#include "server/journal/session_journal.h"

namespace polyest::internal {

class FakeSharedJournal : public SharedJournal {
 public:
  absl::StatusOr<SessionPlace> Claim(int64_t) override { return SessionPlace(); }
  void Release(int64_t) override {}
  bool Owns(int64_t) const override { return true; }
  absl::StatusOr<std::optional<SessionHead>> HeadOf(const std::string&,
                                                    const std::string&) const override {
    return std::nullopt;
  }
  absl::StatusOr<std::vector<SessionHead>> HeadsAfter(const std::string&, const std::string&,
                                                      int64_t) const override {
    return std::vector<SessionHead>();
  }
  int64_t node() const override { return 1; }
  absl::StatusOr<std::vector<JournalNode>> Nodes() const override {
    return std::vector<JournalNode>();
  }
  absl::Status DrainNode(int64_t) override { return absl::OkStatus(); }
  void StartDraining() override {}
  bool AwaitDraining(std::stop_token) override { return false; }
};

}  // namespace polyest::internal
