#pragma once

// What is counted for Prometheus: one function for each kind of event. None of them waits; no label
// grows with sessions, tenants or clients.

#include <cstdint>
#include <memory>
#include <string>

namespace prometheus {
class Collectable;
class Registry;
}  // namespace prometheus

namespace polyest::internal {

// From any thread.
class Metrics {
 public:
  explicit Metrics(const std::string& version);
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  struct Call {
    std::string method;  // of the service's own: "GetEstimate"
    std::string code;    // "OK", "NOT_FOUND" …
    bool unary = true;   // of streams the duration says nothing
    double duration_s = 0;
  };
  void Count(const Call& call);

  // A batch that is kept.
  struct Batch {
    int64_t rows = 0;
    int64_t values = 0;            // of measured outputs
    double measured_s = 0;         // by the rig's time
    double acknowledgement_s = 0;  // from its arrival at the session until it was kept
  };
  void Count(const Batch& batch);

  struct NewEstimate {
    double duration_s = 0;
    int64_t reexpansions = 0;  // since the one before
  };
  void Count(const NewEstimate& estimate);

  // Numerics of a session, of whatever kind.
  void CountComputing(double duration_s);

  struct Commit {
    int64_t writes = 0;
    bool failed = false;
    double duration_s = 0;
  };
  void Count(const Commit& commit);

  // What is scraped.
  std::shared_ptr<prometheus::Collectable> collectable() const;

 private:
  struct Families;

  std::shared_ptr<prometheus::Registry> registry_;
  std::unique_ptr<Families> families_;
};

}  // namespace polyest::internal
