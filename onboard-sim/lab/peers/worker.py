"""One public solver in a process of its own: its libraries do not meet another's, and its crash does not end the run.

The entrants of a worker are called from the main process as if they were there. All processes share one core and take
turns.
"""

import importlib
import multiprocessing
import os
import traceback

CALLED = ("cold", "adopt", "hold", "warm", "quadratic")


def _serve(pipe, module, arguments):
    """Makes the entrants, says what they are, and does what is asked. Solvers that print print into nothing."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    try:
        version, entrants = importlib.import_module(module).entrants(*arguments)
    except Exception:
        pipe.send((None, traceback.format_exc()))
        return
    pipe.send((version, [(e.name, e.problem) for e in entrants]))
    while True:
        try:
            index, method, words, more = pipe.recv()
        except EOFError:
            return
        try:
            pipe.send((getattr(entrants[index], method)(*words, **more), None))
        except Exception:
            pipe.send((None, traceback.format_exc()))


class Entrant:
    """A solver on one of the two problems."""

    def __init__(self, pipe, index, name, problem):
        self.pipe, self.index, self.name, self.problem = pipe, index, name, problem

    def __getattr__(self, method):
        if method not in CALLED:
            raise AttributeError(method)

        def call(*words, **more):
            try:
                self.pipe.send((self.index, method, words, more))
                answer, wrong = self.pipe.recv()
            except (EOFError, BrokenPipeError) as error:
                raise SystemExit(f"{self.name}: its process ended at {method}{words}") from error
            if wrong:
                raise SystemExit(f"{self.name}: {wrong}")
            return answer

        return call


def start(module, *arguments):
    """(version, entrants) of `module.entrants(*arguments)`, in a process of their own."""
    context = multiprocessing.get_context("spawn")
    pipe, theirs = context.Pipe()
    context.Process(target=_serve, args=(theirs, module, arguments), daemon=True).start()
    theirs.close()
    version, made = pipe.recv()
    if version is None:
        raise SystemExit(f"{module}: {made}")
    return version, [Entrant(pipe, index, *what) for index, what in enumerate(made)]
