#include "client/cli/remedy_report.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "client/cli/number_format.h"
#include "client/cli/screen.h"
#include "client/cli/text_table.h"

namespace polyest::internal {
namespace {

// Returns the codes that still contradict the problem, and the one that makes evidence rough.
std::string Remaining(const Assessment& assessment) {
  auto codes = Contradictions(assessment.posterior.diagnostics());
  const bool rough =
      std::ranges::any_of(assessment.posterior.diagnostics(), [](const v1::Diagnostic& diagnostic) {
        return diagnostic.code() == v1::Diagnostic::EXPANSION_INACCURATE;
      });
  if (rough) codes.push_back(v1::Diagnostic::EXPANSION_INACCURATE);
  return absl::StrJoin(codes, ", ", [](std::string* text, v1::Diagnostic::Code code) {
    absl::StrAppend(text, v1::Diagnostic::Code_Name(code));
  });
}

double ScoreGain(const TriedRemedy& tried, const RemedyTrial& trial) {
  return tried.assessment.log_score - trial.untreated.log_score;
}

void PrintTable(const RemedyTrial& trial, std::ostream& out) {
  TextTable table({"remedy", "log evidence gained", "log score gained", "within 95 %", "warnings"});
  const bool scored = trial.untreated.held_out > 0;
  table.AddRow({"none", "0.0", scored ? "0.0" : "-",
                scored ? FormatPercent(Coverage(trial.untreated)) : "-",
                Remaining(trial.untreated)});
  for (const TriedRemedy& one : trial.tried) {
    table.AddRow({RemedyText(one.remedy), absl::StrFormat("%.1f", one.gain),
                  one.scored ? absl::StrFormat("%.1f", ScoreGain(one, trial)) : "-",
                  one.scored ? FormatPercent(Coverage(one.assessment)) : "-",
                  Remaining(one.assessment)});
  }
  out << '\n';
  table.Print(out);
  out << '\n';
}

// Prints which remedies were refused, each reason once.
void PrintRefused(const RemedyTrial& trial, std::ostream& out) {
  std::map<std::string, std::vector<std::string>> remedies;  // by the reason
  for (const RefusedRemedy& one : trial.refused) {
    remedies[std::string(one.refusal.message())].push_back(RemedyText(one.remedy));
  }
  for (const auto& [reason, refused] : remedies) {
    PrintSentence(out, absl::StrCat("Refused: ", absl::StrJoin(refused, ", "), " (", reason, ")."));
  }
}

// Returns what the held-out rows say of the remedy that the evidence prefers.
std::string HeldOutText(const TriedRemedy& best, const RemedyTrial& trial) {
  if (!best.scored) return "there are no held-out rows to compare it by";
  const double gain = ScoreGain(best, trial);
  const auto other = std::ranges::find_if(trial.tried, [&](const TriedRemedy& one) {
    return one.scored && ScoreGain(one, trial) > gain;
  });
  if (gain <= 0) {
    return absl::StrFormat("the held-out rows do not agree: their log score falls by %.1f", -gain);
  }
  if (other == trial.tried.end()) {
    return absl::StrFormat("the held-out rows agree: their log score rises by %.1f", gain);
  }
  return absl::StrFormat("the log score of the held-out rows rises by %.1f, and by %.1f with %s",
                         gain, ScoreGain(*other, trial), RemedyText(other->remedy));
}

// Prints which remedies the record does not tell from the best one.
void PrintRivals(const RemedyTrial& trial, std::ostream& out) {
  const TriedRemedy& best = trial.tried.front();
  for (const TriedRemedy& one : trial.tried) {
    if (&one == &best || one.gain <= kDecisiveEvidence) continue;
    if (best.gain - one.gain <= kDecisiveEvidence) {
      PrintSentence(out, absl::StrFormat("The record does not tell it from %s, which gains only "
                                         "%.1f less.",
                                         RemedyText(one.remedy), best.gain - one.gain));
    } else if (best.remedy.kind == Remedy::Kind::kProcessNoise &&
               one.remedy.kind == Remedy::Kind::kCorrelatedNoise &&
               Contradictions(one.assessment.posterior.diagnostics()).empty()) {
      PrintSentence(out, absl::StrFormat(
                             "If you know that nothing disturbs the system itself, prefer %s: the "
                             "process noise stands for it with wider intervals than necessary.",
                             RemedyText(one.remedy)));
    }
  }
}

void PrintJson(const TriedRemedy& tried, std::ostream& out) {
  out << "Write into the problem file:\n";
  for (const std::string& line : RemedyJson(tried.problem, tried.remedy)) {
    out << "  " << line << '\n';
  }
}

// Prints that no remedy gains evidence. One that leaves no contradiction may be right all the same.
void PrintNoneFits(const RemedyTrial& trial, std::ostream& out) {
  const std::string none =
      absl::StrFormat("none gains more than %g in log evidence", kDecisiveEvidence);
  const auto clean = std::ranges::find_if(trial.tried, [](const TriedRemedy& one) {
    return Contradictions(one.assessment.posterior.diagnostics()).empty();
  });
  if (clean == trial.tried.end()) {
    PrintSentence(out, absl::StrCat("None of these remedies fits: ", none,
                                    ". The model probably lacks a term; compare models with and "
                                    "without it by polyest compare."));
    return;
  }
  PrintSentence(
      out, absl::StrCat("The evidence prefers none of these remedies: ", none, ". With ",
                        RemedyText(clean->remedy),
                        " nothing contradicts the problem, however: choose it if it is what you "
                        "know of the test. If not, the model probably lacks a term; compare "
                        "models with and without it by polyest compare."));
  PrintJson(*clean, out);
}

void PrintVerdict(const RemedyTrial& trial, std::ostream& out) {
  const TriedRemedy& best = trial.tried.front();
  if (best.gain <= kDecisiveEvidence) return PrintNoneFits(trial, out);
  PrintSentence(out, absl::StrFormat("The evidence prefers %s, by %.1f over the problem as it is; "
                                     "%s.",
                                     RemedyText(best.remedy), best.gain, HeldOutText(best, trial)));
  PrintRivals(trial, out);
  if (!Contradictions(best.assessment.posterior.diagnostics()).empty()) {
    PrintSentence(out, absl::StrCat("Even so, warnings remain (", Remaining(best.assessment),
                                    "): the problem probably needs another remedy as well, or the "
                                    "model lacks a term."));
  } else if (best.remedy.kind == Remedy::Kind::kCorrelatedNoise) {
    PrintSentence(out,
                  "Correlated noise also takes up what a model lacks, such as friction or a "
                  "sensor's gain: no warning remains then, and estimates can be off by more than "
                  "their intervals. If the model may lack a term, compare models with and without "
                  "it by polyest compare first.");
  }
  PrintJson(best, out);
}

}  // namespace

void PrintTrial(const RemedyTrial& trial, std::ostream& out) {
  if (!trial.refusal.ok()) {
    out << '\n';
    PrintSentence(out, absl::StrCat("No remedy was tried: the problem cannot be weighed: ",
                                    trial.refusal.message()));
    return;
  }
  if (!trial.untreated.log_evidence) {
    out << '\n';
    PrintSentence(out,
                  "No remedy was tried: the problem has no evidence to compare them by, since the "
                  "prior's weight is not 1, parameters of ended runs have been integrated out, or "
                  "outliers have been weighed too far from the estimate.");
    return;
  }
  if (trial.tried.empty()) {
    out << '\n';
    PrintSentence(out, trial.refused.empty() ? "No remedy was tried: the problem has room for none."
                                             : "No remedy could be tried.");
    PrintRefused(trial, out);
    return;
  }
  PrintTable(trial, out);
  if (!trial.left_out.empty()) {
    PrintSentence(out, absl::StrCat("Not tried, since there are many: ",
                                    absl::StrJoin(trial.left_out, ", ",
                                                  [](std::string* text, const Remedy& remedy) {
                                                    absl::StrAppend(text, RemedyText(remedy));
                                                  }),
                                    "."));
  }
  PrintRefused(trial, out);
  if (!trial.ended.ok()) {
    PrintSentence(out, "The trial ended early, so that the table is not complete.");
  }
  PrintVerdict(trial, out);
}

}  // namespace polyest::internal
