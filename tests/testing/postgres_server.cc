#include "tests/testing/postgres_server.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <libpq-fe.h>
#include <poll.h>
#include <pwd.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// Debian keeps the programs of each version apart.
constexpr char kPrograms[] = "/usr/lib/postgresql/15/bin/";

// Returns the user as whom a server runs: this one, or another if this one is root.
const passwd& ServerUser() {
  const passwd* user = geteuid() == 0 ? getpwnam("postgres") : getpwuid(geteuid());
  POLYEST_CHECK(user != nullptr);
  return *user;
}

using Connection = std::unique_ptr<PGconn, decltype(&PQfinish)>;
using Result = std::unique_ptr<PGresult, decltype(&PQclear)>;

Result Run(const std::string& uri, const std::string& sql) {
  const Connection connection(PQconnectdb(uri.c_str()), PQfinish);
  POLYEST_CHECK(PQstatus(connection.get()) == CONNECTION_OK);
  Result result(PQexec(connection.get(), sql.c_str()), PQclear);
  const ExecStatusType status = PQresultStatus(result.get());
  POLYEST_CHECK(status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK);
  return result;
}

// Reads from a descriptor until a text appears or the end.
bool ReadUntil(int descriptor, std::string_view text) {
  std::string read;
  char buffer[4096];
  while (read.find(text) == std::string::npos) {
    const ssize_t more = ::read(descriptor, buffer, sizeof buffer);
    if (more <= 0) return false;
    read.append(buffer, static_cast<size_t>(more));
  }
  return true;
}

}  // namespace

PostgresServer& PostgresServer::Shared() {
  static PostgresServer server;
  return server;
}

PostgresServer::PostgresServer() {
  if (geteuid() == 0) {
    POLYEST_CHECK(chown(folder_.path().c_str(), ServerUser().pw_uid, ServerUser().pw_gid) == 0);
  }
  const auto [pid, errors] =
      Spawn({"initdb", "--pgdata", folder_ / "data", "--username", "polyest", "--auth", "trust",
             "--encoding", "UTF8", "--locale", "C", "--no-sync"});
  ReadUntil(errors, std::string_view("\0", 1));
  close(errors);
  int status = 0;
  POLYEST_CHECK(waitpid(pid, &status, 0) == pid && status == 0);
  Start();
}

// Nobody needs the cluster any more, so that nothing has to reach the disk.
PostgresServer::~PostgresServer() { Crash(); }

std::pair<pid_t, int> PostgresServer::Spawn(const std::vector<std::string>& command) const {
  int ends[2];
  POLYEST_CHECK(pipe2(ends, O_CLOEXEC) == 0);
  const std::string program = kPrograms + command.front();
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const passwd user = ServerUser();
  const pid_t pid = fork();
  POLYEST_CHECK(pid >= 0);
  if (pid > 0) {
    close(ends[1]);
    return {pid, ends[0]};
  }
  const bool allowed = geteuid() != 0 || (setgid(user.pw_gid) == 0 && setuid(user.pw_uid) == 0);
  // A server whose test has crashed ends as well.
  prctl(PR_SET_PDEATHSIG, SIGQUIT);
  dup2(ends[1], STDERR_FILENO);
  dup2(open("/dev/null", O_RDWR), STDOUT_FILENO);
  if (allowed && chdir("/") == 0) execv(program.c_str(), arguments.data());
  _exit(127);
}

void PostgresServer::Start() {
  const auto [pid, errors] =
      Spawn({"postgres", "-D", folder_ / "data", "-k", folder_.path(), "-h", address_, "-c",
             "max_connections=60", "-c", "shared_buffers=16MB", "-c", "log_min_messages=log", "-c",
             "log_checkpoints=off", "-c", "lc_messages=C"});
  pid_ = pid;
  errors_ = errors;
  POLYEST_CHECK(ReadUntil(errors_, "ready to accept connections"));
  // What it says further must not fill the pipe.
  fcntl(errors_, F_SETFL, O_NONBLOCK);
}

void PostgresServer::Crash() { Stop(SIGQUIT); }

void PostgresServer::Stop(int signal) {
  if (pid_ < 0) return;
  kill(pid_, signal);
  POLYEST_CHECK(waitpid(pid_, nullptr, 0) == pid_);
  close(errors_);
  pid_ = -1;
}

void PostgresServer::Write(const std::string& name, const std::string& text) const {
  const std::string path = folder_.Write("data/" + name, text);
  POLYEST_CHECK(chmod(path.c_str(), S_IRUSR | S_IWUSR) == 0);
  if (geteuid() == 0) {
    POLYEST_CHECK(chown(path.c_str(), ServerUser().pw_uid, ServerUser().pw_gid) == 0);
  }
}

std::string PostgresServer::ServeTls(const std::string& certificate, const std::string& key,
                                     const std::string& client_ca, const std::string& password) {
  const std::string uri = absl::StrCat("postgresql:///postgres?user=polyest&host=", folder_.path());
  Execute(uri, absl::StrCat("CREATE ROLE rig LOGIN PASSWORD '", password, "'"));
  Execute(uri, "CREATE ROLE lab LOGIN");
  for (int database = 1; database <= databases_; ++database) {
    Execute(uri, absl::StrCat("GRANT ALL ON DATABASE test", database, " TO rig, lab"));
  }
  Write("server.crt", certificate);
  Write("server.key", key);
  Write("ca.crt", client_ca);
  Write("pg_hba.conf",
        "local all all trust\nhostssl all rig 127.0.0.0/8 scram-sha-256\n"
        "hostssl all lab 127.0.0.0/8 cert\n");
  Execute(uri, "ALTER SYSTEM SET ssl = on");
  Execute(uri, "ALTER SYSTEM SET ssl_ca_file = 'ca.crt'");
  // The port is the one that names the socket; no other process has this address of loopback.
  const int process = getpid();
  address_ = absl::StrCat("127.", 2 + process / 62'500 % 250, ".", process / 250 % 250, ".",
                          1 + process % 250);
  Stop(SIGINT);
  Start();
  return address_;
}

std::string PostgresServer::MakeDatabase() {
  const auto uri = [&](const std::string& database) {
    return absl::StrCat("postgresql:///", database, "?user=polyest&host=", folder_.path());
  };
  const std::string name = absl::StrCat("test", ++databases_);
  Execute(uri("postgres"), "CREATE DATABASE " + name);
  return uri(name);
}

void PostgresServer::Execute(const std::string& uri, const std::string& sql) const {
  Run(uri, sql);
}

int64_t PostgresServer::Number(const std::string& uri, const std::string& sql) const {
  const Result result = Run(uri, sql);
  POLYEST_CHECK(PQntuples(result.get()) == 1);
  return std::stoll(PQgetvalue(result.get(), 0, 0));
}

}  // namespace polyest::internal
