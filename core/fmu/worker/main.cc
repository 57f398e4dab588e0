// polyest-fmu-worker MEMORY_BYTES FILE_BYTES: simulates one FMU for the process that started it,
// over the socket and the status page that it inherits as descriptors 3 and 4. Not meant to be run
// by hand.

#include <absl/strings/numbers.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <variant>

#include "core/common/sanitizer.h"
#include "core/fmu/worker/simulation.h"
#include "core/fmu/worker_process.h"

#if POLYEST_ADDRESS_SANITIZER
// The sanitizer must not handle signals: the parent process recognizes a crash of the FMU by its
// signal.
extern "C" const char* __asan_default_options() {
  return "handle_segv=0:handle_abort=0:handle_sigfpe=0:handle_sigbus=0:handle_sigill=0:"
         "detect_leaks=0";
}
#endif

namespace polyest::internal {
namespace {

#if POLYEST_ADDRESS_SANITIZER || POLYEST_THREAD_SANITIZER
constexpr bool kLimitsMemory = false;  // a sanitizer's shadow is larger than any limit
#else
constexpr bool kLimitsMemory = true;
#endif

bool Read(void* data, size_t size) {
  char* bytes = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t count = read(kWorkerSocket, bytes, size);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes += count;
    size -= static_cast<size_t>(count);
  }
  return true;
}

bool Write(const void* data, size_t size) {
  const char* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t count = write(kWorkerSocket, bytes, size);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes += count;
    size -= static_cast<size_t>(count);
  }
  return true;
}

// Reads one message. Returns false if the other side is gone or sent no valid message.
template <class Message>
bool Receive(Message& message) {
  uint64_t size = 0;
  if (!Read(&size, sizeof(size)) || size > kLongestMessage) return false;
  std::string bytes(size, '\0');
  if (!Read(bytes.data(), size)) return false;
  Decoder decoder(std::move(bytes));
  decoder(message);
  return decoder.complete();
}

bool Send(const ResultMessage& result) {
  Encoder encoder;
  encoder(result);
  const std::string bytes = encoder.TakeBytes();
  const uint64_t size = bytes.size();
  return Write(&size, sizeof(size)) && Write(bytes.data(), bytes.size());
}

// Ends this process when the other side closes the socket, whatever the FMU is doing. The
// parent-death signal (PR_SET_PDEATHSIG) would not serve: it is sent when the thread ends that
// started this process.
void* EndWithParent(void*) {
  pollfd socket{kWorkerSocket, 0, 0};
  while (poll(&socket, 1, -1) < 0 && errno == EINTR) {
  }
  _exit(0);
}

bool StartWatch() {
  constexpr size_t kStackBytes = 65536;
  pthread_attr_t attributes;
  pthread_t thread;
  return pthread_attr_init(&attributes) == 0 &&
         pthread_attr_setstacksize(&attributes, kStackBytes) == 0 &&
         pthread_create(&thread, &attributes, EndWithParent, nullptr) == 0;
}

void Limit(__rlimit_resource resource, int64_t most) {
  const rlimit limit{static_cast<rlim_t>(most), static_cast<rlim_t>(most)};
  setrlimit(resource, &limit);
}

void LimitAll(int64_t memory_bytes, int64_t file_bytes) {
  if (kLimitsMemory) Limit(RLIMIT_AS, memory_bytes);
  Limit(RLIMIT_FSIZE, file_bytes);
  Limit(RLIMIT_CORE, 0);
  Limit(RLIMIT_NPROC, 0);  // forbids new processes and threads; root is exempt
  constexpr int64_t kMaxDescriptors = 256;
  Limit(RLIMIT_NOFILE, kMaxDescriptors);
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
  // Exceeding the file size becomes a write error, as on a full disk, instead of a signal.
  signal(SIGXFSZ, SIG_IGN);
  signal(SIGPIPE, SIG_IGN);
}

ResultMessage Answer(Simulation* simulation, const absl::Status& started,
                     const RequestMessage& request) {
  ResultMessage result;
  absl::Status status = started;
  try {
    if (status.ok()) {
      status = std::visit([&](const auto& message) { return simulation->Answer(message, result); },
                          request);
    }
  } catch (const std::exception& exception) {
    status = absl::ResourceExhaustedError(exception.what());
  }
  if (status.ok()) return result;
  ResultMessage failed;
  failed.code = static_cast<int>(status.code());
  failed.error = std::string(status.message());
  return failed;
}

int Serve(StatusPage* page) {
  Monitor monitor(page);
  StartMessage start;
  if (!Receive(start)) return 1;
  absl::StatusOr<std::unique_ptr<Simulation>> simulation = absl::InternalError("");
  try {
    simulation = Simulation::Start(std::move(start), &monitor);
  } catch (const std::exception& exception) {
    simulation = absl::ResourceExhaustedError(exception.what());
  }
  for (RequestMessage request; Receive(request);) {
    Simulation* const running = simulation.ok() ? simulation->get() : nullptr;
    if (!Send(Answer(running, simulation.status(), request))) break;
  }
  return 0;
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  int64_t memory_bytes = 0, file_bytes = 0;
  if (argc != 3 || !absl::SimpleAtoi(argv[1], &memory_bytes) ||
      !absl::SimpleAtoi(argv[2], &file_bytes)) {
    return 2;
  }
  void* const page = mmap(nullptr, sizeof(polyest::internal::StatusPage), PROT_READ | PROT_WRITE,
                          MAP_SHARED, polyest::internal::kWorkerPage, 0);
  if (page == MAP_FAILED || chdir("/") != 0 || !polyest::internal::StartWatch()) return 2;
  close(polyest::internal::kWorkerPage);
  polyest::internal::LimitAll(memory_bytes, file_bytes);
  // Skips the destructors of static objects, including the FMU's.
  _exit(polyest::internal::Serve(static_cast<polyest::internal::StatusPage*>(page)));
}
