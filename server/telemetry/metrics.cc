#include "server/telemetry/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <algorithm>

namespace polyest::internal {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Histogram;
using prometheus::Registry;

// Upper ends of the buckets of durations: 100 µs … 100 s.
const Histogram::BucketBoundaries kSeconds = {1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3,
                                              0.01, 0.025,  0.05, 0.1,  0.25,   0.5,
                                              1,    2.5,    5,    10,   30,     100};
const Histogram::BucketBoundaries kWrites = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512};

// These codes say that the daemon would not serve a call, not that the request was wrong.
constexpr const char* kRefusals[] = {"PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "UNAUTHENTICATED",
                                     "UNAVAILABLE"};

Family<Counter>& MakeCounter(Registry& registry, const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}

Family<Histogram>& MakeHistogram(Registry& registry, const char* name, const char* help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
}

// Increments a counter. Prometheus' counters cannot go down, nor may they be asked to.
void Increment(Counter& counter, double by) { counter.Increment(std::max(0.0, by)); }

}  // namespace

struct Metrics::Families {
  explicit Families(Registry& registry);

  Family<Counter>& calls;
  Family<Histogram>& call_duration;
  Family<Counter>& refusals;
  Counter& batches;
  Counter& rows;
  Counter& values;
  Counter& measured;
  Histogram& acknowledgement;
  Histogram& estimate;
  Counter& reexpansions;
  Counter& computed;
  Histogram& commit;
  Histogram& commit_writes;
  Counter& commit_failures;
  Family<Counter>& web_requests;
};

Metrics::Families::Families(Registry& registry)
    : calls(MakeCounter(registry, "polyest_calls_total", "Calls ended, by method and code.")),
      call_duration(MakeHistogram(registry, "polyest_call_duration_seconds",
                                  "From the arrival of a unary call to its answer.")),
      refusals(MakeCounter(registry, "polyest_refusals_total",
                           "Calls that the daemon would not serve, by code.")),
      batches(MakeCounter(registry, "polyest_batches_acknowledged_total",
                          "Batches kept, those sent again not among them.")
                  .Add({})),
      rows(MakeCounter(registry, "polyest_rows_acknowledged_total", "Rows of batches kept.")
               .Add({})),
      values(MakeCounter(registry, "polyest_values_acknowledged_total",
                         "Values of measured outputs in batches kept.")
                 .Add({})),
      measured(MakeCounter(registry, "polyest_measured_seconds_total",
                           "Seconds of measurements kept, by the rigs' time. Its rate over that "
                           "of polyest_computed_seconds_total is the real-time factor of all "
                           "sessions.")
                   .Add({})),
      acknowledgement(MakeHistogram(registry, "polyest_acknowledgement_duration_seconds",
                                    "From a batch's arrival at its session until it is kept.")
                          .Add({}, kSeconds)),
      estimate(MakeHistogram(registry, "polyest_estimate_duration_seconds",
                             "Time spent on each estimate made for a session.")
                   .Add({}, kSeconds)),
      reexpansions(MakeCounter(registry, "polyest_reexpansions_total",
                               "Re-expansions around a better place, as estimates report them.")
                       .Add({})),
      computed(MakeCounter(registry, "polyest_computed_seconds_total",
                           "Seconds computed for sessions, over all threads.")
                   .Add({})),
      commit(MakeHistogram(registry, "polyest_journal_commit_duration_seconds",
                           "Time of each commit of the journal, the wait for the disk in it.")
                 .Add({}, kSeconds)),
      commit_writes(MakeHistogram(registry, "polyest_journal_commit_writes",
                                  "Batches, and other writes, that a commit served.")
                        .Add({}, kWrites)),
      commit_failures(MakeCounter(registry, "polyest_journal_commit_failures_total",
                                  "Commits of the journal that failed.")
                          .Add({})),
      web_requests(MakeCounter(registry, "polyest_web_requests_total",
                               "Requests answered by the HTTP port, by status.")) {
  // The series exist from the start, because a rate over a series that begins with its first
  // refusal would miss that one.
  for (const char* code : kRefusals) refusals.Add({{"code", code}});
}

Metrics::Metrics(const std::string& version)
    : registry_(std::make_shared<Registry>()), families_(std::make_unique<Families>(*registry_)) {
  prometheus::BuildGauge()
      .Name("polyest_build_info")
      .Help("Always 1; the label says which version runs.")
      .Register(*registry_)
      .Add({{"version", version}})
      .Set(1);
}

Metrics::~Metrics() = default;

void Metrics::CountWebRequest(int status) {
  Increment(families_->web_requests.Add({{"code", std::to_string(status)}}), 1);
}

std::shared_ptr<prometheus::Collectable> Metrics::collectable() const { return registry_; }

void Metrics::Count(const Call& call) {
  Increment(families_->calls.Add({{"method", call.method}, {"code", call.code}}), 1);
  if (call.unary) {
    families_->call_duration.Add({{"method", call.method}}, kSeconds).Observe(call.duration_s);
  }
  if (std::find(std::begin(kRefusals), std::end(kRefusals), call.code) != std::end(kRefusals)) {
    Increment(families_->refusals.Add({{"code", call.code}}), 1);
  }
}

void Metrics::Count(const Batch& batch) {
  Increment(families_->batches, 1);
  Increment(families_->rows, static_cast<double>(batch.rows));
  Increment(families_->values, static_cast<double>(batch.values));
  Increment(families_->measured, batch.measured_s);
  families_->acknowledgement.Observe(batch.acknowledgement_s);
}

void Metrics::Count(const NewEstimate& estimate) {
  families_->estimate.Observe(estimate.duration_s);
  Increment(families_->reexpansions, static_cast<double>(estimate.reexpansions));
}

void Metrics::CountComputing(double duration_s) { Increment(families_->computed, duration_s); }

void Metrics::Count(const Commit& commit) {
  families_->commit.Observe(commit.duration_s);
  families_->commit_writes.Observe(static_cast<double>(commit.writes));
  if (commit.failed) Increment(families_->commit_failures, 1);
}

}  // namespace polyest::internal
