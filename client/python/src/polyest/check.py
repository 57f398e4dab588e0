"""What a check of a problem finds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from polyest._html import page, table
from polyest._proto.v1 import problem_service_pb2
from polyest.errors import InvalidInput


@dataclass(frozen=True)
class Finding:
    """One thing found."""

    #: The path of the field in JSON's names, such as "uncertain[0].uniform"; may be empty.
    field: str
    #: The value and the rule, in one sentence.
    description: str

    def __str__(self) -> str:
        return f"{self.field}: {self.description}" if self.field else self.description


@dataclass(frozen=True)
class Remark:
    """What the problem says, with its defaults filled in."""

    #: "model", "unknowns", "correlations", "derived", "inputs", "measured", "expansion", "data".
    topic: str
    #: The parameter, input or output; may be empty.
    name: str
    #: The remark, in words and with units.
    description: str


@dataclass(frozen=True)
class Check:
    """What a check of a problem, and of data, has found."""

    #: Faults for which an estimate would be refused; empty: the problem can be used.
    errors: list[Finding]
    #: What is allowed but probably not intended.
    warnings: list[Finding]
    #: What the problem says and the data hold; empty if there are errors.
    summary: list[Remark]

    @property
    def ok(self) -> bool:
        """Whether the problem can be used."""
        return not self.errors

    def raise_for_errors(self) -> None:
        """Raises InvalidInput with the first error, if there is one."""
        if self.errors:
            first = self.errors[0]
            raise InvalidInput("; ".join(map(str, self.errors)), field=first.field,
                               rule=first.description)

    def __str__(self) -> str:
        lines = [f"error: {finding}" for finding in self.errors]
        lines += [f"warning: {finding}" for finding in self.warnings]
        lines += [f"{remark.topic:12} {remark.name:10} {remark.description}"
                  for remark in self.summary]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        rows = [("error", finding.field, finding.description) for finding in self.errors]
        rows += [("warning", finding.field, finding.description) for finding in self.warnings]
        rows += [(remark.topic, remark.name, remark.description) for remark in self.summary]
        return page(table(("", "", ""), rows))


def of_errors(faults: Iterable[InvalidInput]) -> Check:
    """Returns errors that were found without the daemon."""
    return Check([Finding(one.field, one.rule or one.message) for one in faults], [], [])


def of_message(message: problem_service_pb2.CheckProblemResponse,
               faults: Sequence[InvalidInput] = ()) -> Check:
    """Returns what the daemon has found, and errors that were found without it."""
    def findings(found: object) -> list[Finding]:
        return [Finding(one.field, one.description) for one in found]  # type: ignore[attr-defined]

    errors = findings(message.errors) + of_errors(faults).errors
    return Check(errors, findings(message.warnings),
                 [] if errors else [Remark(one.topic, one.name, one.description)
                                    for one in message.summary])
