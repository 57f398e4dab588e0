#pragma once

// A PostgreSQL server of its own for tests: in a temporary folder, reachable over a Unix socket in
// that folder and, unless it is told so, nowhere else.

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/testing/test_folder.h"

namespace polyest::internal {

class PostgresServer {
 public:
  // Makes an empty cluster and starts it. Runs as another user if the tests run as root, as which
  // PostgreSQL does not.
  PostgresServer();
  // Stops the server if it runs.
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  // Returns the server that the tests of this program share, which is started when it is first
  // asked for.
  static PostgresServer& Shared();

  // Makes an empty database and returns its URI.
  std::string MakeDatabase();
  // Runs statements in the database of this URI, as another program may.
  void Execute(const std::string& uri, const std::string& sql) const;
  // Returns the number that a query gives.
  int64_t Number(const std::string& uri, const std::string& sql) const;

  // Starts the server again so that it can be reached by TLS on loopback, too, at the address that
  // this returns, with its certificate and key (PEM). Role `rig` shows a password, and role `lab` a
  // certificate of `client_ca` with its name; both may do everything in the databases made so far.
  std::string ServeTls(const std::string& certificate, const std::string& key,
                       const std::string& client_ca, const std::string& password);

  // Starts the server again; returns when it takes connections.
  void Start();
  // Ends the server as a crash would: nothing more is written, and connections break off.
  void Crash();

 private:
  void Stop(int signal);
  // Writes a file of the server's that nobody else may read.
  void Write(const std::string& name, const std::string& text) const;
  // Runs a program of PostgreSQL's as the user that it may run as. Returns its process, and the
  // descriptor of its stderr.
  std::pair<pid_t, int> Spawn(const std::vector<std::string>& command) const;

  TestFolder folder_;
  std::string address_;  // empty: the Unix socket only
  pid_t pid_ = -1;
  int errors_ = -1;
  int databases_ = 0;
};

}  // namespace polyest::internal
