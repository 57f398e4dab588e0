// Measures how fast journals keep batches: SQLite, PostgreSQL, and bare commits of the same bytes
// to the same PostgreSQL by the same group commit, one after another.
//
//   build/bench/bin/journal_benchmark URI [SESSIONS [BATCHES]]
//
// URI is that of an empty PostgreSQL database.

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/common/check.h"
#include "server/digest/digest.h"
#include "server/journal/postgres_journal.h"
#include "server/journal/sqlite_journal.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kRows = 100, kChannels = 4;

struct Size {
  int sessions = 100;
  int batches = 30;
};

// Returns a batch of incompressible values.
std::string Batch(int session, int sequence) {
  v1::Measurements rows;
  uint64_t state = 1 + static_cast<uint64_t>(session) * 1000 + static_cast<uint64_t>(sequence);
  for (int row = 0; row < kRows; ++row) rows.add_time_s(sequence + 0.01 * row);
  for (int channel = 0; channel < kChannels; ++channel) {
    for (int row = 0; row < kRows; ++row) {
      state = state * 6364136223846793005u + 1442695040888963407u;
      if (row == 0) rows.add_channels()->set_name(std::string(1, static_cast<char>('a' + channel)));
      rows.mutable_channels(channel)->add_values(static_cast<double>(state >> 11));
    }
  }
  return DeterministicBytes(rows);
}

// Calls `append(session, sequence, done)` for each batch and waits until all are done. Returns
// batches per second.
template <typename Append>
double Rate(const Size& size, Append append) {
  const int all = size.sessions * size.batches;
  std::promise<void> ended;
  std::atomic<int> left = all;
  const auto begin = Clock::now();
  for (int sequence = 1; sequence <= size.batches; ++sequence) {
    for (int session = 0; session < size.sessions; ++session) {
      append(session, sequence, [&](const absl::Status& kept) {
        POLYEST_CHECK(kept.ok());
        if (--left == 0) ended.set_value();
      });
    }
  }
  ended.get_future().wait();
  return all / std::chrono::duration<double>(Clock::now() - begin).count();
}

double RateOf(SessionJournal& journal, const Size& size) {
  std::vector<int64_t> numbers;
  for (int session = 0; session < size.sessions; ++session) {
    SessionHead head;
    head.name = "sessions/s" + std::to_string(session);
    numbers.push_back(journal.Create(head, v1::Problem(), /*hidden=*/false).value());
  }
  return Rate(size, [&](int session, int sequence, SessionJournal::Done done) {
    JournalEntry entry;
    entry.session = numbers[static_cast<size_t>(session)];
    entry.measurements = Batch(session, sequence);
    entry.digest = Digest(entry.measurements);
    entry.place.sequence = sequence;
    journal.Append(std::move(entry), std::move(done));
  });
}

double BareRate(const std::string& uri, const Size& size) {
  const PostgresTarget target = PostgresTarget::Parse(uri).value();
  POLYEST_CHECK((*PostgresConnection::Open(target))
                    ->Execute("CREATE TABLE polyest.bare (bytes bytea) WITH (toast_tuple_target = "
                              "8160); ALTER TABLE polyest.bare ALTER bytes SET STORAGE EXTERNAL")
                    .ok());
  CommitQueue<PostgresWriter> queue(std::make_unique<PostgresWriter>(target));
  return Rate(size, [&](int session, int sequence, SessionJournal::Done done) {
    std::string batch = Batch(session, sequence);
    const auto size_of_batch = static_cast<int64_t>(batch.size());
    auto write = [bytes = std::move(batch)](PostgresWriter& writer) {
      writer.Send("INSERT INTO bare VALUES ($1)", PostgresParameters().AddBytes(bytes));
      return absl::OkStatus();
    };
    queue.Submit(std::move(write), std::move(done), "", size_of_batch);
  });
}

void Run(const std::string& uri, const Size& size) {
  const TestFolder folder;
  const double sqlite = RateOf(**SqliteJournal::Open({.folder = folder / "sqlite"}), size);
  const double postgres = RateOf(**PostgresJournal::Open({.uri = uri}), size);
  const double bare = BareRate(uri, size);
  std::printf(
      "%d sessions, %d batches each of %zu bytes: SQLite %.0f batches/s; PostgreSQL %.0f "
      "batches/s, %.2f of SQLite; bare commits to PostgreSQL %.0f batches/s, ratio %.2f\n",
      size.sessions, size.batches, Batch(0, 1).size(), sqlite, postgres, postgres / sqlite, bare,
      postgres / bare);
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: journal_benchmark URI [SESSIONS [BATCHES]]\n");
    return 2;
  }
  polyest::internal::Size size;
  if (argc > 2) size.sessions = std::atoi(argv[2]);
  if (argc > 3) size.batches = std::atoi(argv[3]);
  polyest::internal::Run(argv[1], size);
}
