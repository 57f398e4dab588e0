// Measures how fast journals keep batches: SQLite, PostgreSQL, and bare commits to the same
// PostgreSQL by the same group commit, of the same bytes and of the same rows, one after another.
//
//   build/bench/bin/journal_benchmark URI [SESSIONS [BATCHES [ROWS]]]
//
// URI is that of an empty PostgreSQL database. A batch has so many ROWS of 4 channels, by default
// 100.

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

constexpr int kChannels = 4;

struct Size {
  int sessions = 100;
  int batches = 30;
  int rows = 100;  // of a batch
};

// Returns a batch of incompressible values.
std::string Batch(const Size& size, int session, int sequence) {
  v1::Measurements rows;
  uint64_t state = 1 + static_cast<uint64_t>(session) * 1000 + static_cast<uint64_t>(sequence);
  for (int row = 0; row < size.rows; ++row) rows.add_time_s(sequence + 0.01 * row);
  for (int channel = 0; channel < kChannels; ++channel) {
    for (int row = 0; row < size.rows; ++row) {
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
    entry.measurements = Batch(size, session, sequence);
    entry.digest = Digest(entry.measurements);
    entry.place.sequence = sequence;
    journal.Append(std::move(entry), std::move(done));
  });
}

// Commits to a table of `columns` by statements that `add` adds for each batch.
template <typename Add>
double BareRate(const std::string& uri, const Size& size, const std::string& columns, Add add) {
  const PostgresTarget target = PostgresTarget::Parse(uri).value();
  POLYEST_CHECK((*PostgresConnection::Open(target))
                    ->Execute("DROP TABLE IF EXISTS polyest.bare; CREATE TABLE polyest.bare (" +
                              columns +
                              ") WITH (toast_tuple_target = 8160); ALTER TABLE polyest.bare ALTER "
                              "bytes SET STORAGE EXTERNAL")
                    .ok());
  CommitQueue<PostgresWriter> queue(std::make_unique<PostgresWriter>(target));
  return Rate(size, [&](int session, int sequence, SessionJournal::Done done) {
    std::string batch = Batch(size, session, sequence);
    const auto size_of_batch = static_cast<int64_t>(batch.size());
    auto write = [add, session, sequence, bytes = std::move(batch)](PostgresWriter& writer) {
      add(writer, session, sequence, bytes);
      return absl::OkStatus();
    };
    queue.Submit(std::move(write), std::move(done), "", size_of_batch);
  });
}

// Bytes alone.
double BareRateOfBytes(const std::string& uri, const Size& size) {
  return BareRate(
      uri, size, "bytes bytea", [](PostgresWriter& writer, int, int, const std::string& bytes) {
        writer.Send("INSERT INTO bare VALUES ($1)", PostgresParameters().AddBytes(bytes));
      });
}

// The rows that the journal keeps, in their order, without a look at what is there.
double BareRateOfRows(const std::string& uri, const Size& size) {
  static const std::string digest(32, 'd');
  return BareRate(
      uri, size,
      "session bigint, sequence bigint, bytes bytea, digest bytea, a bigint, b bigint, c bigint, d "
      "double precision, e bigint, f bigint, PRIMARY KEY (session, sequence)",
      [](PostgresWriter& writer, int session, int sequence, const std::string& bytes) {
        writer.Send("INSERT INTO bare VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)",
                    PostgresParameters()
                        .Add(int64_t{session})
                        .Add(int64_t{sequence})
                        .AddBytes(bytes)
                        .AddBytes(digest)
                        .Add(int64_t{1})
                        .Add(int64_t{2})
                        .Add(int64_t{3})
                        .Add(4.0)
                        .Add(int64_t{5})
                        .Add(int64_t{6}));
      });
}

void Run(const std::string& uri, const Size& size) {
  const TestFolder folder;
  const double sqlite = RateOf(**SqliteJournal::Open({.folder = folder / "sqlite"}), size);
  const double postgres = RateOf(**PostgresJournal::Open({.uri = uri}), size);
  const double bytes = BareRateOfBytes(uri, size);
  const double rows = BareRateOfRows(uri, size);
  std::printf(
      "%d sessions, %d batches each of %zu bytes: SQLite %.0f batches/s; PostgreSQL %.0f "
      "batches/s, %.2f of SQLite; bare commits to PostgreSQL of the bytes %.0f batches/s, ratio "
      "%.2f, of rows as the journal's %.0f batches/s, ratio %.2f\n",
      size.sessions, size.batches, Batch(size, 0, 1).size(), sqlite, postgres, postgres / sqlite,
      bytes, postgres / bytes, rows, postgres / rows);
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  polyest::internal::Size size;
  if (argc > 2) size.sessions = std::atoi(argv[2]);
  if (argc > 3) size.batches = std::atoi(argv[3]);
  if (argc > 4) size.rows = std::atoi(argv[4]);
  if (argc < 2 || size.sessions < 1 || size.batches < 1 || size.rows < 1) {
    std::fprintf(stderr,
                 "usage: journal_benchmark URI [SESSIONS [BATCHES [ROWS]]], each at least 1\n");
    return 2;
  }
  polyest::internal::Run(argv[1], size);
}
