#include "server/web/host_check.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

HttpRequest From(const std::string& host, const std::string& origin = "") {
  HttpRequest request;
  request.headers.emplace("Host", host);
  if (!origin.empty()) request.headers.emplace("Origin", origin);
  request.local_host = "192.0.2.7";
  return request;
}

TEST(HostCheck, KnowsLoopbackTheAddressReachedAndTheNamesGiven) {
  const HostCheck check("rig-7", {"Rig.Example.org", "[2001:db8::1]"});
  for (const char* host : {"localhost", "localhost:8080", "127.0.0.1:1", "[::1]:8080", "[::1]",
                           "LOCALHOST:9", "192.0.2.7:8080", "rig-7:8080", "rig.example.org",
                           "RIG.EXAMPLE.ORG:443", "[2001:db8::1]:80"}) {
    EXPECT_TRUE(check.Check(From(host)).ok()) << host;
  }
}

TEST(HostCheck, RefusesNamesThatAnybodyMayLetResolveToThisMachine) {
  const HostCheck check("0.0.0.0", {"rig.example.org"});
  for (const char* host :
       {"0.0.0.0:8080", "evil.example", "evil.example:8080", "localhost.evil.example",
        "127.0.0.1.evil.example", "xrig.example.org", "rig.example.org.", "192.0.2.8", "", ":80",
        "[::2]:80", "localhost@evil", "rig.example.org:80:80", "[::1", "evil.example#localhost"}) {
    EXPECT_EQ(check.Check(From(host)).code(), absl::StatusCode::kPermissionDenied) << host;
  }
}

TEST(HostCheck, NeedsExactlyOneHost) {
  const HostCheck check("127.0.0.1", {});
  EXPECT_EQ(check.Check(HttpRequest()).code(), absl::StatusCode::kInvalidArgument);
  HttpRequest two = From("localhost");
  two.headers.emplace("host", "localhost");
  EXPECT_EQ(check.Check(two).code(), absl::StatusCode::kInvalidArgument);
}

TEST(HostCheck, LetsInPagesOfTheSameOriginOnly) {
  const HostCheck check("127.0.0.1", {"rig.example.org"});
  EXPECT_TRUE(check.Check(From("localhost:8080", "http://localhost:8080")).ok());
  EXPECT_TRUE(check.Check(From("rig.example.org", "https://rig.example.org")).ok());
  for (const char* origin :
       {"null", "http://evil.example", "http://localhost", "http://localhost:8081",
        "https://localhost:8080.evil.example", "http://localhost:8080/", "ftp://localhost:8080",
        "localhost:8080", "http://127.0.0.1:8080", "http://http://localhost:8080"}) {
    EXPECT_EQ(check.Check(From("localhost:8080", origin)).code(),
              absl::StatusCode::kPermissionDenied)
        << origin;
  }
  HttpRequest two = From("localhost:8080", "http://localhost:8080");
  two.headers.emplace("origin", "http://localhost:8080");
  EXPECT_FALSE(check.Check(two).ok());
}

}  // namespace
}  // namespace polyest::internal
