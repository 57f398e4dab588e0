#include "core/estimator/snapshot.h"

#include <absl/strings/str_format.h>
#include <zlib.h>

#include <sstream>
#include <utility>

#include "core/common/finite_matrix.h"
#include "core/estimator/state_archive.h"

namespace polyest::internal {
namespace {

const std::string kMagic = "polyest estimator";
constexpr size_t kChecksumBytes = 4;

uint32_t Checksum(std::string_view bytes) {
  return static_cast<uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

// A byte read from a snapshot may have any value, which a bool must not have.
template <class Archive>
void Flag(Archive& archive, bool& flag) {
  uint8_t byte = flag ? 1 : 0;
  archive(byte);
  flag = byte != 0;
}

}  // namespace

}  // namespace polyest::internal

namespace polyest {

using namespace internal;

// cereal calls each of these for writing and for reading.

template <class Archive>
void serialize(Archive& archive, SampleRow& row) {
  archive(row.run, row.time_s);
}

// Rows ahead are not included.
template <class Archive>
void serialize(Archive& archive, RowBlock& block) {
  archive(block.rows, block.values, block.noise);
}

template <class Archive>
void serialize(Archive& archive, PointFailure& failure) {
  archive(failure.point, failure.time_s, failure.flag, failure.reason);
}

}  // namespace polyest

namespace polyest::internal {

template <class Archive>
void serialize(Archive& archive, RecordSummary::Channel& channel) {
  archive(channel.samples, channel.noise_variance_sum, channel.largest, channel.intervals,
          channel.interval_sum_s, channel.least_interval_s, channel.longest_run_s,
          channel.run_began_s, channel.last_time_s, channel.last_run);
}

template <class Archive>
void serialize(Archive& archive, FailedTrajectory& failure) {
  archive(failure.theta, failure.run, failure.time_s, failure.flag, failure.reason);
}

template <class Archive>
void serialize(Archive& archive, EnsembleState::OfBlock& block) {
  archive(block.source, block.alive, block.states, block.modes);
  Flag(archive, block.stiff);
  archive(block.last_break_s, block.failures);
}

template <class Archive>
void serialize(Archive& archive, EnsembleState& ensemble) {
  archive(ensemble.samples, ensemble.time_s, ensemble.blocks);
}

template <class Archive>
void serialize(Archive& archive, ChannelNoise& noise) {
  archive(noise.scale, noise.time_constant_s, noise.white_share);
  Flag(archive, noise.learned);
  Flag(archive, noise.of_prediction);
  archive(noise.grid.shortest_s, noise.grid.longest_s);
}

template <class Archive>
void serialize(Archive& archive, LearnedNoise& noise) {
  archive(noise.channels, noise.posterior.centre, noise.posterior.factor, noise.misfit,
          noise.misfit_of_weights, noise.centre);
}

template <class Archive>
void serialize(Archive& archive, PreviousSample& sample) {
  Flag(archive, sample.known);
  archive(sample.time_s, sample.value, sample.noise, sample.variance, sample.output);
}

template <class Archive>
void serialize(Archive& archive, ChannelSums& sums) {
  archive(sums.samples, sums.differences, sums.log_variance, sums.log_variance_at_reference,
          sums.surplus);
}

template <class Archive>
void serialize(Archive& archive, SampleBySample& few) {
  archive(few.channels, few.own_error, few.log_noise, few.log_variance, few.check_chi_squared,
          few.check_residual, few.point_chi_squared, few.relative, few.check_log_variance,
          few.point_log_variance, few.largest);
}

template <class Archive>
void serialize(Archive& archive, AbsorbedRows& absorbed) {
  archive(absorbed.rows, absorbed.sample_count, absorbed.propagated, absorbed.sums,
          absorbed.discount, absorbed.own_error, absorbed.log_noise, absorbed.log_variance,
          absorbed.outliers, absorbed.summed_run, absorbed.previous_coefficients,
          absorbed.previous_error, absorbed.check_chi_squared, absorbed.check_residual,
          absorbed.check_valid, absorbed.point_chi_squared, absorbed.windows, absorbed.profiles,
          absorbed.blocks, absorbed.largest, absorbed.control_scores, absorbed.control_valid,
          absorbed.point_log_variance, absorbed.carried_error, absorbed.carried_rate, absorbed.few,
          absorbed.densities);
}

template <class Archive>
void serialize(Archive& archive, DesignState& design) {
  archive(design.truncation.order, design.truncation.exponent);
  Flag(archive, design.whole_prior);
  Flag(archive, design.in_tails);
  Flag(archive, design.checks_are_draws);
  archive(design.centre, design.axes, design.points, design.check_points, design.check_costs,
          design.reference, design.lower, design.upper, design.element);
}

template <class Archive>
void serialize(Archive& archive, TrajectoryState& state) {
  archive(state.kept, state.failures, state.run, state.ensemble, state.previous, state.controls);
}

template <class Archive>
void serialize(Archive& archive, ExpansionState& expansion) {
  archive(expansion.design, expansion.noise, expansion.absorbed, expansion.trajectories);
}

template <class Archive>
void serialize(Archive& archive, ScoreMixture& shape) {
  archive(shape.first, shape.step, shape.log_weights);
}

// Writes or reads all fields of ended runs; `Ended` is const for writing. The region and the basis
// are made of the other arguments.
template <class Archive, class Ended>
void ArchiveFields(Archive& archive, Ended& ended, Vector& centre, Matrix& axes,
                   Truncation& truncation, std::vector<double>& spent) {
  archive(ended.rows, ended.sample_count, ended.run, ended.first_row, ended.paths, ended.centre,
          ended.factor, centre, axes, truncation.order, truncation.exponent, ended.sums, spent,
          ended.discount, ended.own_error, ended.log_noise, ended.log_variance, ended.outliers,
          ended.largest, ended.remainder, ended.noise_scale, ended.noise_time_constant_s,
          ended.noise_white_share, ended.shapes, ended.left_out, ended.unresolved, ended.windows);
}

template <class Archive>
void save(Archive& archive, const EndedRuns& ended) {
  Vector centre = ended.region.centre();
  Matrix axes = ended.region.axes();
  Truncation truncation = ended.basis->truncation();
  std::vector<double> spent;
  for (const ChannelSums& sums : ended.sums) spent.push_back(sums.spent);
  ArchiveFields(archive, ended, centre, axes, truncation, spent);
}

template <class Archive>
void load(Archive& archive, EndedRuns& ended) {
  Vector centre;
  Matrix axes;
  Truncation truncation;
  std::vector<double> spent;
  ArchiveFields(archive, ended, centre, axes, truncation, spent);
  const Eigen::Index n = centre.size();
  if (n < 1 || n > kMaxParametersOfRuns || !IsFiniteMatrix(centre, n) ||
      !IsFiniteMatrix(axes, n, n) || spent.size() != ended.sums.size() || truncation.order < 1 ||
      truncation.order > kMaxTerms || !(truncation.exponent > 0) || truncation.exponent > 1 ||
      TermCount(static_cast<int>(n), truncation, kMaxTerms) > kMaxTerms) {
    throw cereal::Exception("ended runs that cannot be");
  }
  ended.region = Region(std::move(centre), std::move(axes));
  ended.basis = std::make_shared<Basis>(std::vector<Germ>(static_cast<size_t>(n), Germ::Uniform()),
                                        truncation);
  for (size_t c = 0; c < spent.size(); ++c) ended.sums[c].spent = spent[c];
}

template <class Archive>
void serialize(Archive& archive, ReexpansionMemory& memory) {
  OrderInVain& tried = memory.order;
  archive(memory.costs, tried.order, tried.error, tried.centre, tried.axes, tried.rows,
          tried.noise_variance, memory.prior.stays_from, memory.prior.tried);
  Flag(archive, memory.prior.in_vain);
}

template <class Archive>
void serialize(Archive& archive, ComponentState& component) {
  archive(component.runs, component.ended_runs, component.relative_tolerance, component.expansion,
          component.particles, component.memory, component.weight, component.room);
  Flag(archive, component.bisected);
  archive(component.taken, component.schedule, component.reexpansions_tried, component.reexpansions,
          component.abandoned_rows, component.summary, component.allowance.used,
          component.allowance.used_at, component.allowance.exempt_at, component.postponed.expansion,
          component.postponed.noise, component.postponed.tolerance);
}

template <class Archive>
void serialize(Archive& archive, MixtureState& state) {
  archive(state.components, state.weighing_row, state.left_out, state.elements_left_out,
          state.reexpansions, state.propagated_rows);
}

template <class Archive>
void serialize(Archive& archive, EstimatorState& state) {
  archive(state.mixture, state.search);
}

std::string EncodeState(const EstimatorState& state, int64_t rows, uint32_t fingerprint) {
  std::ostringstream stream;
  {
    cereal::PortableBinaryOutputArchive archive(stream);
    archive(kMagic, kSnapshotVersion, fingerprint, rows, state);
  }
  std::string bytes = std::move(stream).str();
  const uint32_t checksum = Checksum(bytes);
  for (int shift = 0; shift < 32; shift += 8) {
    bytes.push_back(static_cast<char>(checksum >> shift & 0xff));
  }
  return bytes;
}

namespace {

// Returns the checksum in the last four bytes, lowest byte first.
uint32_t ChecksumAtEnd(std::string_view bytes) {
  uint32_t checksum = 0;
  for (size_t i = bytes.size(); i-- > bytes.size() - kChecksumBytes;) {
    checksum = checksum << 8 | static_cast<unsigned char>(bytes[i]);
  }
  return checksum;
}

absl::StatusOr<EstimatorState> DecodeBody(std::string body, int64_t rows, uint32_t fingerprint) {
  std::istringstream stream(std::move(body));
  cereal::PortableBinaryInputArchive archive(stream);
  std::string magic;
  uint32_t version = 0, fingerprint_there = 0;
  int64_t rows_there = 0;
  archive(magic);
  if (magic != kMagic) return absl::DataLossError("the bytes are not those of a snapshot");
  archive(version);
  if (version != kSnapshotVersion) {
    return absl::FailedPreconditionError(
        absl::StrFormat("the snapshot is of version %d and this is %d", version, kSnapshotVersion));
  }
  archive(fingerprint_there, rows_there);
  if (fingerprint_there != fingerprint) {
    return absl::FailedPreconditionError("the snapshot is of another problem");
  }
  if (rows_there != rows) {
    return absl::DataLossError(
        absl::StrFormat("the snapshot is of %d rows and not of %d", rows_there, rows));
  }
  EstimatorState state;
  archive(state);
  return state;
}

}  // namespace

absl::StatusOr<EstimatorState> DecodeState(std::string_view bytes, int64_t rows,
                                           uint32_t fingerprint) {
  if (bytes.size() < kChecksumBytes ||
      ChecksumAtEnd(bytes) != Checksum(bytes.substr(0, bytes.size() - kChecksumBytes))) {
    return absl::DataLossError(absl::StrFormat(
        "the snapshot of %d bytes is cut off or corrupted: its checksum is wrong", bytes.size()));
  }
  bytes.remove_suffix(kChecksumBytes);
  try {
    return DecodeBody(std::string(bytes), rows, fingerprint);
  } catch (const cereal::Exception& exception) {
    return absl::DataLossError(absl::StrFormat("the snapshot is malformed: %s", exception.what()));
  }
}

}  // namespace polyest::internal
