"""A seeded fuzz of the core and the command line.

``python -m tests.fuzz --cases 100000 --seed 1`` prints how often what happened, and fails if
something was neither an answer nor a refusal: of a call an answer that its docstring allows or an
`MdfconvError`; of a command the exit status 0, 1 or 2, and for 2 one line on standard error.
"""

import argparse
import os
import random
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from tests.fuzz_api import API
from tests.fuzz_cli import CLI

# The commands take longer than the calls.
_SHARE_OF_COMMANDS = 0.15
_LONGEST = 30  # seconds
_SHOWN = 3
# Of a process at a time.
_BATCH = 500


def fuzz(numbers, seed, end=float("inf"), command=None):
    """Run cases; return how often each class of outcome came up, and examples of failures.

    Parameters
    ----------
    numbers : iterable of int
        Those of the cases.
    seed : int
        Of the random choices: the same cases for the same one.
    end : float, optional
        When to stop, of `time.time`.
    command : str, optional
        The only command to run.

    Returns
    -------
    outcomes : Counter
    failures : dict of str to list of str
    """
    outcomes, failures = Counter(), {}
    with _world():
        for number in numbers:
            if time.time() > end:
                break
            # A case can be had again by itself.
            choose = random.Random(f"{seed} {number}")
            kind = CLI if command or choose.random() < _SHARE_OF_COMMANDS else API
            name, case = kind.draw(choose, *([command] if command else []))
            try:
                with _within(_LONGEST):
                    outcome = kind.run(case)
            except Exception as error:
                outcome = _failed(error)
                failures.setdefault(outcome, []).append(f"{number}: {kind.text(case)}")
            outcomes[f"{name}: {outcome}"] += 1
    return outcomes, failures


def _failed(error):
    """Return the class of a failure: what was raised, and where in mdfconv."""
    places = [
        f"{Path(frame.filename).name}:{frame.lineno}"
        for frame in traceback.extract_tb(error.__traceback__)
        if "mdfconv" in frame.filename and "tests" not in Path(frame.filename).parts
    ]
    return f"FAILED {type(error).__name__}: {str(error)[:120]} ({', '.join(places[-2:])})"


@contextmanager
def _within(seconds):
    def late(number, frame):
        raise TimeoutError(f"takes more than {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _world():
    """Work in an empty folder, with the files that the commands read, and warnings as errors."""
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        os.chdir(folder)
        try:
            CLI.write_files()
            yield
        finally:
            os.chdir(here)


def main():
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--command", help="run this command only, such as fit")
    chosen = parser.parse_args()
    start, outcomes, failures = time.time(), Counter(), {}
    first = range(0, chosen.cases, _BATCH)
    batches = [range(number, min(number + _BATCH, chosen.cases)) for number in first]
    with ProcessPoolExecutor(chosen.jobs) as pool:
        run = partial(fuzz, seed=chosen.seed, end=start + chosen.seconds, command=chosen.command)
        for some, failed in pool.map(run, batches):
            outcomes += some
            for outcome, examples in failed.items():
                failures.setdefault(outcome, []).extend(examples)
            done, taken = outcomes.total(), time.time() - start
            print(f"\r{done} cases, {taken:.0f} s", end="", file=sys.stderr)
    print(file=sys.stderr)
    for outcome, count in sorted(outcomes.items()):
        if "FAILED" not in outcome:
            print(f"{count:7} {outcome}")
    for outcome, examples in sorted(failures.items(), key=lambda item: -len(item[1])):
        print(f"{len(examples):7} {outcome}")
        for example in examples[:_SHOWN]:
            print(f"          {example}")
    failed = sum(map(len, failures.values()))
    print(f"{done} cases in {taken:.0f} s, {done / taken:.0f} a second: {failed} failures")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
