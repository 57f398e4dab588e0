#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <istream>
#include <memory>
#include <optional>
#include <utility>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/data_input.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/interrupt.h"
#include "client/cli/problem_input.h"
#include "client/cli/progress_line.h"
#include "client/cli/stream_progress.h"
#include "client/cli/stream_session.h"
#include "core/common/status.h"
#include "polyest/client.h"
#include "polyest/data_file.h"
#include "polyest/measurement_stream.h"
#include "proto/wire/json/json_format.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

// The pauses between attempts to open a session.
constexpr std::chrono::milliseconds kFirstPause{500};
constexpr std::chrono::milliseconds kMaxPause{5'000};

// Delays batches by the times of their rows.
class Pace {
 public:
  Pace(double rate, const Interrupt& interrupt) : rate_(rate), interrupt_(interrupt) {}

  // Waits until the time at which the last row of the batch would have been measured. Runs follow
  // one another without a pause.
  void Wait(const v1::Measurements& batch) {
    if (rate_ == 0) return;
    for (int row = 0; row < batch.time_s_size(); ++row) {
      const int run = batch.run().empty() ? 0 : batch.run(row);
      if (run_ < 0) elapsed_s_ = -batch.time_s(row);
      elapsed_s_ += batch.time_s(row) - (run_ == run ? time_s_ : 0);
      run_ = run;
      time_s_ = batch.time_s(row);
    }
    const std::chrono::duration<double> due(elapsed_s_ / rate_);
    interrupt_.WaitUntil(start_ +
                         std::chrono::duration_cast<std::chrono::steady_clock::duration>(due));
  }

 private:
  const double rate_;
  const Interrupt& interrupt_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double elapsed_s_ = 0;
  int run_ = -1;  // before the first row
  double time_s_ = 0;
};

class StreamCommand {
 public:
  StreamCommand(const StreamArguments& arguments, std::ostream& out, std::ostream& err)
      : arguments_(arguments),
        out_(out),
        err_(err),
        client_(arguments.place.server, ToClientOptions(arguments.place)) {}

  // Returns the last estimate; none if the data have no samples or if an interrupt comes before the
  // first batch is sent.
  absl::StatusOr<std::optional<v1::Estimate>> Run() {
    if (arguments_.data_file != "-") {
      POLYEST_RETURN_IF_ERROR(
          CheckFilesAreNotSwapped(arguments_.problem_file, arguments_.data_file));
    }
    POLYEST_ASSIGN_OR_RETURN(problem_,
                             ReadCheckedProblem(arguments_.problem_file, arguments_.place));
    ProgressLine line([this] { return progress_.Describe(); });
    line_ = &line;
    if (arguments_.data_file == "-") return Read(STDIN_FILENO, "standard input");
    const int descriptor = open(arguments_.data_file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
      return absl::InvalidArgumentError(
          absl::StrCat(arguments_.data_file, ": cannot be opened: ", std::strerror(errno)));
    }
    if (isatty(STDERR_FILENO) != 0) progress_.CountRowsOf(descriptor);
    auto last = Read(descriptor, arguments_.data_file);
    close(descriptor);
    return last;
  }

  bool interrupted() const { return interrupt_.Requested(); }

 private:
  using LastEstimate = absl::StatusOr<std::optional<v1::Estimate>>;

  LastEstimate Read(int descriptor, const std::string& name) {
    InterruptibleInput input(descriptor, interrupt_);
    std::istream in(&input);
    DataFileOptions options = arguments_.data_options;
    options.any_order = arguments_.reorder_window_s > 0;
    POLYEST_ASSIGN_OR_RETURN(const DataColumns columns,
                             DataColumnsFor(problem_, arguments_.place, options));
    auto reader = DataReader::Open(in, name, columns);
    if (interrupted()) return std::nullopt;
    POLYEST_RETURN_IF_ERROR(reader.status());
    // The first batch is read before the session is created, so that an invalid file creates none.
    auto first = reader->Read(arguments_.batch_rows);
    if (interrupted()) return std::nullopt;
    POLYEST_RETURN_IF_ERROR(first.status());
    line_->Interject([&] { TellOfDataFile(reader->Found()); });
    auto session = WaitForSession();
    if (!session.ok() && interrupted()) return std::nullopt;
    if (!session.ok()) return InFile(session.status(), arguments_.problem_file, name);
    auto last = Send(*session, *reader, *std::move(first));
    if (!last.ok()) return InFile(last.status(), arguments_.problem_file, name);
    return last;
  }

  // Opens the session. Waits and tries again while the daemon has no room for it.
  absl::StatusOr<StreamSession> WaitForSession() {
    auto session = OpenSession(client_, problem_, arguments_.session, arguments_.reorder_window_s);
    for (std::chrono::milliseconds pause = kFirstPause; !session.ok();
         pause = std::min(2 * pause, kMaxPause)) {
      const auto refusal = RefusalOf(session.status());
      if (!absl::IsResourceExhausted(session.status()) || !refusal || !refusal->retry_delay) break;
      pause = std::max(pause, *refusal->retry_delay);
      Tell(absl::StrFormat("the daemon cannot create a session now (%s); trying again in %g s",
                           session.status().message(), static_cast<double>(pause.count()) / 1000));
      interrupt_.WaitUntil(std::chrono::steady_clock::now() + pause);
      if (interrupted()) break;
      session = OpenSession(client_, problem_, arguments_.session, arguments_.reorder_window_s);
    }
    return session;
  }

  LastEstimate Send(const StreamSession& session, DataReader& reader, v1::Measurements batch) {
    MeasurementStreamOptions options;
    options.wait = [this](std::chrono::milliseconds delay) {
      interrupt_.WaitUntil(std::chrono::steady_clock::now() + delay);
      return !interrupted();
    };
    MeasurementStream stream(client_, session.name, std::move(options), Callbacks());
    POLYEST_RETURN_IF_ERROR(stream.Open());
    if (isatty(STDERR_FILENO) != 0) {
      line_->Interject([&] { err_ << "streaming to " << session.name << std::endl; });
    }
    Pace pace(arguments_.rate, interrupt_);
    int64_t skipped = 0;
    bool any_sent = false;
    while (batch.time_s_size() > 0) {
      progress_.AddRows(batch.time_s_size());
      if (session.resumed_after) skipped += RemoveRowsUpTo(*session.resumed_after, batch);
      if (batch.time_s_size() > 0) {
        if (!any_sent) TellOfResumption(session, skipped);
        pace.Wait(batch);
        POLYEST_RETURN_IF_ERROR(stream.Send(std::move(batch)));
        any_sent = true;
      }
      if (interrupted()) break;
      auto next = reader.Read(arguments_.batch_rows);
      if (interrupted()) break;  // the rows read may end within a row
      POLYEST_ASSIGN_OR_RETURN(batch, std::move(next));
    }
    if (!any_sent) TellOfResumption(session, skipped);
    if (EndsRun() && any_sent && !interrupted()) {
      v1::Measurements end;
      end.set_end_of_run(true);
      POLYEST_RETURN_IF_ERROR(stream.Send(std::move(end)));
    }
    return stream.Finish();
  }

  // Reports that a session is resumed, once the number of rows is known that it has already.
  void TellOfResumption(const StreamSession& session, int64_t skipped) {
    if (!session.resumed_after) return;
    Tell(absl::StrFormat(
        "resumed %s after t = %g s of run %d; %d rows were already there and have been skipped",
        session.name, session.resumed_after->time_s, session.resumed_after->run, skipped));
  }

  // Returns whether the stream must end the run, because the last rows of a streamed input would
  // wait for rows that do not come, and so would those of the last reorder window. A session that
  // the user has named may be resumed with further rows of the run, unless it has a window.
  bool EndsRun() const {
    if (arguments_.reorder_window_s > 0) return true;
    if (!arguments_.session.empty()) return false;
    return std::any_of(problem_.inputs().begin(), problem_.inputs().end(),
                       [](const v1::Input& input) { return input.has_streamed(); });
  }

  MeasurementStreamCallbacks Callbacks() {
    return {
        .estimate =
            [this](const v1::Estimate& estimate) {
              progress_.SetEstimateTime(estimate.time());
              const std::string line = arguments_.format == Format::kJsonLines
                                           ? ToJson(estimate, /*several_lines=*/false)
                                           : EstimateLine(estimate);
              line_->Interject([&] { out_ << line << std::endl; });
            },
        .acknowledgement = nullptr,
        .connection = [this](const std::string& sentence) { Tell(sentence); },
    };
  }

  void Tell(const std::string& sentence) {
    line_->Interject([&] { err_ << "polyest: " << sentence << std::endl; });
  }

  const StreamArguments& arguments_;
  std::ostream& out_;
  std::ostream& err_;
  const Interrupt interrupt_;
  Client client_;
  v1::Problem problem_;
  StreamProgress progress_;
  ProgressLine* line_ = nullptr;  // valid during Run()
};

}  // namespace

int RunCommand(const StreamArguments& arguments, std::ostream& out, std::ostream& err) {
  StreamCommand command(arguments, out, err);
  const auto last = command.Run();
  if (!last.ok()) return Report(last.status(), arguments.place.server, err);
  if (!last->has_value()) {
    const std::string why = command.interrupted() ? "interrupted before the first estimate"
                                                  : "the data have no samples to estimate from";
    return Report(
        command.interrupted() ? absl::CancelledError(why) : absl::InvalidArgumentError(why),
        arguments.place.server, err);
  }
  if (arguments.format == Format::kTable) {
    out << '\n';
    PrintEstimate(**last, out);
  }
  return kExitOk;
}

}  // namespace polyest::internal
