#pragma once

// Prints an estimate for a person: as wide as the screen, and with its colours (screen.h).

#include <absl/strings/string_view.h>

#include <ostream>
#include <string>

#include "polyest/v1/estimate.pb.h"

namespace polyest::internal {

// Prints everything: parameters, channels, directions, cost, expansion, diagnostics.
void PrintEstimate(const v1::Estimate& estimate, std::ostream& out);

// Returns one line: "t = 10 s  k = 40.661 ± 0.026 N/m  c = 0.203 ± 0.011 N s/m".
std::string EstimateLine(const v1::Estimate& estimate);

std::string VerdictText(v1::Identifiability::Verdict verdict);

// Returns the text in the colour of the verdict: green for IDENTIFIED, yellow for WEAK, red for
// NOT_IDENTIFIED.
std::string PaintVerdict(std::ostream& out, v1::Identifiability::Verdict verdict,
                         absl::string_view text);

// Returns "0.99 k − 0.10 c", in the order of the parameters, without what is too small to matter.
std::string DirectionText(const v1::Direction& direction, const v1::Estimate& estimate);

// Prints one sentence each: "k/m is known to 0.4 %, k and m separately only to 5 % and 5 %".
void PrintTradeOffs(const v1::Estimate& estimate, std::ostream& out);

// Prints one sentence each: "note: <what the code means>: <message>".
void PrintDiagnostics(const google::protobuf::RepeatedPtrField<v1::Diagnostic>& diagnostics,
                      std::ostream& out);

}  // namespace polyest::internal
