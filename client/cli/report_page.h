#pragma once

// Writes an estimate with all that supports it as one HTML page that needs no network: for the
// report of a test.

#include <string>

#include "polyest/v1/estimate.pb.h"
#include "polyest/v1/problem.pb.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// What a report shows.
struct ReportContent {
  std::string subject;  // the files or the session
  std::string date;     // of the report
  std::string version;  // of polyest
  v1::Problem problem;
  v1::Estimate estimate;
  v1::EstimateHistory history;
  v1::PredictResponse prediction;
  v1::PredictResponse drift;  // of the parameters that drift, smoothed; no outputs if none does
  v1::ComputePosteriorResponse posterior;
};

// Returns the page.
std::string ReportPage(const ReportContent& content);

}  // namespace polyest::internal
