#pragma once

// Counts events for Prometheus, with one function for each kind of event. None of them waits; no
// label grows with sessions, tenants or clients.

#include <cstdint>
#include <memory>
#include <string>

namespace prometheus {
class Collectable;
class Registry;
}  // namespace prometheus

namespace polyest::internal {

// Thread-safe.
class Metrics {
 public:
  explicit Metrics(const std::string& version);
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // A call that has ended.
  struct Call {
    std::string method;  // without its service: "GetEstimate"
    std::string code;    // "OK", "NOT_FOUND" …
    bool unary = true;   // false: a stream, of which the duration says nothing
    double duration_s = 0;
  };
  void Count(const Call& call);

  // A batch that is kept.
  struct Batch {
    int64_t rows = 0;
    int64_t values = 0;            // of measured outputs
    double measured_s = 0;         // seconds of measurements, by the rig's time
    double acknowledgement_s = 0;  // from its arrival at the session until it was kept
  };
  void Count(const Batch& batch);

  // An estimate that was made for a session.
  struct NewEstimate {
    double duration_s = 0;
    int64_t reexpansions = 0;  // re-expansions since the estimate before
  };
  void Count(const NewEstimate& estimate);

  // Counts the time of a session's numerics, of whatever kind.
  void CountComputing(double duration_s);

  // A commit of the journal.
  struct Commit {
    int64_t writes = 0;
    bool failed = false;
    double duration_s = 0;
  };
  void Count(const Commit& commit);

  // Counts an answer of the HTTP port, of whatever kind, by its status.
  void CountWebRequest(int status);

  // Returns what Prometheus scrapes.
  std::shared_ptr<prometheus::Collectable> collectable() const;

 private:
  struct Families;

  std::shared_ptr<prometheus::Registry> registry_;
  std::unique_ptr<Families> families_;
};

}  // namespace polyest::internal
