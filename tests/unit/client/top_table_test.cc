#include "client/cli/top_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace polyest {
namespace {

using ::testing::HasSubstr;

std::string Print(const DaemonView& now, const DaemonView* before = nullptr) {
  std::ostringstream out;
  PrintTop(now, before, out);
  return out.str();
}

DaemonView ViewOf(int64_t samples, double time_s) {
  DaemonView view;
  view.time_s = time_s;
  v1::Session session;
  session.set_name("sessions/rig");
  session.set_samples(samples);
  session.mutable_activity()->set_batches(7);
  view.sessions.push_back(session);
  return view;
}

// The words of the last line.
std::vector<std::string> LastRow(const std::string& text) {
  std::istringstream lines(text);
  std::string last;
  for (std::string line; std::getline(lines, line);) last = line;
  std::istringstream words(last);
  return {std::istream_iterator<std::string>(words), {}};
}

TEST(TopTableTest, ShowsTheDaemonAndASession) {
  DaemonView view = ViewOf(1200, 0);
  view.status.set_version("1.2.3");
  view.status.set_durable(true);
  view.status.set_uptime(7200);
  view.status.set_memory_bytes(3 << 20);
  view.status.set_sessions(5);
  view.status.set_sessions_loaded(1);
  auto& activity = *view.sessions[0].mutable_activity();
  activity.set_estimates(6);
  activity.set_reexpansions(2);
  activity.set_real_time_factor(12.5);
  activity.set_unprocessed_batches(4);
  activity.set_has_writer(true);
  activity.set_watchers(3);
  activity.set_loaded(true);
  activity.set_idle_time(90);
  const std::string text = Print(view);
  EXPECT_THAT(text, HasSubstr("polyestd 1.2.3, up 2.0 h, 3.0 MiB, sessions on disk\n"));
  EXPECT_THAT(text, HasSubstr("5 sessions, 1 of them loaded; 0 writers"));
  EXPECT_EQ(LastRow(text), (std::vector<std::string>{"rig", "7", "1200", "-", "6", "2", "12.5", "4",
                                                     "yes", "3", "yes", "2", "min"}));
}

TEST(TopTableTest, SaysNothingWhereNothingIsKnown) {
  EXPECT_EQ(LastRow(Print(ViewOf(0, 0))),
            (std::vector<std::string>{"rig", "7", "0", "-", "0", "0", "-", "-", "-", "0", "-", "0",
                                      "s"}));
}

TEST(TopTableTest, DerivesTheRateFromAnEarlierLook) {
  const DaemonView before = ViewOf(1000, 10);
  EXPECT_EQ(LastRow(Print(ViewOf(1500, 12), &before))[3], "250");
  EXPECT_EQ(LastRow(Print(ViewOf(1000, 12), &before))[3], "0");
}

TEST(TopTableTest, TakesASessionWithFewerSamplesForAnotherOne) {
  const DaemonView before = ViewOf(1000, 10);
  EXPECT_EQ(LastRow(Print(ViewOf(10, 12), &before))[3], "-");
}

TEST(TopTableTest, HasUnitsThatFitTheSize) {
  EXPECT_EQ(FormatDuration(0.4), "0 s");
  EXPECT_EQ(FormatDuration(59.4), "59 s");
  EXPECT_EQ(FormatDuration(60), "1 min");
  EXPECT_EQ(FormatDuration(5400), "1.5 h");
  EXPECT_EQ(FormatDuration(129'600), "1.5 d");
  EXPECT_EQ(FormatBytes(1023), "1023 B");
  EXPECT_EQ(FormatBytes(1536), "1.5 KiB");
  EXPECT_EQ(FormatBytes(int64_t{2} << 30), "2.0 GiB");
}

}  // namespace
}  // namespace polyest
