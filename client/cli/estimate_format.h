#pragma once

// Prints estimates as tables and sentences, in the width and with the colours of the screen
// (screen.h).

#include <absl/strings/string_view.h>

#include <ostream>
#include <string>

#include "polyest/v1/estimate.pb.h"

namespace polyest::internal {

// Prints a whole estimate: parameters, channels, directions, cost, expansion, diagnostics.
void PrintEstimate(const v1::Estimate& estimate, std::ostream& out);

// A value of a parameter with its standard deviation, in the parameter's unit.
struct ShownEstimate {
  double value = 0;
  double std_dev = 0;
};

// Returns what stands for a parameter: the most probable value with the curvature's standard
// deviation. It is the posterior's mean with the posterior's own standard deviation where the most
// probable value would mislead: the parameter is not identified, or the posterior is twice as wide
// as the curvature says, as where it is in several pieces. Whatever shows an estimate shows this.
ShownEstimate ShownOf(const v1::ParameterEstimate& p);

// Returns ShownOf as "40.6612 ± 0.0052".
std::string EstimateText(const v1::ParameterEstimate& p);

// Returns one line: "t = 10 s  k = 40.661 ± 0.026 N/m  c = 0.203 ± 0.011 N s/m".
std::string EstimateLine(const v1::Estimate& estimate);

// Returns "identified", "weak", "not identified" or, for an unknown verdict, "-".
std::string VerdictText(v1::Identifiability::Verdict verdict);

// Returns the text in the colour of the verdict: green for IDENTIFIED, yellow for WEAK, red for
// NOT_IDENTIFIED.
std::string PaintVerdict(std::ostream& out, v1::Identifiability::Verdict verdict,
                         absl::string_view text);

// Returns a text like "0.99 k − 0.10 c", in the order of the parameters. Terms with a coefficient
// below 0.05 are left out.
std::string DirectionText(const v1::Direction& direction);

// Prints a sentence for each trade-off: "k/m is known to 0.4 %, k and m separately only to 5 % and
// 5 %".
void PrintTradeOffs(const v1::Estimate& estimate, std::ostream& out);

// Prints a sentence for each diagnostic: "note: <meaning of the code>: <message>".
void PrintDiagnostics(const google::protobuf::RepeatedPtrField<v1::Diagnostic>& diagnostics,
                      std::ostream& out);

}  // namespace polyest::internal
