"""The command line as its users run it: a process, with a pipe or a terminal.

A run is a fork of a server that has done the imports (see `server`). Only a run with a variable
that imports or the start may read, such as ``HOME`` or ``PYTHONHASHSEED``, is a new interpreter.
"""

import atexit
import io
import json
import os
import pty
import signal
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cache
from pathlib import Path

from mdfconv.cli import main

COMMAND = [sys.executable, "-m", "mdfconv"]
TIMEOUT = 120
# Variables that are read by each command, or by each new set of standard streams.
NOT_READ_BY_IMPORTS = {"COLUMNS", "NO_COLOR", "PYTHONIOENCODING", "TERM"}


def run(*arguments, stdin="", cwd=None, **environment):
    """Run mdfconv in a pipe; return status, stdout and stderr."""
    stdin_reader, stdin_writer = os.pipe()
    stdout_reader, stdout_writer = os.pipe()
    stderr_reader, stderr_writer = os.pipe()
    process = _start(arguments, (stdin_reader, stdout_writer, stderr_writer), environment, cwd)
    with ThreadPoolExecutor(3) as threads:
        threads.submit(_write, stdin_writer, stdin if isinstance(stdin, bytes) else stdin.encode())
        stdout = threads.submit(_read, stdout_reader)
        stderr = threads.submit(_read, stderr_reader)
        status = _end(process)
    return status, stdout.result().decode(), stderr.result().decode()


def run_here(*arguments, stdin=""):
    """Run mdfconv in this process, where faults can be injected; return as `run`."""
    before = sys.argv, sys.stdin, sys.stdout, sys.stderr
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2))
    sys.argv = ["mdfconv", *map(str, arguments)]
    sys.stdin = io.TextIOWrapper(io.BytesIO(stdin.encode()), "utf-8")
    sys.stdout, sys.stderr = out, err
    try:
        main()
    except SystemExit as end:
        status = end.code
    finally:
        sys.argv, sys.stdin, sys.stdout, sys.stderr = before
    return status, *(stream.buffer.getvalue().decode() for stream in (out, err))


def run_on_terminal(*arguments, **environment):
    """Run mdfconv with standard output and error on a pseudo-terminal; return status, text."""
    parent, child = pty.openpty()
    process = _start(
        arguments,
        (os.open(os.devnull, os.O_RDONLY), child, os.dup(child)),
        {"TERM": "xterm-256color", "COLUMNS": "120"} | environment,
    )
    with ThreadPoolExecutor(1) as threads:
        text = threads.submit(_read, parent)
        status = _end(process)
    return status, text.result().decode()


def _start(arguments, streams, environment, cwd=None):
    """Start a run on the descriptors of its standard streams, which are closed here."""
    arguments = [str(argument) for argument in arguments]
    variables = os.environ | environment
    try:
        if environment.keys() <= NOT_READ_BY_IMPORTS:
            return _ForkedProcess(_server(), arguments, streams, variables, cwd)
        stdin, stdout, stderr = streams
        return subprocess.Popen(
            [*COMMAND, *arguments],
            stdin=stdin,
            stdout=stdout,
            stderr=stderr,
            env=variables,
            cwd=cwd,
        )
    finally:
        for stream in streams:
            os.close(stream)


def _end(process):
    """Return the exit status of a run; kill one that takes too long."""
    try:
        return process.wait(TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        raise


def _write(descriptor, content):
    # A command that does not want its standard input closes it.
    with suppress(BrokenPipeError), open(descriptor, "wb", buffering=0) as pipe:
        while content:
            content = content[pipe.write(content) :]


def _read(descriptor):
    chunks = []
    # A pseudo-terminal ends with an error, a pipe with an empty chunk.
    with suppress(OSError):
        while chunk := os.read(descriptor, 65536):
            chunks.append(chunk)
    os.close(descriptor)
    return b"".join(chunks)


class _ForkedProcess:
    """A run as a fork of the server, with the methods of `subprocess.Popen`."""

    def __init__(self, server, arguments, streams, environment, cwd):
        self.server, self.arguments = server, arguments
        request = {
            "arguments": arguments,
            "environment": environment,
            "cwd": str(cwd or Path.cwd()),
        }
        socket.send_fds(server, [json.dumps(request).encode()], streams)
        self.number = self._answer()

    def wait(self, timeout=None):
        try:
            return self._answer(timeout)
        except TimeoutError:
            raise subprocess.TimeoutExpired(self.arguments, timeout) from None

    def kill(self):
        os.kill(self.number, signal.SIGKILL)

    def _answer(self, timeout=None):
        self.server.settimeout(timeout)
        message = self.server.recv(64)
        assert message, "the server of the command line has ended"
        return int(message)


@cache
def _server():
    """Start the server of this process; return the socket on which it takes requests."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    # Each request has its own, and the server shows what streams are without it.
    environment.pop("PYTHONIOENCODING", None)
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.cli.server", str(theirs.fileno())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=[theirs.fileno()],
            env=environment,
            cwd=Path(__file__).parents[2],
        )

    @atexit.register
    def _stop():
        ours.close()
        process.wait()

    return ours
