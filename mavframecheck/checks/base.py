"""What every Python check is."""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from mavframecheck.model import Scalar, Subject
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Place

if TYPE_CHECKING:
    from mavframecheck.model.trace import Figure


class Observation(NamedTuple):
    """Something a check found: where it began and ended, how often, and values for the rule's texts."""

    subject: Subject
    first: Place
    last: Place
    times: int
    """How often."""
    values: Mapping[str, Scalar]


class Verdict(NamedTuple):
    """How far a check could look."""

    checked: int
    """Rows looked at; 0 means that the rule did not apply, or could not decide."""
    insufficient: str = ""
    """Why it could not decide, where it could not."""
    partly: str = ""
    """Where it looked at some streams: why it could not decide about the others."""
    idle: str = ""
    """Where there was nothing to look at: what it would have needed."""


class Check(ABC):
    """A check with memory: fed every batch, asked at the end.

    It must not depend on how the recording is cut into batches, and its memory must not grow with it.
    """

    of_missions: ClassVar[bool] = False
    """Whether it judges missions, so that it also runs on mission files."""
    only: int | None = None
    """The sender (``sysid * 256 + compid``) that verdicts are about, where they are about one alone."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Take the parameters of the rule that names the check, and the dialect of the recording."""
        self.params = params
        self.dialect = dialect

    def concerns_sender(self, sender: int) -> bool:
        """Return whether what a sender says is to be judged."""
        return self.only in (None, sender)

    @abstractmethod
    def update(self, batch: Batch, context: Context) -> None:
        """Read a batch."""

    @abstractmethod
    def finish(self) -> Iterable[Observation]:
        """Return what was found in the whole recording."""

    def figures(self, observation: Observation) -> tuple[Figure, ...]:  # noqa: ARG002
        """Return what proves an observation; asked for after `finish`, and only by reports that draw."""
        return ()

    @abstractmethod
    def verdict(self) -> Verdict:
        """Return how far the check could look."""


def load_check(name: str) -> type[Check]:
    """Return the class that ``module.Class`` names in this package; LookupError when there is none."""
    module_name, _, class_name = name.partition(".")
    if not (module_name.isidentifier() and class_name.isidentifier()):
        message = f"a check is named module.Class, not {name!r}"
        raise LookupError(message)
    try:
        module = importlib.import_module(f"{__package__}.{module_name}")
        found = getattr(module, class_name)
    except (ImportError, AttributeError) as error:
        message = f"there is no check called {name!r}"
        raise LookupError(message) from error
    if not (isinstance(found, type) and issubclass(found, Check)):
        raise LookupError(f"{name!r} is no check")  # noqa: TRY004  (the name is wrong, not a type)
    return found
