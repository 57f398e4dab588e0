#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/string_view.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <istream>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/data_input.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/first_rows.h"
#include "client/cli/input_files.h"
#include "client/cli/interrupt.h"
#include "client/cli/problem_input.h"
#include "client/cli/progress_line.h"
#include "client/cli/refused_row.h"
#include "client/cli/stream_progress.h"
#include "client/cli/stream_session.h"
#include "client/cpp/file_kind.h"
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

bool IsRegularFile(int descriptor) {
  struct stat file;
  return fstat(descriptor, &file) == 0 && S_ISREG(file.st_mode);
}

// Delays batches by the times of their rows.
class Pace {
 public:
  // Does not delay beyond `end`.
  Pace(double rate, const Interrupt& interrupt, std::optional<Place::Clock::time_point> end)
      : rate_(rate), interrupt_(interrupt), end_(end.value_or(Place::Clock::time_point::max())) {}

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
    interrupt_.WaitUntil(
        std::min(end_, start_ + std::chrono::duration_cast<Place::Clock::duration>(due)));
  }

 private:
  const double rate_;
  const Interrupt& interrupt_;
  const Place::Clock::time_point end_;
  const Place::Clock::time_point start_ = Place::Clock::now();
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
    if (arguments_.data_file == "-") return Read(STDIN_FILENO);
    POLYEST_RETURN_IF_ERROR(CheckIsNoFolder(arguments_.data_file));
    const int descriptor = open(arguments_.data_file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
      return absl::InvalidArgumentError(
          absl::StrCat(arguments_.data_file, ": cannot be opened: ", std::strerror(errno)));
    }
    if (isatty(STDERR_FILENO) != 0) progress_.CountRowsOf(descriptor);
    auto last = Read(descriptor);
    close(descriptor);
    return last;
  }

  bool interrupted() const { return interrupt_.Requested(); }

  // Returns an error if an interrupt has kept rows of a file from being sent. It is the usual end
  // of data from a pipe.
  absl::Status HasSentFile() const {
    if (!interrupted() || !is_file_) return absl::OkStatus();
    return absl::CancelledError(absl::StrCat("interrupted: the estimate is of the first ",
                                             skipped_ + sent_, " rows of ", DataName()));
  }

 private:
  using LastEstimate = absl::StatusOr<std::optional<v1::Estimate>>;

  std::string DataName() const {
    return arguments_.data_file == "-" ? "standard input" : arguments_.data_file;
  }

  LastEstimate Read(int descriptor) {
    InterruptibleInput input(descriptor, interrupt_);
    std::istream in(&input);
    DataFileOptions options = arguments_.data_options;
    options.any_order = arguments_.reorder_window_s > 0;
    // A session that is resumed may already have the runs before. The daemon checks them.
    options.any_first_run = !arguments_.session.empty();
    // Editors omit the end of a file's last line, but a program that writes it to a pipe has been
    // stopped within the line, and within a number perhaps.
    is_file_ = IsRegularFile(descriptor);
    options.whole_lines = !is_file_;
    POLYEST_ASSIGN_OR_RETURN(const DataColumns columns,
                             DataColumnsFor(problem_, arguments_.place, options));
    auto reader = DataReader::Open(in, DataName(), columns);
    if (interrupted()) return std::nullopt;
    POLYEST_RETURN_IF_ERROR(reader.status());
    reader_ = &*reader;
    // The first batch is read before the session is created, so that a file without any valid row
    // creates none.
    v1::Measurements first;
    const absl::Status read = reader->Read(arguments_.batch_rows, first);
    if (interrupted()) return std::nullopt;
    if (first.time_s().empty()) POLYEST_RETURN_IF_ERROR(read);
    line_->Interject([&] { TellOfDataFile(reader->Found()); });
    auto session = WaitForSession();
    if (!session.ok() && interrupted()) return std::nullopt;
    if (!session.ok()) return InInput(session.status());
    if (reader->CountsFromFirstRow()) {
      POLYEST_RETURN_IF_ERROR(CheckZeroOfTime(client_, *session, first, DataName()));
    }
    auto last = Send(*session, *reader, std::move(first), read);
    if (!last.ok()) return InInput(last.status());
    return last;
  }

  // Returns the error with its place in the files. In data that may be in any order, rows that the
  // session had before are anywhere, so that the number of a row is not its place.
  absl::Status InInput(const absl::Status& status) const {
    const bool has_places = skipped_ == 0 || arguments_.reorder_window_s == 0;
    return InFiles(status, {.problem = arguments_.problem_file,
                            .data = {DataName(), has_places ? reader_->Lines() : RowLines()}});
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

  MeasurementStreamOptions StreamOptions() {
    MeasurementStreamOptions options;
    options.wait = [this](std::chrono::milliseconds delay) {
      interrupt_.WaitUntil(std::chrono::steady_clock::now() + delay);
      return !interrupted();
    };
    return options;
  }

  // Sends `batch`, with which reading has ended with the status `read`, and all rows after it.
  LastEstimate Send(const StreamSession& session, DataReader& reader, v1::Measurements batch,
                    const absl::Status& read) {
    MeasurementStream stream(client_, session.name, StreamOptions(), Callbacks());
    auto last = SendAll(session, reader, stream, std::move(batch), read);
    if (last.ok()) return last;
    std::vector<v1::Measurements> refused = stream.Unacknowledged();
    if (refused.empty()) return last;
    return EndAtRefusal(session, std::move(refused), last.status());
  }

  LastEstimate SendAll(const StreamSession& session, DataReader& reader, MeasurementStream& stream,
                       v1::Measurements batch, absl::Status read) {
    POLYEST_RETURN_IF_ERROR(stream.Open());
    if (isatty(STDERR_FILENO) != 0) {
      line_->Interject([&] { err_ << "streaming to " << session.name << std::endl; });
    }
    Pace pace(arguments_.rate, interrupt_, arguments_.place.End());
    while (batch.time_s_size() > 0) {
      progress_.AddRows(batch.time_s_size());
      if (session.resumed_after) skipped_ += RemoveRowsUpTo(*session.resumed_after, batch);
      if (const int rows = batch.time_s_size(); rows > 0) {
        if (sent_ == 0) TellOfResumption(session);
        pace.Wait(batch);
        POLYEST_RETURN_IF_ERROR(stream.Send(std::move(batch)));
        sent_ += rows;
      }
      if (interrupted() || !read.ok()) break;
      read = reader.Read(arguments_.batch_rows, batch);
      if (interrupted()) break;  // the rows read may end within a row
    }
    if (sent_ == 0) TellOfResumption(session);
    if (const std::string line = reader.UnendedLine(); !line.empty() && !interrupted()) Tell(line);
    if (!read.ok() && !interrupted()) return EndAtBadLine(session, stream, read);
    if (EndsRun() && sent_ > 0 && !interrupted()) {
      v1::Measurements end;
      end.set_end_of_run(true);
      POLYEST_RETURN_IF_ERROR(stream.Send(std::move(end)));
    }
    return stream.Finish();
  }

  // Waits until the session has the rows before a line that was refused with `read`, and returns
  // that error with their number. The run goes on: the line may be corrected.
  absl::Status EndAtBadLine(const StreamSession& session, MeasurementStream& stream,
                            const absl::Status& read) {
    const absl::Status kept = stream.Finish().status();
    if (kept.ok()) return WithRowsKept(read, session, sent_);
    Tell(read.message());
    return kept;
  }

  // Sends what comes before the row that the daemon refuses in the first of the batches that it has
  // not taken, and returns the refusal with the row's place in the data and the number of rows
  // kept. The run goes on, as it does after a bad line.
  absl::Status EndAtRefusal(const StreamSession& session, std::vector<v1::Measurements> refused,
                            absl::Status refusal) {
    int64_t kept = sent_;
    for (const v1::Measurements& batch : refused) kept -= batch.time_s_size();
    const int64_t rows_before = skipped_ + kept;
    v1::Measurements& batch = refused.front();
    // The daemon need not name the first of several bad rows.
    for (int row; (row = RefusedRow(refusal).value_or(0)) > 0 && row < batch.time_s_size();) {
      batch = FirstRows(std::move(batch), row);
      const absl::Status sent = SendAlone(session, batch);
      if (sent.ok()) {
        kept += row;
        break;
      }
      if (!RefusedRow(sent)) {
        Tell(InInput(AtRowOfData(refusal, rows_before)).message());
        return sent;
      }
      refusal = sent;
    }
    if (!absl::IsInvalidArgument(refusal) && !absl::IsResourceExhausted(refusal)) return refusal;
    return WithRowsKept(InInput(AtRowOfData(refusal, rows_before)), session, kept);
  }

  absl::Status SendAlone(const StreamSession& session, const v1::Measurements& batch) {
    MeasurementStream stream(client_, session.name, StreamOptions(), Callbacks());
    POLYEST_RETURN_IF_ERROR(stream.Open());
    POLYEST_RETURN_IF_ERROR(stream.Send(batch));
    return stream.Finish().status();
  }

  static absl::Status WithRowsKept(const absl::Status& status, const StreamSession& session,
                                   int64_t rows) {
    if (rows == 0) return status;
    return absl::Status(
        status.code(),
        absl::StrCat(status.message(), "; ", session.name, " has kept ",
                     rows == 1 ? "the row" : absl::StrCat("the ", rows, " rows"), " sent before"));
  }

  // Reports that a session is resumed, once the number of rows is known that it does not take.
  void TellOfResumption(const StreamSession& session) {
    if (!session.resumed_after) return;
    const RowPlace& last = *session.resumed_after;
    if (skipped_ == 0) {
      Tell(absl::StrFormat("resumed %s after t = %g s of run %d", session.name, last.time_s,
                           last.run));
      return;
    }
    Tell(absl::StrFormat(
        "resumed %s; %s not later than t = %g s of run %d, up to which the session has its data, "
        "and %s skipped; rows of another record need a column run with the next number, %d",
        session.name, skipped_ == 1 ? "1 row is" : absl::StrCat(skipped_, " rows are"), last.time_s,
        last.run, skipped_ == 1 ? "was" : "were", last.run + 1));
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

  void Tell(absl::string_view sentence) {
    line_->Interject([&] { err_ << "polyest: " << sentence << std::endl; });
  }

  const StreamArguments& arguments_;
  std::ostream& out_;
  std::ostream& err_;
  const Interrupt interrupt_;
  Client client_;
  v1::Problem problem_;
  StreamProgress progress_;
  bool is_file_ = false;  // whether the data are a file, rather than a pipe
  // Rows left out at the beginning of the data, because the session has them, and rows sent.
  int64_t skipped_ = 0, sent_ = 0;
  ProgressLine* line_ = nullptr;        // valid during Run()
  const DataReader* reader_ = nullptr;  // valid during Read(), once it is open
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
  const absl::Status sent = command.HasSentFile();
  return sent.ok() ? kExitOk : Report(sent, arguments.place.server, err);
}

}  // namespace polyest::internal
