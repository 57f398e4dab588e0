// Tests a daemon that listens on several addresses.

#include <fstream>

#include "tests/integration/daemon_fixture.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

bool Serves(const std::string& address) {
  const auto stub =
      v1::ModelService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  v1::ListModelsResponse models;
  return stub->ListModels(&context, {}, &models).ok() && models.models_size() > 0;
}

void ExpectTwoAddresses(const std::vector<std::string>& arguments) {
  DaemonProcess daemon(arguments);
  const std::string first = daemon.ReadAddress();
  const std::string second = daemon.ReadAddress();
  EXPECT_NE(first, second);
  EXPECT_TRUE(Serves(first)) << daemon.Errors();
  EXPECT_TRUE(Serves(second)) << daemon.Errors();
}

TEST(Listening, IsOnEveryAddressThatTheOptionIsRepeatedWith) {
  ExpectTwoAddresses({"--listen", "127.0.0.1:0", "--listen", "localhost:0"});
}

TEST(Listening, IsOnEveryAddressOfAListInTheFile) {
  const TestFolder folder;
  const std::string file = folder / "polyestd.toml";
  std::ofstream(file) << "listen = [\"127.0.0.1:0\", \"127.0.0.1:0\"]\n";
  ExpectTwoAddresses({"--config", file});
}

TEST(Listening, IsOnEveryAddressBetweenCommas) {
  ExpectTwoAddresses({"--listen", "127.0.0.1:0,127.0.0.1:0"});
}

TEST(Listening, NamesTheAddressThatCannotBeHad) {
  DaemonProcess first({"--listen", "127.0.0.1:0"});
  const std::string taken = first.ReadAddress();
  DaemonProcess second({"--listen", "127.0.0.1:0", "--listen", taken});
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_THAT(second.Errors(), HasSubstr("cannot listen on " + taken + ": the port is in use"));
}

TEST(Listening, NamesAHostThatIsUnknown) {
  DaemonProcess daemon({"--insecure", "--listen", "nosuchhost.invalid:5000"});
  EXPECT_EQ(daemon.Wait(), 1);
  EXPECT_THAT(daemon.Errors(),
              testing::MatchesRegex(
                  "polyestd: --listen: cannot listen on nosuchhost.invalid:5000: .*[Nn]ame.*\n"));
}

TEST(Listening, NamesTheOptionOfUmBridge) {
  DaemonProcess first({"--listen", "127.0.0.1:0"});
  const std::string taken = first.ReadAddress();
  DaemonProcess second({"--listen", "127.0.0.1:0", "--umbridge", taken});
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_THAT(second.Errors(),
              HasSubstr("--umbridge: cannot listen on " + taken + ": the port is in use"));
}

TEST(Listening, IsNowhereWhenOneAddressOfThemIsTooExposed) {
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--listen", "0.0.0.0:0"});
  EXPECT_EQ(daemon.Wait(), 2);
  EXPECT_THAT(daemon.Errors(), HasSubstr("--listen: 0.0.0.0"));
}

}  // namespace
}  // namespace polyest::internal
