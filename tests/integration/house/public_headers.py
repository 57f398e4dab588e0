#!/usr/bin/env python3
"""Checks the headers for users: each says what it is for, includes only others for users, and
describes every declaration, by a comment above it or behind it.

Usage: public_headers.py FOLDER… | public_headers.py --self-test

A folder is one that holds `polyest/`; generated headers (*.pb.h) in it are passed over.
"""

import pathlib
import re
import sys

ALLOWED = re.compile(r'#include (<[^>]+>|"polyest/[^"]+")$')
# Declarations that need no comment.
PLAIN = re.compile(r"friend |(virtual )?~|.*= delete;$|.*operator=\(|namespace |using namespace|#")


def code_of(line):
    line = re.sub(r'"(\\.|[^"\\])*"', '""', line)
    return re.sub(r"//.*", "", line).strip()


class Header:
    def __init__(self, name, text):
        self.name = name
        self.lines = text.splitlines()
        self.problems = []

    def complain(self, index, what):
        self.problems.append(f"{self.name}:{index + 1}: {what}")

    def described(self, first, last):
        above = self.lines[first - 1].strip() if first else ""
        return above.startswith("//") or any("//" in self.lines[i] for i in range(first, last + 1))

    def check_head(self):
        rest = [line for line in self.lines if line.strip()]
        if rest[:1] != ["#pragma once"]:
            self.complain(0, "does not begin with #pragma once")
        if len(rest) < 2 or not rest[1].startswith("//"):
            self.complain(0, "does not open with what it is for")
        for index, line in enumerate(self.lines):
            if line.startswith("#include") and not ALLOWED.match(line):
                self.complain(index, f"{line} is not for users")

    def statement(self, index, separator):
        """The last line of the declaration that begins here, whether it opens a body, and its text."""
        depth, text = 0, ""
        for last in range(index, len(self.lines)):
            code = code_of(self.lines[last])
            text += " " + code
            depth += code.count("(") - code.count(")") + code.count("<") - code.count(">")
            braces = text.count("{") - text.count("}")
            if depth <= 0 and braces > 0 and code.endswith("{"):
                return last, True, text.strip()
            if depth <= 0 and braces == 0 and (code.endswith(separator) or code.endswith((";", "}"))):
                return last, False, text.strip()
            if braces < 0:
                return last, False, text.strip()
        return len(self.lines) - 1, False, text.strip()

    def end_of_body(self, index):
        depth = 0
        for last in range(index, len(self.lines)):
            code = code_of(self.lines[last])
            depth += code.count("{") - code.count("}")
            if depth == 0:
                return last
        return len(self.lines) - 1

    def walk(self, index, end, kind):
        """Checks the declarations from line `index` to before `end`, inside of a namespace, struct,
        class or enum."""
        public = kind != "class"
        while index < end:
            code = code_of(self.lines[index])
            if not code or code.startswith("#") or code == "}":
                index += 1
                continue
            access = re.match(r"(public|protected|private):", code)
            if access:
                public = access[1] == "public"
                index += 1
                continue
            last, opens, text = self.statement(index, "," if kind == "enum" else ";")
            close = self.end_of_body(index) if opens else last
            name = re.match(r"(namespace|struct|class|enum)\b", re.sub(r"^template <.*?> ", "", text))
            if opens and name and name[1] == "namespace":
                if "internal" not in text:
                    self.walk(last + 1, close, "namespace")
            elif public:
                if not PLAIN.match(text) and not self.described(index, last):
                    self.complain(index, f"is not described: {text[:70]}")
                if opens and name:
                    self.walk(last + 1, close, name[1])
            index = close + 1

    def check(self):
        self.check_head()
        self.walk(0, len(self.lines), "namespace")
        return self.problems


GOOD = """#pragma once

// Counts things.

#include <vector>

#include "polyest/other.h"

namespace polyest {

// A count.
struct Count {
  int things = 0;  // ≥ 0
  // Returns the count
  // in dozens.
  double Dozens() const { return things / 12.0; }
};

// Sizes.
enum class Size {
  kSmall,  // below 12
  kLarge,  // others
};

// Counts.
class Counter {
 public:
  virtual ~Counter() = default;
  // Adds one thing.
  void Add(const std::vector<int>& things = {},
           bool twice = false);

 private:
  int count_ = 0;
};

// Returns the size of a count.
Size SizeOf(const Count& count);

}  // namespace polyest
"""


def self_test():
    """Whatever is left out of a good header must be missed, and nothing else."""
    if problems := Header("good.h", GOOD).check():
        sys.exit("the good header is refused:\n" + "\n".join(problems))
    faults = [line for line in GOOD.split("\n") if "//" in line and "namespace" not in line and "dozens" not in line]
    for fault in faults:
        bad = re.sub(r"\s*//.*", "", fault) if fault.strip()[:2] != "//" else None
        text = GOOD.replace(fault + "\n", "" if bad is None else bad + "\n")
        if "Returns the count" in fault:
            text = text.replace("  // in dozens.\n", "")
        if len(Header("bad.h", text).check()) != 1:
            sys.exit(f"not one complaint without {fault.strip()!r}: {Header('bad.h', text).check()}")
    if not Header("bad.h", GOOD.replace('"polyest/other.h"', '"core/other.h"')).check():
        sys.exit("an include of another room is not refused")


if sys.argv[1:] == ["--self-test"]:
    self_test()
else:
    headers = [h for folder in sys.argv[1:] for h in sorted(pathlib.Path(folder, "polyest").rglob("*.h"))
               if not h.name.endswith(".pb.h")]
    if not headers:
        sys.exit("there are no headers")
    found = [problem for h in headers for problem in Header(str(h), h.read_text()).check()]
    if found:
        sys.exit("\n".join(found))
    print(f"{len(headers)} headers are described")
