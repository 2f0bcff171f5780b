"""The command line as its users run it: a process, with a pipe or a terminal."""

import os
import pty
import subprocess
import sys

COMMAND = [sys.executable, "-m", "mdfconv"]


def run(*arguments, stdin="", cwd=None, **environment):
    """Run mdfconv in a pipe; return status, stdout and stderr."""
    done = subprocess.run(
        [*COMMAND, *map(str, arguments)],
        input=stdin if isinstance(stdin, bytes) else stdin.encode(),
        capture_output=True,
        env=os.environ | environment,
        cwd=cwd,
        timeout=120,
        check=False,
    )
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def run_on_terminal(*arguments, **environment):
    """Run mdfconv with standard output and error on a pseudo-terminal; return status, text."""
    parent, child = pty.openpty()
    process = subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        stdout=child,
        stderr=child,
        env=os.environ | {"TERM": "xterm-256color", "COLUMNS": "120"} | environment,
    )
    os.close(child)
    chunks = []
    while True:
        try:
            chunk = os.read(parent, 65536)
        except OSError:
            break
        if not chunk:
            break
        chunks.append(chunk)
    os.close(parent)
    return process.wait(timeout=120), b"".join(chunks).decode()
