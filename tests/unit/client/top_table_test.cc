#include "client/cli/top_table.h"

#include <absl/strings/str_split.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/screen.h"

namespace polyest::internal::top_table_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string Print(const DaemonView& now, const DaemonView* before = nullptr) {
  std::ostringstream out;
  PrintTop(now, before, /*fit_rows=*/false, out);
  return out.str();
}

// Returns the lines that a screen of that size shows.
std::vector<std::string> PrintOn(int columns, int rows, const DaemonView& now) {
  std::stringstream out;
  SetScreen(out, {.columns = columns, .rows = rows, .color = false});
  PrintTop(now, nullptr, /*fit_rows=*/true, out);
  std::vector<std::string> lines;
  for (std::string line; std::getline(out, line);) lines.push_back(line);
  return lines;
}

DaemonView ViewOf(int64_t samples, double time_s) {
  DaemonView view;
  view.time_s = time_s;
  v1::Session session;
  session.set_name("sessions/rig");
  session.set_sample_count(samples);
  session.mutable_activity()->set_batch_count(7);
  view.sessions.push_back(session);
  return view;
}

// Returns the words of the last line.
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
  view.status.set_uptime_s(7200);
  view.status.set_memory_bytes(3 << 20);
  view.status.set_stored_bytes(5 << 20);
  view.status.set_session_count(5);
  view.status.set_loaded_session_count(1);
  auto& activity = *view.sessions[0].mutable_activity();
  activity.set_estimate_count(6);
  activity.set_reexpansion_count(2);
  activity.set_real_time_factor(12.5);
  activity.set_unprocessed_batch_count(4);
  activity.set_has_writer(true);
  activity.set_watcher_count(3);
  activity.set_loaded(true);
  activity.set_idle_time_s(90);
  const std::string text = Print(view);
  EXPECT_THAT(
      text, HasSubstr("polyestd 1.2.3, up 2.0 h, 3.0 MiB of memory, sessions on disk: 5.0 MiB\n"));
  EXPECT_THAT(text, HasSubstr("5 sessions, 1 loaded, 0 writers"));
  EXPECT_EQ(LastRow(text), (std::vector<std::string>{"rig", "7", "1200", "-", "6", "2", "12.5", "4",
                                                     "yes", "3", "yes", "2", "min"}));
}

// A terminal of 80 columns must show the header of a large daemon too.
TEST(TopTableTest, KeepsTheHeaderWithinEightyColumns) {
  DaemonView view = ViewOf(0, 0);
  view.status.set_version("10.10.10");
  view.status.set_durable(true);
  view.status.set_uptime_s(23.5 * 3600);
  view.status.set_memory_bytes((int64_t{1023} << 20) + 900'000);
  view.status.set_stored_bytes((int64_t{1023} << 30) + 900'000'000);
  view.status.set_session_count(9999);
  view.status.set_loaded_session_count(9999);
  view.status.set_writer_count(9999);
  view.status.set_watcher_count(9999);
  view.status.set_waiting_task_count(9999);
  const std::vector<std::string> lines = absl::StrSplit(Print(view), '\n');
  EXPECT_LE(lines[0].size(), 80u) << lines[0];
  EXPECT_LE(lines[1].size(), 80u) << lines[1];
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

TEST(TopTableTest, LeavesOutColumnsThatDoNotFitTheScreen) {
  DaemonView view = ViewOf(123'456'789, 0);
  view.sessions[0].set_name("sessions/" + std::string(60, 'r'));
  view.sessions[0].mutable_activity()->set_idle_time_s(90);
  for (const int columns : {40, 80, 100}) {
    const std::vector<std::string> lines = PrintOn(columns, 24, view);
    for (const std::string& line : lines) {
      if (&line - lines.data() < 2) continue;  // These lines are about the daemon itself.
      EXPECT_LE(DisplayWidth(line), columns) << line;
    }
    EXPECT_THAT(lines[3], HasSubstr("session"));
    EXPECT_THAT(lines[4], HasSubstr("rrr…"));
  }
  EXPECT_THAT(PrintOn(80, 24, view)[3], HasSubstr("real-time"));
  EXPECT_THAT(PrintOn(80, 24, view)[3], Not(HasSubstr("re-expansions")));
  EXPECT_THAT(PrintOn(200, 24, view)[3], HasSubstr("re-expansions"));
}

TEST(TopTableTest, CountsTheSessionsThatTheScreenHasNoRoomFor) {
  DaemonView view = ViewOf(1, 0);
  for (int i = 0; i < 29; ++i) view.sessions.push_back(view.sessions[0]);
  const std::vector<std::string> lines = PrintOn(80, 24, view);
  EXPECT_EQ(lines.size(), 24u);
  EXPECT_EQ(lines[22], "… and 12 more");
  EXPECT_EQ(lines[23], "press q to quit");
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
}  // namespace polyest::internal::top_table_test
