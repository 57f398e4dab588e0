#pragma once

// An estimate for a person.

#include <ostream>
#include <string>

#include "polyest/v1/estimate.pb.h"

namespace polyest {

// Everything: parameters, channels, directions, cost, expansion, diagnostics.
void PrintEstimate(const v1::Estimate& estimate, std::ostream& out);

// One line: "t = 10 s  k = 40.661 ± 0.026 N/m  c = 0.203 ± 0.011 N s/m".
std::string EstimateLine(const v1::Estimate& estimate);

std::string VerdictText(v1::Identifiability::Verdict verdict);

// "0.99 k − 0.10 c", in the order of the parameters, without what is too small to matter.
std::string DirectionText(const v1::Direction& direction, const v1::Estimate& estimate);

// One line each: "k/m is known to 0.4 %, k and m separately only to 5 % and 5 %".
void PrintTradeOffs(const v1::Estimate& estimate, std::ostream& out);

// One line each: "note: <what the code means>: <message>".
void PrintDiagnostics(const google::protobuf::RepeatedPtrField<v1::Diagnostic>& diagnostics,
                      std::ostream& out);

}  // namespace polyest
