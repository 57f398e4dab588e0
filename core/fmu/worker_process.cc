#include "core/fmu/worker_process.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <thread>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/external/clean_text.h"
#include "core/fmu/messages.h"

namespace polyest::internal {
namespace {

constexpr char kProgram[] = "polyest-fmu-worker";

// Time that a worker may take to its end once it has closed its socket.
constexpr std::chrono::milliseconds kLongestEnd{1'000};
constexpr std::chrono::milliseconds kEndPause{1};

absl::Status SystemError(const char* what) {
  return absl::UnavailableError(
      absl::StrCat("a worker process cannot be started: ", what, ": ", std::strerror(errno)));
}

// Moves the descriptor above the numbers that a worker's descriptors get, so that none overwrites
// another.
int MoveUp(int descriptor) {
  const int moved = fcntl(descriptor, F_DUPFD_CLOEXEC, kWorkerPage + 1);
  close(descriptor);
  return moved;
}

// Gives the worker these two descriptors, and /dev/null for its standard streams.
void DescribeFiles(int socket, int page, posix_spawn_file_actions_t& actions) {
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&actions, standard, "/dev/null", O_RDWR, 0);
  }
  posix_spawn_file_actions_adddup2(&actions, socket, kWorkerSocket);
  posix_spawn_file_actions_adddup2(&actions, page, kWorkerPage);
  posix_spawn_file_actions_addclosefrom_np(&actions, kWorkerPage + 1);
}

// Puts the worker into its own process group, so Ctrl-C reaches only this process, with no signal
// blocked or ignored.
void DescribeSignals(posix_spawnattr_t& attributes) {
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
}

// Reaps the process as wait4 does, whatever signals this process gets meanwhile.
pid_t Reap(pid_t pid, int flags, int& status, rusage& usage) {
  pid_t reaped = -1;
  do {
    reaped = wait4(pid, &status, flags, &usage);
  } while (reaped < 0 && errno == EINTR);
  return reaped;
}

// Whether something else has stopped the process: the kernel for lack of memory, or the operator.
// An FMU that fails causes other signals.
bool IsStopped(int status) {
  return WIFSIGNALED(status) && (WTERMSIG(status) == SIGKILL || WTERMSIG(status) == SIGTERM);
}

bool IsProgram(const std::filesystem::path& path) { return access(path.c_str(), X_OK) == 0; }

}  // namespace

absl::StatusOr<std::filesystem::path> FindWorkerProgram() {
  if (const char* const named = std::getenv("POLYEST_FMU_WORKER")) {
    if (IsProgram(named)) return named;
    return absl::UnavailableError(
        absl::StrFormat("POLYEST_FMU_WORKER: \"%s\" is not a program that can be run", named));
  }
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path folder = self.parent_path();
  for (const std::filesystem::path& candidate :
       {folder / kProgram, folder / "../libexec/polyest" / kProgram}) {
    if (IsProgram(candidate)) return candidate.lexically_normal();
  }
  return absl::UnavailableError(absl::StrFormat(
      "%s, which runs FMUs, is neither in %s nor in its ../libexec/polyest; POLYEST_FMU_WORKER may "
      "name it",
      kProgram, folder.string()));
}

absl::StatusOr<std::unique_ptr<WorkerProcess>> WorkerProcess::Start(std::string fmu,
                                                                    const WorkerLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(const std::filesystem::path program, FindWorkerProgram());
  std::unique_ptr<WorkerProcess> worker(new WorkerProcess(std::move(fmu), limits));
  POLYEST_RETURN_IF_ERROR(worker->MakePage());
  POLYEST_RETURN_IF_ERROR(worker->Spawn(program));
  return worker;
}

WorkerProcess::~WorkerProcess() {
  Kill();
  if (page_ != nullptr) munmap(page_, sizeof(StatusPage));
  if (page_descriptor_ >= 0) close(page_descriptor_);
}

absl::Status WorkerProcess::MakePage() {
  const int descriptor = memfd_create(kProgram, MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (descriptor < 0) return SystemError("memfd_create");
  page_descriptor_ = MoveUp(descriptor);
  if (page_descriptor_ < 0 || ftruncate(page_descriptor_, sizeof(StatusPage)) != 0) {
    return SystemError("its status page");
  }
  // The seals prevent a worker from shrinking the page, which would crash every process that reads
  // it.
  fcntl(page_descriptor_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL);
  void* const memory =
      mmap(nullptr, sizeof(StatusPage), PROT_READ | PROT_WRITE, MAP_SHARED, page_descriptor_, 0);
  if (memory == MAP_FAILED) return SystemError("mmap");
  page_ = new (memory) StatusPage{};
  return absl::OkStatus();
}

absl::Status WorkerProcess::Spawn(const std::filesystem::path& program) {
  std::array<int, 2> pair;
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0) {
    return SystemError("socketpair");
  }
  socket_ = pair[0];
  const int worker_socket = MoveUp(pair[1]);
  const absl::Cleanup close_socket = [worker_socket] { close(worker_socket); };
  if (worker_socket < 0 || fcntl(socket_, F_SETFL, O_NONBLOCK) != 0) return SystemError("fcntl");

  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  const absl::Cleanup destroy = [&] {
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  };
  DescribeFiles(worker_socket, page_descriptor_, actions);
  DescribeSignals(attributes);
  std::string path = program.string();
  std::string memory = absl::StrCat(limits_.max_memory_bytes);
  std::string file = absl::StrCat(limits_.largest_file_bytes);
  const std::array<char*, 4> arguments = {path.data(), memory.data(), file.data(), nullptr};
  pid_t pid = -1;
  errno = posix_spawn(&pid, path.c_str(), &actions, &attributes, arguments.data(), environ);
  if (errno != 0) return SystemError(path.c_str());
  pid_ = pid;
  return absl::OkStatus();
}

void WorkerProcess::Send(const std::string& message) {
  const auto size = static_cast<uint64_t>(message.size());
  if (!has_to_send()) {
    outgoing_.clear();
    sent_ = 0;
  }
  outgoing_.append(reinterpret_cast<const char*>(&size), sizeof(size));
  outgoing_.append(message);
}

void WorkerProcess::AwaitAnswer() {
  POLYEST_CHECK(!awaits_answer_);
  awaits_answer_ = true;
  incoming_.clear();
  progress_seen_ = std::chrono::steady_clock::now();
}

absl::Status WorkerProcess::Exchange() {
  if (pid_ < 0)
    return absl::FailedPreconditionError(absl::StrCat("fmu ", fmu_, ": its worker is dead"));
  POLYEST_RETURN_IF_ERROR(SendSome());
  POLYEST_RETURN_IF_ERROR(ReceiveSome());
  return awaits_answer_ ? CheckProgress() : absl::OkStatus();
}

absl::Status WorkerProcess::SendSome() {
  while (has_to_send()) {
    const ssize_t size =
        send(socket_, outgoing_.data() + sent_, outgoing_.size() - sent_, MSG_NOSIGNAL);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno == EAGAIN) return absl::OkStatus();
    if (size < 0) return Died();
    sent_ += static_cast<size_t>(size);
  }
  return absl::OkStatus();
}

absl::Status WorkerProcess::ReceiveSome() {
  while (awaits_answer_) {
    uint64_t length = 0;
    size_t wanted = sizeof(length);
    if (incoming_.size() >= sizeof(length)) {
      std::memcpy(&length, incoming_.data(), sizeof(length));
      wanted += length;
    }
    if (length > kLongestMessage) return Died();
    if (incoming_.size() == wanted && incoming_.size() > sizeof(length)) {
      answer_ = incoming_.substr(sizeof(length));
      awaits_answer_ = false;
      return absl::OkStatus();
    }
    std::array<char, 65536> piece;
    const ssize_t size =
        recv(socket_, piece.data(), std::min(piece.size(), wanted - incoming_.size()), 0);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno == EAGAIN) return absl::OkStatus();
    if (size <= 0) return Died();
    incoming_.append(piece.data(), static_cast<size_t>(size));
    progress_seen_ = std::chrono::steady_clock::now();
  }
  return absl::OkStatus();
}

absl::Status WorkerProcess::CheckProgress() {
  const auto now = std::chrono::steady_clock::now();
  const uint64_t calls = page_->calls.load(std::memory_order_relaxed);
  if (calls != calls_seen_) {
    calls_seen_ = calls;
    progress_seen_ = now;
  }
  if (now - progress_seen_ <= limits_.longest_call) return absl::OkStatus();
  const std::string did = WhatItDid();
  Kill();
  return absl::FailedPreconditionError(
      absl::StrFormat("fmu %s: the worker was stopped because one call took longer than %g s %s",
                      fmu_, 1e-3 * static_cast<double>(limits_.longest_call.count()), did));
}

std::string WorkerProcess::WhatItDid() const {
  const std::array<char, 512> raw = page_->message;
  const std::string message = CleanText(std::string(raw.data(), strnlen(raw.data(), raw.size())));
  return absl::StrFormat("while %s at t = %g s%s", InWords(page_->call.load()),
                         page_->time_s.load(),
                         message.empty() ? "" : absl::StrCat("; it last said: ", message));
}

absl::Status WorkerProcess::Died() {
  int status = 0;
  rusage usage{};
  // The socket closes just before the worker ends, which is told only when it has ended by itself.
  pid_t ended = 0;
  for (auto waited = kEndPause; ended == 0 && waited <= kLongestEnd; waited += kEndPause) {
    ended = Reap(pid_, WNOHANG, status, usage);
    if (ended == 0) std::this_thread::sleep_for(kEndPause);
  }
  std::string end = "ended";
  if (ended == 0) {
    end = "broke off and was stopped";
  } else if (ended > 0 && WIFSIGNALED(status)) {
    end = absl::StrFormat("was killed by signal %d (%s)", WTERMSIG(status),
                          strsignal(WTERMSIG(status)));
  } else if (ended > 0) {
    end = absl::StrFormat("ended with status %d", WEXITSTATUS(status));
  }
  if (ended != 0) pid_ = -1;
  Kill();
  // The kernel counts the memory that this process had when it started the worker as the worker's.
  rusage own{};
  getrusage(RUSAGE_SELF, &own);
  const int64_t used_bytes = usage.ru_maxrss > own.ru_maxrss ? int64_t{1024} * usage.ru_maxrss : 0;
  const std::string memory =
      used_bytes > limits_.max_memory_bytes / 4 * 3
          ? absl::StrFormat("; it had used %d MiB of memory and the limit is %d MiB",
                            used_bytes >> 20, limits_.max_memory_bytes >> 20)
          : "";
  const bool stopped = ended > 0 && IsStopped(status);
  return absl::Status(
      stopped ? absl::StatusCode::kUnavailable : absl::StatusCode::kFailedPrecondition,
      absl::StrFormat("fmu %s: the worker %s %s%s", fmu_, end, WhatItDid(), memory));
}

void WorkerProcess::Kill() {
  if (pid_ >= 0) {
    int status = 0;
    rusage usage{};
    kill(pid_, SIGKILL);
    Reap(pid_, 0, status, usage);
    pid_ = -1;
  }
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
}

}  // namespace polyest::internal
