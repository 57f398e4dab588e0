#include "server/daemon/listener.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "server/daemon/health_dial.h"
#include "server/net/socket_address.h"

namespace polyest::internal {
namespace {

using namespace std::chrono_literals;

constexpr auto kPatience = 60s;

sockaddr_storage Address(const char* text) {
  sockaddr_storage address{};
  auto& four = reinterpret_cast<sockaddr_in&>(address);
  auto& six = reinterpret_cast<sockaddr_in6&>(address);
  if (inet_pton(AF_INET, text, &four.sin_addr) == 1) {
    four.sin_family = AF_INET;
  } else {
    EXPECT_EQ(inet_pton(AF_INET6, text, &six.sin6_addr), 1);
    six.sin6_family = AF_INET6;
  }
  return address;
}

TEST(PeerKey, IsAnAddressOrANetworkThatOneMachineMayUse) {
  EXPECT_EQ(PeerKey(Address("192.0.2.7")), "192.0.2.7");
  EXPECT_EQ(PeerKey(Address("::ffff:192.0.2.7")), "192.0.2.7");
  EXPECT_EQ(PeerKey(Address("2001:db8:1:2:3:4:5:6")), "2001:db8:1:2::/64");
  EXPECT_EQ(PeerKey(Address("2001:db8:1:2:ffff::9")), "2001:db8:1:2::/64");
}

TEST(LimitConnections, LeavesDescriptorsForTheJournal) {
  EXPECT_EQ(LimitConnections(1'000'000, 0, 0).total, 10'000);
  EXPECT_EQ(LimitConnections(1'000'000, 0, 0).per_peer, 5'000);
  EXPECT_EQ(LimitConnections(1'000'000, 20'000, 7).total, 20'000);
  EXPECT_EQ(LimitConnections(1'000'000, 20'000, 7).per_peer, 7);
  EXPECT_EQ(LimitConnections(4'096, 20'000, 0).total, 4'096 - 512);
  EXPECT_EQ(LimitConnections(256, 0, 0).total, 192);
}

TEST(RaiseDescriptorLimit, GoesAsFarAsTheHardLimit) {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  const rlimit low{64, limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  EXPECT_GT(RaiseDescriptorLimit(), 64);
  rlimit raised{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &raised), 0);
  EXPECT_EQ(raised.rlim_cur, limit.rlim_max);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
}

TEST(AddressesToDial, ReachASocketOfAllAddressesAlsoWhereThereIsNoIpv6) {
  const auto dialled = [](const char* text) {
    sockaddr_storage address = Address(text);
    SetPort(address, 7);
    std::vector<std::string> places;
    for (const sockaddr_storage& place : AddressesToDial(address)) {
      const IpAddress ip = ToIpAddress(place);
      EXPECT_EQ(ip.port, 7);
      EXPECT_EQ(place.ss_family, address.ss_family);
      places.push_back(ip.host);
    }
    return places;
  };
  using ::testing::ElementsAre;
  EXPECT_THAT(dialled("0.0.0.0"), ElementsAre("127.0.0.1"));
  EXPECT_THAT(dialled("192.0.2.7"), ElementsAre("192.0.2.7"));
  EXPECT_THAT(dialled("2001:db8::7"), ElementsAre("2001:db8::7"));
  EXPECT_THAT(dialled("::"), ElementsAre("::1", "127.0.0.1"));
}

class ListenerTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(listener_.Listen(address_).ok());
    grpc::EnableDefaultHealthCheckService(true);
    grpc::ServerBuilder builder;
    listener_.Serve(builder, grpc::InsecureServerCredentials());
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
  }
  void TearDown() override {
    listener_.Stop();
    server_->Shutdown();
  }
  // Returns whether a new client's connection is served within a time.
  bool Connects(std::chrono::seconds time) const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto channel = grpc::CreateCustomChannel(address_.ToString(),
                                                   grpc::InsecureChannelCredentials(), arguments);
    return channel->WaitForConnected(std::chrono::system_clock::now() + time);
  }

  ListenAddress address_{"127.0.0.1", 0};
  Listener listener_{{.limits = {.total = 1, .per_peer = 1}, .descriptors = 1'000'000}};
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(ListenerTest, NoticesThatNobodyAccepts) {
  EXPECT_FALSE(listener_.Dial(50ms, /*http2=*/false));
  EXPECT_FALSE(listener_.Dial(50ms, /*http2=*/true));
  listener_.Start();
  EXPECT_TRUE(listener_.Dial(kPatience, /*http2=*/false));
  EXPECT_TRUE(listener_.Dial(kPatience, /*http2=*/true));
}

// The second is the address at which the first is dialled where there is no ::1.
TEST(Listener, DialsItselfAtSocketsOfIpv6) {
  for (const char* host : {"[::]", "[::ffff:127.0.0.1]"}) {
    ListenAddress address{host, 0};
    Listener listener({.limits = {.total = 1, .per_peer = 1}, .descriptors = 1'000'000});
    if (!listener.Listen(address).ok()) GTEST_SKIP() << "this machine has no IPv6";
    grpc::EnableDefaultHealthCheckService(true);
    grpc::ServerBuilder builder;
    listener.Serve(builder, grpc::InsecureServerCredentials());
    const auto server = builder.BuildAndStart();
    ASSERT_NE(server, nullptr);
    listener.Start();
    EXPECT_TRUE(listener.Dial(kPatience, /*http2=*/false)) << host;
    EXPECT_TRUE(listener.Dial(kPatience, /*http2=*/true)) << host;
    listener.Stop();
    server->Shutdown();
  }
}

TEST_F(ListenerTest, NoticesThatNobodyAnswers) {
  listener_.Start();
  EXPECT_TRUE(listener_.Dial(kPatience, /*http2=*/true));
  server_->Shutdown();
  EXPECT_FALSE(listener_.Dial(50ms, /*http2=*/true));
}

TEST_F(ListenerTest, RefusesWhatIsTooMuchAndDialsItselfNevertheless) {
  listener_.Start();
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  auto first =
      grpc::CreateCustomChannel(address_.ToString(), grpc::InsecureChannelCredentials(), arguments);
  ASSERT_TRUE(first->WaitForConnected(std::chrono::system_clock::now() + kPatience));
  do {
    EXPECT_FALSE(Connects(1s));
  } while (listener_.refused() == 0);
  EXPECT_TRUE(listener_.Dial(kPatience, /*http2=*/true));
  first = nullptr;
  while (listener_.open() > 0) std::this_thread::yield();
  EXPECT_TRUE(Connects(kPatience));
}

TEST_F(ListenerTest, NamesAnAddressThatItCannotHave) {
  ListenAddress taken = address_;
  Listener second({});
  EXPECT_TRUE(absl::IsUnavailable(second.Listen(taken)));
  ListenAddress elsewhere{"192.0.2.7", 0};
  EXPECT_TRUE(absl::IsUnavailable(second.Listen(elsewhere)));
}

}  // namespace
}  // namespace polyest::internal
