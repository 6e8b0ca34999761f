"""Every exception Steelyard raises on purpose.

SteelyardError
 ├─ BadInput              what was given cannot be read or makes no sense   (exit status 2)
 │   ├─ BadFile           a file is missing, unreadable or of another kind
 │   ├─ BadDescription    a log or team description says something impossible
 │   │   └─ NoDescription  data cannot be read without one; holds one to start from
 │   └─ BadValue          an argument or a column holds wrong numbers
 ├─ CannotAnswer          the data are sound but do not determine an answer (exit status 3)
 │   └─ NoMasses          a given shape cannot follow the data, which may well answer without it
 └─ MissingDependency     an optional package is needed and not installed   (exit status 2)
"""

from __future__ import annotations


class SteelyardError(Exception):
    """Base of every error that Steelyard raises on purpose; its text says what to do next."""

    exit_status = 2


class BadInput(SteelyardError):
    """Input that cannot be used as it is."""


class BadFile(BadInput):
    """A file that is missing, unreadable or not what it should be."""


class BadDescription(BadInput):
    """A log or team description with an impossible entry."""


class NoDescription(BadDescription):
    """Data that only a description can tell how to read.

    words    what is the matter
    example  the text of a description to start from
    """

    def __init__(self, words: str, example: str = "") -> None:
        super().__init__(f"{words}\n{example}" if example else words)
        self.words = words
        self.example = example


class BadValue(BadInput):
    """Numbers of the wrong shape, size or kind."""


class CannotAnswer(SteelyardError):
    """Sound data that do not determine what was asked."""

    exit_status = 3


class NoMasses(CannotAnswer):
    """Parts that no masses make explain the data: it is their size or their place that is wrong."""


class MissingDependency(SteelyardError):
    """An optional package that is needed here and not installed."""

    @classmethod
    def of(cls, package: str, extra: str, purpose: str) -> MissingDependency:
        """Name the package, what it is needed for and the line that installs it."""
        return cls(f"{purpose} needs the package '{package}'. Install it with: pip install 'steelyard[{extra}]'")
