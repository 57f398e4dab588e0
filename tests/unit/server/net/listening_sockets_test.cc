#include "server/net/listening_sockets.h"

#include <gtest/gtest.h>

#include "server/net/socket_address.h"

namespace polyest::internal {
namespace {

class ListeningSocketsTest : public testing::Test {
 protected:
  // Listens on another port and returns its address.
  sockaddr_storage Listen() {
    int port = 0;
    EXPECT_TRUE(sockets_.Listen("--listen", "127.0.0.1", port).ok());
    return sockets_.Addresses().back();
  }
  static Descriptor Connect(const sockaddr_storage& address) {
    Descriptor client(socket(address.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(
        connect(client.number(), reinterpret_cast<const sockaddr*>(&address), SizeOf(address)), 0);
    return client;
  }
  // Accepts a connection and returns the port that it has come to.
  int PortOfNext() {
    const Descriptor connection(sockets_.Accept().descriptor);
    sockaddr_storage address{};
    socklen_t size = sizeof(address);
    EXPECT_EQ(getsockname(connection.number(), reinterpret_cast<sockaddr*>(&address), &size), 0);
    return ToIpAddress(address).port;
  }

  ListeningSockets sockets_;
};

TEST_F(ListeningSocketsTest, HasOnePortAtAllAddressesOfAName) {
  int port = 0;
  ASSERT_TRUE(sockets_.Listen("--listen", "localhost", port).ok());
  EXPECT_NE(port, 0);
  ASSERT_FALSE(sockets_.Addresses().empty());
  for (const sockaddr_storage& address : sockets_.Addresses()) {
    EXPECT_EQ(ToIpAddress(address).port, port);
  }
}

TEST_F(ListeningSocketsTest, AcceptsInTurnHoweverBusyOneSocketIs) {
  const sockaddr_storage busy = Listen(), other = Listen();
  const Descriptor first = Connect(busy), second = Connect(busy), third = Connect(busy);
  EXPECT_EQ(PortOfNext(), ToIpAddress(busy).port);
  const Descriptor last = Connect(other);
  EXPECT_EQ(PortOfNext(), ToIpAddress(other).port);
  EXPECT_EQ(PortOfNext(), ToIpAddress(busy).port);
}

TEST_F(ListeningSocketsTest, TellsWhereAConnectionComesFrom) {
  const Descriptor client = Connect(Listen());
  sockaddr_storage own{};
  socklen_t size = sizeof(own);
  ASSERT_EQ(getsockname(client.number(), reinterpret_cast<sockaddr*>(&own), &size), 0);
  const ListeningSockets::Connection connection = sockets_.Accept();
  const Descriptor accepted(connection.descriptor);
  EXPECT_EQ(ToIpAddress(connection.from).port, ToIpAddress(own).port);
}

TEST_F(ListeningSocketsTest, AcceptsNoneOnceItIsStopped) {
  const Descriptor client = Connect(Listen());
  sockets_.Stop();
  EXPECT_LT(sockets_.Accept().descriptor, 0);
  EXPECT_LT(sockets_.Accept().descriptor, 0);
}

TEST_F(ListeningSocketsTest, NamesTheOptionAndTheAddressThatItCannotHave) {
  int port = ToIpAddress(Listen()).port;
  ListeningSockets second;
  EXPECT_EQ(second.Listen("--web", "127.0.0.1", port),
            absl::UnavailableError("--web: cannot listen on 127.0.0.1:" + std::to_string(port) +
                                   ": the port is in use"));
  EXPECT_TRUE(second.Addresses().empty());
}

}  // namespace
}  // namespace polyest::internal
