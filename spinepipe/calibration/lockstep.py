"""Several searches that each ask and wait, answered together: one stack of runs for all of them.

Each search is plain code in a thread of its own, but only one thread runs at any time, in the order
of the searches: what comes out does not depend on the machine.
"""

import threading
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

Question = TypeVar("Question")
Answer = TypeVar("Answer")
Result = TypeVar("Result")


class _Abandoned(BaseException):
    """Another search has failed; this one need not go on."""


class _Strand(Generic[Question, Answer, Result]):
    """One search: it runs until it asks, and on when it is answered.

    Attributes
    ----------
    question : what it waits for. ended : whether it waits no more.
    """

    def __init__(self, search: Callable[[Callable[[Question], Answer]], Result]) -> None:
        # two locks as a baton: the search's thread runs between `_go` and `_back`, its owner else
        self._search = search
        self._go, self._back = threading.Lock(), threading.Lock()
        self._go.acquire()
        self._back.acquire()
        self._answer: list[Answer] = []
        self.results: list[Result] = []
        self.trouble: BaseException | None = None
        self.question: Question
        self.ended = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self._resume()

    def _run(self) -> None:
        self._go.acquire()
        try:
            self.results = [self._search(self._ask)]
        except _Abandoned:
            pass
        except BaseException as trouble:
            self.trouble = trouble
        self.ended = True
        self._back.release()

    def _ask(self, question: Question) -> Answer:
        self.question = question
        self._back.release()
        self._go.acquire()
        if not self._answer:
            raise _Abandoned
        return self._answer.pop()

    def _resume(self) -> None:
        self._go.release()
        self._back.acquire()

    def answered(self, answer: Answer) -> None:
        """Go on with an answer until the next question."""
        self._answer.append(answer)
        self._resume()

    def abandon(self) -> None:
        """End it where it waits."""
        if not self.ended:
            self._resume()
        self._thread.join()


def in_lockstep(
    searches: Sequence[Callable[[Callable[[Question], Answer]], Result]],
    answers: Callable[[Sequence[tuple[int, Question]]], Sequence[Answer]],
) -> list[Result]:
    """The results of searches whose questions are answered round by round.

    Parameters
    ----------
    searches : each is given a function that answers its questions.
    answers : to the questions of all searches that wait, each with the number of its search.

    Raises
    ------
    BaseException
        What the first of the searches that failed has raised, or what ``answers`` has.
    """
    if len(searches) == 1:
        return [searches[0](lambda question: answers([(0, question)])[0])]
    strands: list[_Strand[Question, Answer, Result]] = []
    try:
        for search in searches:
            strands.append(_Strand(search))
            _raise_trouble(strands[-1])
        while waiting := [number for number, one in enumerate(strands) if not one.ended]:
            found = answers([(number, strands[number].question) for number in waiting])
            for number, answer in zip(waiting, found, strict=True):
                strands[number].answered(answer)
                _raise_trouble(strands[number])
    finally:
        for strand in strands:
            strand.abandon()
    return [strand.results[0] for strand in strands]


def _raise_trouble(strand: _Strand[Question, Answer, Result]) -> None:
    if strand.trouble is not None:
        raise strand.trouble
