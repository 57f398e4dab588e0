#!/usr/bin/env python3
"""Checks that data flows down the list of rooms: a file includes only its own room and rooms above.

Usage: rooms.py REPOSITORY | rooms.py --self-test
"""

import pathlib
import re
import sys
import tempfile

# The core's rooms, from the first to the last.
CORE = [
    "core/common", "core/chaos", "core/model", "core/propagation", "core/external",
    "core/fmu", "core/umbridge", "core/bayes",
    "core/estimator/problem", "core/estimator/record", "core/estimator/expansion",
    "core/estimator/posterior", "core/estimator/studies", "core/estimator",
]

# Each header for users belongs to the first room that may include it.
PUBLIC = {
    "core/common": ["types", "stop"],
    "core/chaos": ["density", "expansion_options", "uncertain_parameter"],
    "core/model": ["model", "catalogue", "input_signal", "equation_model"],
    "core/propagation": ["integration_options"],
    "core/bayes": ["noise", "diagnostic", "estimate", "regularization"],
    "core/estimator/problem": ["problem"],
    "core/estimator/record": ["samples"],
    "core/estimator/posterior": ["posterior"],
    "core/estimator/studies": [
        "cost_grid", "cost_profile", "experiment_design", "log_density", "prediction",
        "prior_propagation", "sensitivity"],
    "core/estimator": ["estimator"],
}

# Headers that no file of the core may include: it knows no calls, messages, storage or log.
FOREIGN = re.compile(r"<(grpc|grpcpp|google/protobuf|spdlog|sqlite3|prometheus|CLI)[/.]|\"polyest/(v1|rpc)/")


def subfolders(root, folder):
    """The rooms of a folder in the order in which its CMakeLists.txt builds them."""
    lists = root / folder / "CMakeLists.txt"
    names = re.findall(r"^ *add_subdirectory\((\w+)\)", lists.read_text(), re.M) if lists.exists() else []
    return [f"{folder}/{name}" for name in names]


def find_room(rooms, path):
    """The innermost room that a path is in."""
    inside = [room for room in rooms if path.startswith(room + "/")]
    return max(inside, key=len) if inside else None


def problems_of(root):
    wire = subfolders(root, "proto/wire") + ["proto/wire", "proto"]
    server = subfolders(root, "server") + ["server"]
    client = subfolders(root, "client") + ["client"]
    # The server and the client do not know each other.
    orders = [CORE + wire + server, CORE + wire + client]
    public = {f"polyest/{name}.h": room for room, names in PUBLIC.items() for name in names}
    for header in (root / "client/cpp/include/polyest").glob("*.h"):
        public[f"polyest/{header.name}"] = "client/cpp"
    problems, seen = [], 0
    for path in sorted(p for top in ("core", "proto", "server", "client") for p in (root / top).rglob("*")):
        if path.suffix not in (".h", ".cc"):
            continue
        seen += 1
        name = path.relative_to(root).as_posix()
        own = f"polyest/{path.name}" if "/include/polyest/" in name else None
        if own and own not in public:
            problems.append(f"{name}: give this header a room in {pathlib.Path(__file__).name}")
            continue
        room = public[own] if own else find_room(max(orders, key=lambda o: find_room(o, name) is not None), name)
        order = next((o for o in orders if room in o), None)
        if order is None:
            problems.append(f"{name}: is in no room")
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = re.match(r'#include ([<"])([^>"]+)[>"]', line)
            if not match:
                continue
            if room in CORE and FOREIGN.search(line):
                problems.append(f"{name}:{number}: the core does not know {match[2]}")
            if match[1] == "<" or match[2].endswith(".pb.h"):
                continue
            target = public.get(match[2]) or find_room(order, match[2]) or find_room(
                ["core", "proto", "server", "client"], match[2])
            if target not in order:
                problems.append(f"{name}:{number}: {room} does not know {match[2]}")
            elif order.index(target) > order.index(room):
                problems.append(f"{name}:{number}: {room} comes before {target}, whose {match[2]} it includes")
    return problems, seen


def self_test():
    """A tree with one fault of each kind; every fault must be found, and nothing else."""
    files = {
        "server/CMakeLists.txt": "add_subdirectory(journal)\nadd_subdirectory(service)\n",
        "client/CMakeLists.txt": "add_subdirectory(cpp)\nadd_subdirectory(cli)\n",
        "core/chaos/good.h": '#include "core/common/check.h"\n#include "polyest/types.h"\n',
        "core/chaos/bad.h": '#include "core/bayes/prior.h"\n',
        "core/model/bad.cc": '#include "polyest/estimator.h"\n',
        "core/common/bad.cc": "#include <spdlog/spdlog.h>\n",
        "core/include/polyest/unknown.h": "",
        "server/journal/bad.cc": '#include "server/service/service.h"\n',
        "server/service/good.cc": '#include "server/journal/journal.h"\n',
        "client/cli/bad.cc": '#include "server/journal/journal.h"\n',
        "client/cli/good.cc": '#include "core/estimator/studies/cost_grid.h"\n',
        "elsewhere/any.cc": '#include "server/journal/journal.h"\n',
    }
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            file = pathlib.Path(folder) / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        problems, _ = problems_of(pathlib.Path(folder))
    found = sorted(problem.split(":")[0] for problem in problems)
    wanted = sorted(name for name in files if "bad" in name or "unknown" in name)
    if found != wanted:
        sys.exit("found\n  " + "\n  ".join(problems) + "\nand not one fault in each of\n  " + "\n  ".join(wanted))


if sys.argv[1:] == ["--self-test"]:
    self_test()
else:
    found, count = problems_of(pathlib.Path(sys.argv[1]))
    if count == 0:
        sys.exit(f"{sys.argv[1]} has no sources")
    if found:
        sys.exit("\n".join(found))
    print(f"{count} files include only rooms above their own")
