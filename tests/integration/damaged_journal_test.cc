// Tests that damage to the files of a journal is never served as an answer. Each seed damages a
// copy of a data folder at random and starts a daemon on it. The daemon may refuse to start and say
// why, or refuse a session with DATA_LOSS, or lack batches and name the session in its log; what it
// answers is the estimate of the batches that it has, to the last bit.

#include <signal.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "tests/integration/daemon_fixture.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

namespace fs = std::filesystem;

constexpr int kDamagedSessions = 3;
constexpr int kBatchesEach = 8;
constexpr int kRowsOfBatch = 40;

std::string DamagedName(int session) { return "sessions/rig-" + std::to_string(session); }

int Damages() {
  const char* const damages = std::getenv("POLYEST_TEST_DAMAGES");
  return damages == nullptr ? 20 : std::atoi(damages);
}

// Calls a daemon; a call that takes a minute fails.
class Caller {
 public:
  explicit Caller(const std::string& address)
      : stub_(v1::SessionService::NewStub(
            grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))) {}

  grpc::Status Create(const std::string& name) {
    v1::CreateSessionRequest request;
    request.set_session_id(name.substr(name.find('/') + 1));
    *request.mutable_session()->mutable_problem() = Oscillator();
    v1::Session session;
    return Call(&v1::SessionService::Stub::CreateSession, request, session);
  }
  grpc::Status Add(const std::string& name, int batch) {
    v1::AddMeasurementsRequest request;
    request.set_session(name);
    request.set_sequence(batch);
    *request.mutable_measurements() =
        OscillatorRows((batch - 1) * kRowsOfBatch, batch * kRowsOfBatch);
    v1::AddMeasurementsResponse response;
    return Call(&v1::SessionService::Stub::AddMeasurements, request, response);
  }
  grpc::Status GetEstimate(const std::string& name, v1::Estimate& estimate) {
    v1::GetEstimateRequest request;
    request.set_session(name);
    return Call(&v1::SessionService::Stub::GetEstimate, request, estimate);
  }

 private:
  template <class Method, class Request, class Response>
  grpc::Status Call(Method method, const Request& request, Response& response) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
    return (stub_.get()->*method)(&context, request, &response);
  }

  const std::unique_ptr<v1::SessionService::Stub> stub_;
};

// Changes a file at a random place: flips a bit, overwrites a block, or cuts the file off.
void Damage(const std::string& file, std::mt19937_64& random) {
  const auto size = static_cast<int64_t>(fs::file_size(file));
  if (size == 0) return;
  const auto place = std::uniform_int_distribution<int64_t>(0, size - 1)(random);
  const auto kind = std::uniform_int_distribution<int>(0, 3)(random);
  if (kind == 0) {
    fs::resize_file(file, static_cast<uintmax_t>(place));
    return;
  }
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  std::string bytes(kind == 1 ? 1 : std::min<int64_t>(512, size - place), '\0');
  stream.seekg(place).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (kind == 1) bytes[0] = static_cast<char>(bytes[0] ^ (1 << (place % 8)));
  for (char& byte : bytes) {
    if (kind == 2) byte = static_cast<char>(random());
    if (kind == 3) byte = 0;
  }
  stream.seekp(place).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

class DamagedFilesTest : public testing::Test {
 protected:
  // Stores sessions, half of them in the database's file and half in
  // its write-ahead log, and remembers the estimates after each batch.
  void SetUp() override {
    for (int half = 0; half < 2; ++half) {
      DaemonProcess daemon({"--listen", "127.0.0.1:0", "--data-dir", data_.path()});
      const std::string address = daemon.ReadAddress();
      ASSERT_FALSE(address.empty()) << daemon.Errors();
      Caller caller(address);
      for (int session = 0; session < kDamagedSessions; ++session) {
        if (half == 0) {
          ASSERT_TRUE(caller.Create(DamagedName(session)).ok());
        }
        for (int batch = 1; batch <= kBatchesEach / 2; ++batch) {
          const int sequence = half * kBatchesEach / 2 + batch;
          ASSERT_TRUE(caller.Add(DamagedName(session), sequence).ok());
          if (session == 0) Remember(caller, sequence);
        }
      }
      daemon.Signal(half == 0 ? SIGTERM : SIGKILL);
      daemon.Wait();
    }
  }
  void Remember(Caller& caller, int sequence) {
    v1::Estimate estimate;
    ASSERT_TRUE(caller.GetEstimate(DamagedName(0), estimate).ok());
    expected_[sequence] = WithoutSequence(estimate);
  }

  // Returns what is wrong with the answers about a session; empty: nothing.
  std::string WrongWith(Caller& caller, const std::string& name, const std::string& log) {
    v1::Estimate estimate;
    const grpc::Status status = caller.GetEstimate(name, estimate);
    const bool named = log.find(name) != std::string::npos;
    if (status.error_code() == grpc::StatusCode::DATA_LOSS) {
      ++noticed_;
      return "";
    }
    if (status.error_code() == grpc::StatusCode::NOT_FOUND) {
      ++noticed_;
      return named ? "" : "silently missing";
    }
    if (!status.ok()) return "refused with " + status.error_message();
    const int sequence = static_cast<int>(estimate.sequence());
    if (sequence < kBatchesEach && !named) return "silently shorter";
    noticed_ += sequence < kBatchesEach ? 1 : 0;
    if (sequence == 0) return "";
    if (WithoutSequence(estimate) != expected_[sequence]) return "a wrong estimate";
    ++served_;
    return "";
  }

  // Damages a copy and starts a daemon on it.
  void Try(uint64_t seed) {
    std::mt19937_64 random(seed);
    const TestFolder folder;
    const std::string copy = folder / "data";
    fs::copy(data_.path(), copy, fs::copy_options::recursive);
    fs::permissions(copy, fs::perms(0700));
    const char* const files[] = {"journal.db", "journal.db-wal", "seals"};
    const std::string file = files[seed % 3];
    const int places = std::uniform_int_distribution<int>(1, 8)(random);
    for (int i = 0; i < places; ++i) Damage(copy + "/" + file, random);
    DaemonProcess daemon({"--listen", "127.0.0.1:0", "--data-dir", copy});
    const std::string address = daemon.ReadAddress();
    if (address.empty()) {
      EXPECT_EQ(daemon.Wait(), 1) << "seed " << seed << ", " << file << "\n" << daemon.Errors();
      EXPECT_NE(daemon.Errors().find("journal"), std::string::npos) << daemon.Errors();
      ++noticed_;
      return;
    }
    Caller caller(address);
    const std::string log = daemon.Errors();
    for (int session = 0; session < kDamagedSessions; ++session) {
      EXPECT_EQ(WrongWith(caller, DamagedName(session), log), "")
          << "seed " << seed << ", " << file << ", " << DamagedName(session) << "\n"
          << log;
    }
  }

  const TestFolder data_;
  std::map<int, std::string> expected_;  // estimates, by the number of the last batch
  int served_ = 0;
  int noticed_ = 0;
};

TEST_F(DamagedFilesTest, AreNeverServedAsAWrongAnswer) {
  ASSERT_EQ(expected_.size(), size_t{kBatchesEach});
  for (uint64_t seed = 1; seed <= static_cast<uint64_t>(Damages()); ++seed) Try(seed);
  RecordProperty("served", served_);
  RecordProperty("noticed", noticed_);
  EXPECT_GT(served_, 0);
  EXPECT_GT(noticed_, 0);
}

}  // namespace
}  // namespace polyest::internal
