"""The errors a user may meet. Each message says what came, what was expected and what to do."""


class HinterlandError(Exception):
    """Base of every error caused by an input, a configuration or a file, never by a bug."""


class ConfigError(HinterlandError):
    """A configuration key is unknown, has the wrong type or an impossible value."""


class PlanError(HinterlandError):
    """A floor plan is missing, unreadable or unusable."""


class TableError(HinterlandError):
    """A table or weights file is missing, of another version, or does not fit the code that reads it."""


class TrialError(HinterlandError):
    """A trial cannot be run as asked, such as a start inside a wall."""


class PlannerError(TrialError):
    """A planner or an estimator answered what no robot could do or no building could be; its trial is worth nothing."""


class RobotError(TrialError):
    """A sensor, mapper or motion reported what is not so; its trial is worth nothing."""


class PartError(HinterlandError):
    """A part that the configuration names (a planner, an estimator, a network) fails or is of another kind."""


def printable(text: str) -> str:
    r"""Return ``text`` with what would move a cursor, turn writing around or break a line as ``\x1b``, ``\n`` ...

    Names of files and layers come from strangers: every message, remark and table passes through here on its way out.
    """
    return "".join(sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in text)


def one_line(text: object) -> str:
    """Return ``text`` as one printable line, blanks of any kind as single spaces."""
    return printable(" ".join(str(text).split()))
