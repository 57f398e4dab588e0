#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <prometheus/check_names.h>
#include <prometheus/collectable.h>
#include <prometheus/metric_family.h>

#include <set>

#include "server/telemetry/library_log.h"
#include "server/telemetry/metrics.h"
#include "server/telemetry/request_id.h"
#include "server/telemetry/structured_log.h"

namespace polyest::internal {
namespace {

using ::testing::EndsWith;

TEST(RequestIdTest, IsAShortWord) {
  EXPECT_TRUE(IsRequestId("campaign-7.run_3"));
  EXPECT_TRUE(IsRequestId(std::string(64, 'a')));
  EXPECT_FALSE(IsRequestId(""));
  EXPECT_FALSE(IsRequestId(std::string(65, 'a')));
  for (const char* bad : {"a b", "a\n", "a\"", "a/b", "\xc3\xa9"}) {
    EXPECT_FALSE(IsRequestId(bad)) << bad;
  }
}

TEST(RequestIdTest, IsNeverMadeTwice) {
  std::set<std::string> ids;
  for (int i = 0; i < 1000; ++i) {
    const std::string id = MakeRequestId();
    EXPECT_TRUE(IsRequestId(id)) << id;
    EXPECT_TRUE(ids.insert(id).second) << id;
  }
}

TEST(StructuredLogTest, QuotesInTextWhatIsNotOnePlainWord) {
  EXPECT_EQ(FieldsAsText({{"code", "OK"}, {"session", "sessions/rig"}}),
            " code=OK session=sessions/rig");
  EXPECT_EQ(FieldsAsText({{"a", "two words"}, {"b", "x=1"}, {"c", "\n\"\\"}}),
            R"( a="two words" b="x=1" c="\n\"\\")");
}

TEST(StructuredLogTest, LeavesOutFieldsWithoutAValue) {
  EXPECT_EQ(FieldsAsText({{"tenant", ""}, {"code", "OK"}}), " code=OK");
  EXPECT_EQ(FieldsAsJson({{"tenant", ""}, {"code", "OK"}}), R"(,"code":"OK")");
}

TEST(StructuredLogTest, ShortensWhatIsLong) {
  EXPECT_EQ(FieldsAsText({{"a", std::string(1000, 'x')}}), " a=" + std::string(200, 'x') + "...");
  const std::string cars = "1234" + std::string("🚗") + std::string(300, 'x');
  EXPECT_EQ(FieldsAsJson({{"a", std::string(194, 'x') + cars}}),
            ",\"a\":\"" + std::string(194, 'x') + "1234...\"");
}

TEST(StructuredLogTest, WritesJsonThatReadsBackWhateverTheText) {
  for (int byte = 0; byte < 256; ++byte) {
    const std::string text = "a" + std::string(1, static_cast<char>(byte)) + "\xc3\xa9";
    google::protobuf::Value read;
    const std::string json = JsonString(text);
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(json, &read).ok()) << json;
    if (byte < 0x80) {
      EXPECT_EQ(read.string_value(), text) << json;
    } else {
      EXPECT_THAT(read.string_value(), EndsWith("\xc3\xa9")) << json;
    }
  }
}

TEST(StructuredLogTest, ReplacesBytesThatAreNoUtf8) {
  EXPECT_EQ(JsonString("a\xff"
                       "b"),
            "\"a?b\"");
  EXPECT_EQ(JsonString("a\xe2\x82"), "\"a??\"");
}

TEST(GrpcLogTest, FindsWhyAHandshakeFailed) {
  EXPECT_EQ(FailedHandshake("Handshaking failed: UNKNOWN:Tls handshake failed: SSL_ERROR_SSL: "
                            "error:0A00010B:SSL routines::wrong version number {file:\"./src\"}"),
            "UNKNOWN:Tls handshake failed: SSL_ERROR_SSL: error:0A00010B:SSL routines::wrong "
            "version number");
  EXPECT_EQ(FailedHandshake("Using polling engine: epoll1"), "");
}

// Returns what a scrape shows of a family: the sum over its series, or a histogram's count.
double Total(const Metrics& metrics, const std::string& name) {
  for (const auto& family : metrics.collectable()->Collect()) {
    if (family.name != name) continue;
    double total = 0;
    for (const auto& metric : family.metric) {
      total += metric.counter.value + static_cast<double>(metric.histogram.sample_count);
    }
    return total;
  }
  return -1;
}

TEST(MetricsTest, HaveNamesHelpAndUnitsAsPrometheusWantsThem) {
  const Metrics metrics("1.2.3");
  for (const auto& family : metrics.collectable()->Collect()) {
    EXPECT_TRUE(prometheus::CheckMetricName(family.name)) << family.name;
    EXPECT_THAT(family.name, ::testing::StartsWith("polyest_"));
    EXPECT_FALSE(family.help.empty()) << family.name;
    if (family.type == prometheus::MetricType::Counter) {
      EXPECT_THAT(family.name, EndsWith("_total"));
    }
  }
}

TEST(MetricsTest, CountABatchThatIsKept) {
  Metrics metrics("1.2.3");
  metrics.Count(Metrics::Batch{.rows = 10, .values = 18, .measured_s = 0.5});
  metrics.Count(Metrics::Batch{.rows = 5, .values = 9, .measured_s = 0.25});
  EXPECT_EQ(Total(metrics, "polyest_batches_acknowledged_total"), 2);
  EXPECT_EQ(Total(metrics, "polyest_rows_acknowledged_total"), 15);
  EXPECT_EQ(Total(metrics, "polyest_values_acknowledged_total"), 27);
  EXPECT_EQ(Total(metrics, "polyest_measured_seconds_total"), 0.75);
  EXPECT_EQ(Total(metrics, "polyest_acknowledgement_duration_seconds"), 2);
}

TEST(MetricsTest, TimeUnaryCallsOnly) {
  Metrics metrics("1.2.3");
  metrics.Count(Metrics::Call{"GetEstimate", "OK", true, 0.1});
  metrics.Count(Metrics::Call{"StreamMeasurements", "UNAVAILABLE", false, 86'400});
  EXPECT_EQ(Total(metrics, "polyest_calls_total"), 2);
  EXPECT_EQ(Total(metrics, "polyest_call_duration_seconds"), 1);
  EXPECT_EQ(Total(metrics, "polyest_refusals_total"), 1);
}

TEST(MetricsTest, CountCommitsAndThoseThatFailed) {
  Metrics metrics("1.2.3");
  metrics.Count(Metrics::Commit{.writes = 3, .failed = false, .duration_s = 0.001});
  metrics.Count(Metrics::Commit{.writes = 1, .failed = true, .duration_s = 0.001});
  EXPECT_EQ(Total(metrics, "polyest_journal_commit_duration_seconds"), 2);
  EXPECT_EQ(Total(metrics, "polyest_journal_commit_writes"), 2);
  EXPECT_EQ(Total(metrics, "polyest_journal_commit_failures_total"), 1);
}

}  // namespace
}  // namespace polyest::internal
