#pragma once

// The quantities of a model that can be given a value or a prior by name: its parameters, including
// the initial states, and the parameters of its channels,
//
//   u(t) = u.gain · u.amplitude · shape(t − u.delay) + u.offset    of an input u,
//   sample(t) = x.gain · x(t − x.delay) + x.offset + noise         of an output x.
//
// and what only filters use: the spectral densities of process noise, the rates of drifting
// parameters, and the standard deviations of the samples' noise. Their values form one vector: the
// parameters, then amplitude, gain, delay and offset of each input, then gain, delay and offset of
// each output, then the spectral density of each process noise, then the rates, then the noises.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/common/types.h"
#include "core/propagation/trajectory_ensemble.h"
#include "polyest/model.h"
#include "polyest/problem.h"

namespace polyest::internal {

// Returns the name of the standard deviation of a measured output's noise: "x.noise".
std::string NoiseName(const std::string& output);

class SettableQuantities {
 public:
  // The kinds of each input, and those of each output, are in the order that they have in the
  // vector.
  enum class Kind {
    kParameter,
    kAmplitude,
    kInputGain,
    kDelay,
    kInputOffset,
    kOutputGain,
    kOutputDelay,
    kOutputOffset,
    kSpectralDensity,
    kDriftRate,  // of a drifting parameter
    kNoise       // of a measured output
  };
  struct Settable {
    std::string name;
    std::string unit;
    double default_value;  // 0 for an amplitude, until the input has a signal
    bool has_default;
    Kind kind;
    // Column of the model's parameters, inputs, outputs or states; of a rate, that of its state in
    // the drifting model.
    int column;
    // For a rate: the one by which the normal score gains 1/√s. For a noise: as stated.
    double unit_value = 1;

    bool of_input() const {
      return kind == Kind::kAmplitude || kind == Kind::kInputGain || kind == Kind::kDelay ||
             kind == Kind::kInputOffset;
    }
    bool of_output() const {
      return kind == Kind::kOutputGain || kind == Kind::kOutputDelay ||
             kind == Kind::kOutputOffset || kind == Kind::kNoise;
    }
    bool is_delay() const { return kind == Kind::kDelay || kind == Kind::kOutputDelay; }
  };

  explicit SettableQuantities(const ModelDescription& model, const Problem& problem = {});

  int size() const { return static_cast<int>(all_.size()); }
  const Settable& operator[](int index) const { return all_[static_cast<size_t>(index)]; }
  // Returns the index of the quantity of that name, or nothing if there is none.
  std::optional<int> Find(std::string_view name) const;
  std::vector<std::string> Names() const;
  // Returns the default values, in the order of the quantities.
  Vector Defaults() const;
  // Returns the index of the amplitude of the model's input `column`.
  int Amplitude(int column) const { return OfInput(Kind::kAmplitude, column); }
  // Returns a list of all names, for a message.
  std::string Describe() const;

  // Sets the ensemble's parameters and channels from `values` (Q × size), and what only filters
  // use. The outputs to read must already be set.
  void Fill(const Matrix& values, EnsembleSpecification& ensemble) const;

 private:
  static constexpr int kKindsOfInput = 4;   // amplitude, gain, delay and offset
  static constexpr int kKindsOfOutput = 3;  // gain, delay and offset

  // Return the index of a quantity of the model's input or output `column`. The column after the
  // last one gives the index at which those of all inputs or outputs end.
  int OfInput(Kind kind, int column) const {
    return parameters_ + kKindsOfInput * column + Distance(Kind::kAmplitude, kind);
  }
  int OfOutput(Kind kind, int column) const {
    return OfInput(Kind::kAmplitude, inputs_) + kKindsOfOutput * column +
           Distance(Kind::kOutputGain, kind);
  }
  static int Distance(Kind from, Kind to) { return static_cast<int>(to) - static_cast<int>(from); }

  // Adds the parameters, and what is settable of each input and output.
  void AddQuantitiesOfModel(const ModelDescription& model);
  // Adds spectral densities, rates of drifts and, with filters, the noise of sensors.
  void AddHyperparameters(const ModelDescription& model, const Problem& problem);

  std::vector<Settable> all_;
  int parameters_;
  int inputs_;
  int outputs_;
  int states_;  // of the model, and one for each drifting parameter
};

}  // namespace polyest::internal
