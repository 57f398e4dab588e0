#pragma once

// The answers of the HTTP port that are not messages of the contract: errors, files of the page,
// and the headers that all answers have.

#include <string>
#include <string_view>

#include "polyest/rpc/error_details.pb.h"
#include "server/web/http_message.h"

namespace polyest::internal {

// Returns the answer for an error: google.rpc.Status as JSON, under the status of HTTP that stands
// for its code.
HttpAnswer ErrorAnswer(const rpc::Status& status);
// Returns the same under another status of HTTP.
HttpAnswer ErrorAnswer(int http_status, int code, std::string_view message);

// Returns the answer with the headers that keep browsers from doing more with it than they should.
HttpAnswer Secured(HttpAnswer answer);

}  // namespace polyest::internal
