#include "client/cli/shared_options.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <arpa/inet.h>

#include <charconv>
#include <map>
#include <utility>

#include "client/cli/name_list.h"

namespace polyest::internal {
namespace {

const std::map<std::string, Format> kFormats = {{"table", Format::kTable},
                                                {"json", Format::kJson},
                                                {"jsonl", Format::kJsonLines},
                                                {"csv", Format::kCsv}};

// Whether a text is an IPv6 address without brackets, and possibly with the zone of a link, %eth0.
bool IsIpv6(const std::string& text) {
  in6_addr address;
  return inet_pton(AF_INET6, text.substr(0, text.find('%')).c_str(), &address) == 1;
}

std::string CheckServer(const std::string& server) {
  const size_t colon = server.rfind(':');
  if (IsIpv6(server) || IsIpv6(server.substr(0, colon))) {
    return "\"" + server + "\" must be HOST:PORT, an IPv6 address in brackets, as in [::1]:50051";
  }
  int port = 0;
  const bool is_host = server.find('/') == std::string::npos;
  if (colon != std::string::npos && colon > 0 && is_host) {
    const char* const end = server.data() + server.size();
    const auto result = std::from_chars(server.data() + colon + 1, end, port);
    if (result.ec == std::errc() && result.ptr == end && port >= 1 && port <= 65535) return "";
  }
  return "\"" + server + "\" must be HOST:PORT, the port from 1 to 65535" +
         (is_host ? "" : ", without \"http://\" or a path");
}

void AddAccess(CLI::App& command, ServerAccess& access) {
  const std::string group = "Access to a daemon";
  command.add_option("--tls-ca", access.ca_file, "PEM file of the CA of the daemon's certificate")
      ->envname("POLYEST_TLS_CA")
      ->group(group);
  CLI::Option* const certificate =
      command
          .add_option("--tls-certificate", access.certificate_file,
                      "PEM file of the client's own certificate, where the daemon asks for one")
          ->envname("POLYEST_TLS_CERTIFICATE")
          ->group(group);
  CLI::Option* const key =
      command.add_option("--tls-key", access.key_file, "PEM file of the key of --tls-certificate")
          ->envname("POLYEST_TLS_KEY")
          ->group(group);
  certificate->needs(key);
  key->needs(certificate);
  command
      .add_option("--tls-server-name", access.server_name,
                  "The name in the daemon's certificate, if it is not that of --server")
      ->group(group);
  command
      .add_option("--token-file", access.token_file,
                  "File of the token, in place of the environment's POLYEST_TOKEN")
      ->envname("POLYEST_TOKEN_FILE")
      ->group(group);
}

}  // namespace

CLI::Validator Between(double least, double most) {
  const auto check = [least, most](const std::string& text) {
    double number = 0;
    const bool in_range = absl::SimpleAtod(text, &number) && number >= least && number <= most;
    return in_range ? std::string()
                    : absl::StrFormat("%s must be a number from %g to %g", text, least, most);
  };
  return CLI::Validator(check, CLI::Range(least, most).get_description());
}

CLI::Validator WholeBetween(int least, int most) {
  const auto check = [least, most](const std::string& text) {
    int number = 0;
    const bool in_range = absl::SimpleAtoi(text, &number) && number >= least && number <= most;
    return in_range ? std::string()
                    : absl::StrFormat("%s must be a whole number from %d to %d", text, least, most);
  };
  return CLI::Validator(check, CLI::Range(least, most).get_description());
}

CLI::Option* AddServer(CLI::App& command, Place& place) {
  command
      .add_option("--deadline", place.deadline_s,
                  "Give up this many seconds after the start, with the exit status 1, or 3 with\n"
                  "--server; 0: never")
      ->check(Between(0.0, 1e9));
  AddAccess(command, place.access);
  return command.add_option("--server", place.server, "The daemon to ask, HOST:PORT")
      ->check(CLI::Validator(CheckServer, "HOST:PORT"));
}

std::vector<CLI::Option*> AddModelFolders(CLI::App& command, Place& place) {
  return {
      command.add_option("--fmu-dir", place.fmu_dir, "Folder with FMUs for local computations"),
      command.add_option("--umbridge-dir", place.umbridge_dir,
                         "Folder with descriptions of UM-Bridge models for local computations")};
}

CLI::Option* AddThreads(CLI::App& command, int& threads) {
  // The help has no number of its own: man pages are made of it, on another computer.
  return command
      .add_option("--threads", threads,
                  "Threads for computing in this process (default: one for each core)")
      ->check(WholeBetween(1, 256));
}

CLI::Option* AddPlace(CLI::App& command, Place& place) {
  CLI::Option* const server = AddServer(command, place);
  command.add_flag("--local")
      ->description("Compute in this process (the default)")
      ->excludes(server);
  for (CLI::Option* const folder : AddModelFolders(command, place)) folder->excludes(server);
  AddThreads(command, place.threads)->excludes(server);
  return server;
}

void AddProblem(CLI::App& command, std::string& file) {
  command.add_option("problem", file, "The problem, a JSON file")->required();
}

void AddData(CLI::App& command, std::string& file) {
  command.add_option("data", file, "The measurements, a CSV file")->required();
}

void AddStudyInput(CLI::App& command, StudyInput& input) {
  CLI::Option* const problem =
      command.add_option("problem", input.problem_file, "The problem, a JSON file");
  CLI::Option* const data =
      command.add_option("data", input.data_file, "The measurements, a CSV file");
  CLI::Option* const server = AddPlace(command, input.place);
  CLI::Option* const name =
      command
          .add_option("--session", input.session,
                      "A session of the daemon, in place of the problem and the data")
          ->needs(server)
          ->excludes(problem)
          ->excludes(data);
  const std::vector<CLI::Option*> of_data = AddDataOptions(command, input.data_options);
  command.callback([&command, problem, data, name, of_data] {
    if (name->count() == 0 && data->count() == 0) {
      throw CLI::RequiredError(problem->count() > 0 ? "data"
                                                    : "problem and data, or else --session,");
    }
    std::vector<const CLI::Option*> files = {data};
    if (const auto* const other = command.get_option_no_throw(kValidate)) files.push_back(other);
    RequireDataFile(of_data, files);
  });
}

void AddOutputs(CLI::App& command, std::vector<std::string>& outputs, const char* help) {
  const auto add = [&outputs](const std::vector<std::string>& lists) {
    for (const std::string& list : lists) {
      for (std::string& name : SplitNames(list)) {
        if (!name.empty()) outputs.push_back(std::move(name));
      }
    }
  };
  command
      .add_option_function<std::vector<std::string>>(
          "--outputs", add,
          absl::StrCat(help, ";\na comma within brackets is part of a name, as in K[1,1]"))
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
}

void AddPlot(CLI::App& command, std::string& file, const char* what) {
  command.add_option("--plot", file, absl::StrCat("Draw ", what, " into this .svg or .png file"));
}

void AddFormat(CLI::App& command, Format& format, const std::vector<std::string>& names) {
  std::map<std::string, Format> formats;
  std::string list;
  for (const std::string& name : names) {
    formats[name] = kFormats.at(name);
    list += (list.empty() ? "" : ", ") + name;
  }
  const auto check = [formats, list](const std::string& name) {
    if (formats.count(name) != 0) return std::string();
    return "\"" + name + "\" must be one of " + list;
  };
  command
      .add_option_function<std::string>(
          "--format", [formats, &format](const std::string& name) { format = formats.at(name); },
          "How to print: " + list + " (default " + names.front() + ")")
      ->check(CLI::Validator(check, "FORMAT"));
}

}  // namespace polyest::internal
